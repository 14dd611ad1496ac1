"""`swarm schema`: what editors complete and check scene files by."""

import json
from pathlib import Path
from typing import Annotated

from .options import Option
from .shown import written


def schema(
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="OUT.json", help="Schema [default: print it].")
    ] = None,
    sweep: Annotated[bool, Option("--sweep", help="Of sweep files, which have a [sweep] table.")] = False,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace an existing file.")] = False,
) -> None:
    """Write the JSON Schema of scene files, by which editors complete and check them."""
    from ..authoring.schema import schema_of
    from ..authoring.texts import write_text

    text = json.dumps(schema_of(sweep), indent=1, ensure_ascii=False) + "\n"
    if output is None:
        print(text, end="")
        return
    written(write_text("schema", output, text, overwrite))

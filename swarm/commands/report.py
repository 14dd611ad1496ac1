"""`swarm report`: a page of a run, or of a sweep."""

from pathlib import Path
from typing import Annotated

from .options import Option, Positional
from .shown import written


def report(
    source: Annotated[Path, Positional(metavar="RUN", help="A trajectory RUN.h5, or the folder of a sweep.")],
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="OUT.html", help="Page [default: RUN.html].")
    ] = None,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace an existing page.")] = False,
) -> None:
    """Make a page of a run or a sweep, one file for any browser: verdicts, pictures, numbers, how to reproduce it."""
    from ..fleet.report import checked, page_of

    target = checked(source, output, overwrite)
    written(page_of(source, target).save(target, overwrite=overwrite))

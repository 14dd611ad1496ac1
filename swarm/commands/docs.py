"""`swarm docs`: the reference, as pages for a browser."""

from pathlib import Path
from typing import Annotated, Any

import click

from .options import Option


def docs(
    folder: Annotated[
        Path, Option("-o", "--output", metavar="FOLDER", help="Of the pages; index.html is the first.")
    ] = Path("swarm-docs"),
    overwrite: Annotated[bool, Option("--overwrite", help="Replace the pages that the folder holds.")] = False,
) -> None:
    """Write the reference: pages of all public names, observables, keys of scene files and commands."""
    from ..authoring.reference import write

    app: Any = click.get_current_context().find_root().command
    print(f"written to {write(folder, app.commands, overwrite)}")

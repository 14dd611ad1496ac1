"""`swarm new`, `check`, `schema` and `docs`: scene files before a run, and the reference."""

import json
from pathlib import Path
from typing import Annotated, Any

import click

from .options import Option, Positional
from .shown import Plugins, table, written


def new(
    kind: Annotated[str, Positional(metavar="KIND", help="cavity, hopper, billiard, gas or mechanism.")],
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="SCENE.toml", help="File [default: KIND.toml, here].")
    ] = None,
) -> None:
    """Write a scene file with comments to begin with."""
    from ..authoring.starters import begin

    print(f"written to {(path := begin(kind, output))}; next:  swarm run {path}")


def check(
    scene_file: Annotated[Path, Positional(metavar="SCENE.toml", help="A scene file, or a sweep file.")],
    output: Annotated[
        Path | None,
        Option("-o", "--output", metavar="OUT", help="Trajectory [default: SCENE.h5, here], or folder of a sweep."),
    ] = None,
    threads: Annotated[int | None, Option(help="Threads [default: all cores].")] = None,
    plugins: Plugins = None,
) -> None:
    """Say what a scene or sweep file will do, with hints, sizes and about its time, without running it."""
    from ..authoring.outlook import outlook_of_file

    table(outlook_of_file(scene_file, output, threads, plugins or ()))


def schema(
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="OUT.json", help="Schema [default: print it].")
    ] = None,
    sweep: Annotated[bool, Option("--sweep", help="Of sweep files, which have a [sweep] table.")] = False,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace an existing file.")] = False,
) -> None:
    """Write the JSON Schema of scene files, by which editors complete and check them."""
    from ..authoring.schema import schema_of
    from ..files import marks

    text = json.dumps(schema_of(sweep), indent=1, ensure_ascii=False) + "\n"
    if output is None:
        print(text, end="")
        return
    written(marks.write(output, text.encode(), "schema", overwrite))


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

"""`swarm check`: what a scene file will do."""

from pathlib import Path
from typing import Annotated

from .options import Option, Positional
from .shown import Plugins, table


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

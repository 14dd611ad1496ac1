"""`swarm info`: what a file holds."""

from pathlib import Path
from typing import Annotated

from ..errors import SceneError
from .options import Option, Positional
from .shown import table


def info(
    file: Annotated[
        Path, Positional(metavar="FILE", help="A trajectory or a log of impacts (.h5), or a recording (.rrd).")
    ],
    repair: Annotated[bool, Option("--repair", help="Repair a recording that a crash truncated, in place.")] = False,
) -> None:
    """Show what a trajectory, a log of impacts or a recording holds."""
    from . import summary

    if file.suffix == ".rrd":
        table(summary.of_recording(file, repair))
    elif repair:
        raise SceneError(f"--repair is for recordings (.rrd), got {file}; a trajectory needs none")
    else:
        table(summary.of_file(file))

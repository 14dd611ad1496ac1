"""`swarm info` and `swarm export`: the content of files, and trajectories for other programs."""

import sys
from pathlib import Path
from typing import Annotated

from ..errors import SceneError
from .options import Option, Positional
from .shown import TrajectoryFile, table, written

# A larger number of files is printed as a range.
_FEW = 2


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


def export(
    file: TrajectoryFile,
    output: Annotated[
        Path, Option("-o", "--output", metavar="OUT", help="OUT.vtkhdf, .xyz, .gsd, .ply, .csv, or .obj of the walls.")
    ],
    frames: Annotated[
        str | None,
        Option(
            metavar="A:B:K", help="Frames A to before B, every K-th, or one, as -1 [default: all; of .obj the first]."
        ),
    ] = None,
    particles: Annotated[int, Option(metavar="K", help="Every K-th particle or body.")] = 1,
    surfaces: Annotated[
        bool, Option("--surfaces/--no-surfaces", help="With .vtkhdf, also the walls: OUT.surfaces.vtkhdf.")
    ] = True,
    overwrite: Annotated[bool, Option("--overwrite", help="Replace existing files.")] = False,
) -> None:
    """Write a trajectory for ParaView (.vtkhdf), OVITO and ASE (.xyz), HOOMD-blue and freud (.gsd), as files of frames
    for Blender, games and MeshLab (.ply), for spreadsheets (.csv), or its walls for them and CAD (.obj)."""  # noqa: D205, D209
    from rich.console import Console
    from rich.progress import Progress

    from ..files.trajectory import load

    chosen = None if frames is None else _frames(frames)
    hidden = not sys.stderr.isatty()
    with load(file) as trajectory, Progress(console=Console(stderr=True), transient=True, disable=hidden) as bar:
        task = bar.add_task("frames")
        files = trajectory.export(
            output, chosen, particles, surfaces, overwrite,
            lambda done, total: bar.update(task, completed=done, total=total),
        )  # fmt: skip
    if len(files) > _FEW:
        size = sum(path.stat().st_size for path in files) / 1e6
        print(f"written to {files[0]} to {files[-1]} ({len(files)} files, {size:.1f} MB)")
        return
    for path in files:
        written(path)


def _frames(text: str) -> slice | int:
    """Return the number, or the slice of Python, of a text such as -1 or 2:10:4."""
    try:
        parts = [int(part) if part.strip() else None for part in text.split(":")]
        if len(parts) == 1 and parts[0] is not None:
            return parts[0]
        if 2 <= len(parts) <= 3:
            return slice(*parts)
    except ValueError:
        pass
    raise SceneError(f"--frames must be a number, or A:B or A:B:K as for a slice of Python, got {text!r}")

"""Trajectories in the formats of other programs, chosen by the suffix of the file.

.vtkhdf (vtkhdf.py) for ParaView and VTK, .xyz (xyz.py) for OVITO and ASE, .gsd (gsd.py) for HOOMD-blue and freud.
A frame is in memory at a time. 10 000 particles and 500 frames take, read and written, 0.9 s of one core and 280 MB as
.vtkhdf, 5.5 s and 660 MB as .xyz, 1.1 s and 200 MB as .gsd.
"""

import contextlib
import importlib
from pathlib import Path
from typing import Any

from .. import checks
from ..errors import SceneError
from ..extras import needed_by
from . import paths
from .exported import Exported, Progress
from .replaced import named_when_whole

SUFFIXES = (".vtkhdf", ".xyz", ".gsd")


def export(
    trajectory: Any,
    path: str | Path,
    frames: slice | int | None,
    particles: int,
    surfaces: bool,
    overwrite: bool,
    progress: Progress | None,
) -> list[Path]:
    """Write a trajectory to a file of another format; see `Trajectory.export`."""
    target = paths.target_of("path", path)
    kind = target.suffix.lower()
    if kind not in SUFFIXES:
        raise SceneError(f"export: expected a file name that ends in {', '.join(SUFFIXES)}, got {target}")
    checks.flag("surfaces", surfaces)
    chosen = Exported(trajectory, frames, particles, progress)
    targets = [target]
    if kind == ".vtkhdf" and surfaces and trajectory.scene.surfaces:
        targets.append(target.with_suffix(".surfaces.vtkhdf"))
    for one in targets:
        paths.check_distinct({"export": one}, {"trajectory": trajectory.path})
        paths.check_target(one, overwrite, "export")
    # What is missing is found before anything is written.
    with needed_by(f"an export as {kind}", "gsd"):
        form = importlib.import_module(f".{kind[1:]}", __package__)
    with contextlib.ExitStack() as stack:
        if len(targets) > 1:
            with needed_by("an export with surfaces, which --no-surfaces or surfaces=False leaves out,", "plot"):
                from . import walls
            drawn = walls.shapes(chosen)
            walls.write_walls(chosen, drawn, stack.enter_context(named_when_whole(targets[1])))
        form.write(chosen, stack.enter_context(named_when_whole(target)))
    return targets

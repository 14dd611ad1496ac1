"""Trajectories in the formats of other programs, chosen by the suffix of the file.

.vtkhdf (vtkhdf.py) for ParaView and VTK, .xyz (xyz.py) for OVITO and ASE, .gsd (gsd.py) for HOOMD-blue and freud, .ply
(ply.py), a file a frame, for Blender and games, .csv (spreadsheet.py) for spreadsheets and pandas; .obj (obj.py) has
the walls at one frame. It holds one frame in memory. 10 000 particles and 500 frames take, read and written, 0.9 s of
one core and 280 MB as .vtkhdf, 5.5 s and 660 MB as .xyz, 1.1 s and 200 MB as .gsd, 1.2 s and 195 MB as .ply, 7.6 s and
710 MB as .csv.
"""

import importlib
from pathlib import Path
from typing import Any

from ..common import checks
from ..common.extras import needed_by
from ..errors import SceneError
from ..files import marks, paths
from ..files.replaced import together
from ..triangles.solids import is_many
from .exported import Exported, Progress, numbers_of

# The modules of the formats.
_FORMS = {
    ".vtkhdf": "vtkhdf", ".xyz": "xyz", ".gsd": "gsd", ".ply": "ply", ".csv": "spreadsheet", ".obj": "obj",
}  # fmt: skip
# The number of files of particles and of walls; there may be another one of solids.
_WITH_WALLS = 2
SUFFIXES = tuple(_FORMS)


def export(
    trajectory: Any,
    path: str | Path,
    frames: slice | int | None,
    particles: int,
    surfaces: bool,
    overwrite: bool,
    progress: Progress | None,
) -> list[Path]:
    """Write a trajectory to files of another format; see `Trajectory.export`."""
    target = paths.target_of("path", path)
    kind = target.suffix.lower()
    if kind not in SUFFIXES:
        raise SceneError(f"export: expected a file name that ends in {', '.join(SUFFIXES)}, got {target}")
    checks.flag("surfaces", surfaces)
    if kind == ".obj":
        _require_walls(trajectory, frames, particles, surfaces)
        trajectory.require_frames()
        (number,) = numbers_of(frames or 0, len(trajectory))
    else:
        chosen = Exported(trajectory, frames, particles, progress)
    # Missing packages are found before the first file is written.
    with needed_by(f"an export as {kind}", "gsd" if kind == ".gsd" else "plot"):
        form = importlib.import_module(f".{_FORMS[kind]}", __package__)
    targets, stale = [target], list[Path]()
    if kind == ".obj":
        targets.append(form.materials_of(target))
    elif kind == ".ply":
        targets = form.names_of(target, len(chosen.numbers))
        stale = [one for one in form.older(target) if one not in targets] if len(targets) > 1 else []
    elif kind == ".vtkhdf" and surfaces and trajectory.scene.surfaces:
        targets.append(target.with_suffix(".surfaces.vtkhdf"))
        if any(map(is_many, trajectory.scene.surfaces)):
            targets.append(target.with_suffix(".solids.vtkhdf"))
        with needed_by("an export with surfaces, which --no-surfaces or surfaces=False leaves out,", "plot"):
            from . import walls  # noqa: F401  missing packages are found before the first file is written
    for one in (*targets, *stale):
        paths.check_distinct({"export": one}, {"trajectory": trajectory.path})
        marks.check_target(one, overwrite, "export")
    with together(target, targets, stale) as parts:
        if kind == ".obj":
            form.write_objects(trajectory, number, *parts)
            if progress is not None:
                progress(1, 1)
        else:
            _write(form, chosen, parts)
    return targets


def _write(form: Any, chosen: Exported, parts: list[Path]) -> None:
    """Write the particles and, if there are files for them, the walls and the solids of large fields."""
    if form.__name__.endswith(".ply"):
        form.write_sequence(chosen, parts)
        return
    if len(parts) > 1:
        from . import walls

        walls.write_walls(chosen, parts[1])
    if len(parts) > _WITH_WALLS:
        walls.write_solids(chosen, parts[2])
    form.write(chosen, parts[0])


def _require_walls(trajectory: Any, frames: slice | int | None, particles: int, surfaces: bool) -> None:
    """Raise a `SceneError` if the arguments for an .obj are not those of the walls at one frame."""
    if not surfaces or particles != 1:
        got = "surfaces=False (--no-surfaces)" if not surfaces else f"particles={particles!r}"
        raise SceneError(f"export: an .obj has the walls, and no particles; leave out {got}, or write another format")
    if isinstance(frames, slice):
        raise SceneError(f"export: an .obj has the walls at one frame; frames must be its number, got {frames}")
    if not trajectory.scene.surfaces:
        raise SceneError("export: an .obj has the walls, and this scene has no surfaces; write another format")

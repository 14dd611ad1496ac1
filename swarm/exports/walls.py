"""The walls of a trajectory as VTKHDF: triangles, and the solids of large fields, at rest or moved in each frame.

Cells of triangles have the data "surface", the index in `scene.surfaces`, and "solid", 1 if particles are kept
outside; with unions also "part", the number of the part among all parts, or -1. In a run with
`member_impacts` they have "impacts", "residence" [s], "heat" [J] and "absorbed" of their member until the frame: of the
triangle of a mesh, the solid of a field, the part of a union, or the surface; NaN for a side of an outline.

The solids of fields of more than 2000 are points of a file of their own: with "surface", "kind" (0 spheres, 1 boxes,
2 cylinders, 3 capsules, 4 ellipsoids), "radius" [m] if it has one, "halves", half of the extent along its axes
[m], and "orientation", a quaternion (w, x, y, z). ParaView draws spheres as Point Gaussian, or by Glyph of a Sphere of
radius 1 that is scaled by "radius". It draws others by Glyph of a Box, Cylinder or Sphere of half widths 1 that is
scaled by "halves" and turned by "orientation", in mode Quaternion. A million solids take 120 MB.
"""

import bisect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..scene import Scene
from ..triangles.shape import Shape
from ..triangles.shapes import shapes_of, since_start
from ..triangles.solids import MANY, Solids, is_many, solids_of
from . import vtkhdf
from .exported import Exported

KINDS = ("spheres", "boxes", "cylinders", "capsules", "ellipsoids")


def write_walls(chosen: Exported, path: Path) -> None:
    """Write the walls, with open ones extended to the particles in the first frame.

    Where walls or openings appear and disappear, each state of the walls is a part with cells of its own, and a step
    has the part of its frame. Walls that only move have the same cells in all frames, and points of their own in each.
    """
    trajectory, scene = chosen.trajectory, chosen.trajectory.scene
    positions, comes = trajectory.frame(chosen.numbers[0]).position, bool(scene.instants)
    states: dict[tuple[int, float], int] = {}
    found, of_steps = list[list[Shape]](), list[int]()
    for time in chosen.times.tolist() if comes else [0.0] * len(chosen.numbers):
        state = bisect.bisect_right(scene.instants, time), time if scene.moves() else 0.0
        if state not in states:
            states[state] = len(found)
            found.append(shapes_of(scene, positions, time, most=MANY))
        of_steps.append(states[state])
    which, moves = np.array(of_steps), scene.moves() and not comes
    points = [sum(len(shape.vertices) for shape in drawn) for drawn in found]
    counts = [sum(len(shape.triangles) for shape in drawn) for drawn in found]
    with h5py.File(path, "w") as file:
        root = vtkhdf.begin(file, {"Polygons": [_triangles(drawn) for drawn in found]}, points)
        if moves:
            _write_moved(chosen, found[0], root)
        else:
            root["Points"] = np.concatenate([shape.vertices for drawn in found for shape in drawn])
        data = [_data_of(scene, drawn) for drawn in found]
        for name in data[0]:
            root[f"CellData/{name}"] = np.concatenate([one[name] for one in data])
        if not (comes or moves or trajectory.members()):
            return
        firsts = points[0] * np.arange(len(which)) if moves else np.cumsum([0, *points])[which]
        steps, cells = vtkhdf.timed(root, chosen, firsts), np.cumsum([0, *counts])[which]
        steps["PartOffsets"][...] = which
        steps["ConnectivityIdOffsets"][:, vtkhdf.CELLS.index("Polygons")] = 3 * cells
        for name in root["CellData"]:
            steps[f"CellDataOffsets/{name}"] = cells
        _write_members(chosen, [found[state] for state in of_steps], root, steps)


def _write_moved(chosen: Exported, drawn: list[Shape], root: Any) -> None:
    """Write the points in all frames of walls drawn at the start."""
    seen = chosen.trajectory.observables
    firsts = np.cumsum([0, *(len(shape.vertices) for shape in drawn)])
    points = root.create_dataset("Points", (len(chosen.numbers) * firsts[-1], 3), np.float64)
    for done, number in enumerate(chosen.numbers):
        places = seen["wall_position"][number], seen["wall_orientation"][number]
        for shape, first in zip(drawn, done * firsts[-1] + firsts[:-1], strict=True):
            turn, way = since_start(chosen.trajectory.scene, shape, seen["time"][number], places)
            points[first : first + len(shape.vertices)] = shape.vertices @ turn.T + way


def _data_of(scene: Scene, drawn: list[Shape]) -> dict[str, NDArray[np.int64]]:
    """The data of the cells of some shapes."""
    data = {"surface": [shape.surface for shape in drawn], "solid": [int(shape.solid) for shape in drawn]}
    if parts := scene.parts:
        data["part"] = [parts.index((shape.surface, shape.place)) if shape.place else -1 for shape in drawn]
    counts = [len(shape.triangles) for shape in drawn]
    return {name: np.repeat(np.array(numbers, np.int64), counts) for name, numbers in data.items()}


def _write_members(chosen: Exported, drawn: list[list[Shape]], root: Any, steps: Any) -> None:
    """Write the sums of each cell's member until each frame; `drawn` are the walls at each frame."""
    counts = [sum(len(shape.triangles) for shape in some) for some in drawn]
    firsts = np.cumsum([0, *counts])
    for name in chosen.trajectory.members():
        values = root.create_dataset(f"CellData/{name}", (firsts[-1],), np.float64)
        steps[f"CellDataOffsets/{name}"] = firsts[:-1]
        for k, number in enumerate(chosen.numbers):
            of_members = chosen.trajectory.members(number)[name]
            cells = [_of_cells(chosen.trajectory.scene, shape, of_members[shape.surface]) for shape in drawn[k]]
            values[firsts[k] : firsts[k + 1]] = np.concatenate(cells)


def _of_cells(scene: Scene, shape: Shape, of_members: Any) -> Any:
    """For each triangle of a shape the value of its member; NaN if that is not known."""
    if shape.place:
        number: Any = scene.parts.index((shape.surface, shape.place))
    else:
        number = shape.members if len(of_members) > 1 else 0
    return np.full(len(shape.triangles), np.nan if number is None else of_members[number], np.float64)


def _triangles(drawn: list[Shape]) -> Any:
    """The triangles of shapes, with indices into the points of all shapes."""
    firsts = np.cumsum([0, *(len(shape.vertices) for shape in drawn)])
    return np.concatenate([shape.triangles + first for shape, first in zip(drawn, firsts, strict=False)])


# The data of each solid, with the type and the shape of an entry.
_DATA: dict[str, tuple[Callable[[Solids], Any], Any, tuple[int, ...]]] = {
    "surface": (lambda one: np.full(len(one.centers), one.surface), np.int64, ()),
    "kind": (lambda one: np.full(len(one.centers), KINDS.index(one.kind)), np.int64, ()),
    "radius": (lambda one: np.where(one.kind in ("boxes", "ellipsoids"), np.nan, one.halves[:, 0]), np.float64, ()),
    "halves": (lambda one: one.halves, np.float64, (3,)),
    "orientation": (lambda one: one.turns, np.float64, (4,)),
    "Points": (lambda one: one.centers, np.float64, (3,)),
}
# The data of a moving solid.
_MOVED = ("orientation", "Points")


def write_solids(chosen: Exported, path: Path) -> None:
    """Write the solids of large fields as points: in each frame the solids that are present."""
    scene, times = chosen.trajectory.scene, chosen.times.tolist()
    come = any(surface.present is not None for surface in scene.surfaces if is_many(surface))
    frames = len(times) if come or scene.moves() else 1
    counts = [sum(len(one.centers) for one in solids_of(scene, time)) for time in times[:frames]]
    firsts = np.cumsum([0, *counts])
    # As for particles: if the number changes, each step has a part of its own.
    parts = counts if len(set(counts)) > 1 else counts[:1]
    with h5py.File(path, "w") as file:
        root = vtkhdf.begin(file, {"Vertices": np.arange(max(counts))[:, None]}, parts)
        steps = vtkhdf.timed(root, chosen, firsts[:-1]) if come or scene.moves() else None
        for name, (_of_one, kind, width) in _DATA.items():
            # Constant data are stored once.
            rows = firsts if come or name in _MOVED else firsts[:2]
            data = root.create_dataset(name if name == "Points" else f"PointData/{name}", (rows[-1], *width), kind)
            for k in range(len(rows) - 1):
                there = solids_of(scene, times[k])
                data[rows[k] : rows[k + 1]] = np.concatenate([np.empty((0, *width)), *map(_of_one, there)])
            if steps is not None and name != "Points":
                steps[f"PointDataOffsets/{name}"] = (
                    firsts[:-1] if come or name in _MOVED else np.zeros(frames, np.int64)
                )

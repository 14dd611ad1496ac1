"""The walls of a trajectory as a VTKHDF file of triangles: at rest, or where they are in every frame.

Cells have the data "surface", the place in `scene.surfaces`, and "solid", 1 where particles are kept out of it.
"""

from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from ..motion import pose
from ..surfaces.rotation import matrix
from . import vtkhdf
from .exported import Exported
from .shapes import Shape, shapes_of

# Bodies of one surface that are drawn: each has some 200 vertices.
_MOST = 20_000


def shapes(chosen: Exported) -> list[Shape]:
    """The walls at the start, as far as there were particles in the first frame that is exported."""
    positions = chosen.trajectory.frame(chosen.numbers[0]).position
    return shapes_of(chosen.trajectory.scene, positions, most=_MOST)


def write(chosen: Exported, drawn: list[Shape], path: Path) -> None:
    """Write the walls."""
    firsts = np.cumsum([0, *(len(shape.vertices) for shape in drawn)])
    triangles = np.concatenate([shape.triangles + first for shape, first in zip(drawn, firsts, strict=False)])
    moves = chosen.trajectory.scene.moves()
    with h5py.File(path, "w") as file:
        root = vtkhdf.begin(file, {"Polygons": triangles}, int(firsts[-1]))
        counts = [len(shape.triangles) for shape in drawn]
        root["CellData/surface"] = np.repeat(np.arange(len(drawn)), counts)
        root["CellData/solid"] = np.repeat([int(shape.solid) for shape in drawn], counts)
        if not moves:
            root["Points"] = np.concatenate([shape.vertices for shape in drawn])
            return
        steps = vtkhdf.timed(root, chosen, int(firsts[-1]))
        for name in ("surface", "solid"):
            steps[f"CellDataOffsets/{name}"] = np.zeros(len(chosen.numbers), np.int64)
        points = root.create_dataset("Points", (len(chosen.numbers) * firsts[-1], 3), np.float64)
        seen = chosen.trajectory.observables
        for done, number in enumerate(chosen.numbers):
            for i, (shape, first) in enumerate(zip(drawn, done * firsts[-1] + firsts[:-1], strict=True)):
                places = _placed(chosen, shape, i, seen["wall_position"][number], seen["wall_orientation"][number])
                points[first : first + len(places)] = places


def _placed(
    chosen: Exported, shape: Shape, i: int, position: NDArray[np.float64], orientation: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The vertices of surface i, drawn where it is at the start, where it is in a frame."""
    surface = chosen.trajectory.scene.surfaces[i]
    if surface.motion is None and not surface.reacts():
        return shape.vertices
    first = pose(surface.motion, 0.0)
    # x1 = A1 A0^T (x0 - p0) + p1, with places p of the origin
    turn = matrix(tuple(orientation[i])) @ first.turn.T
    return np.asarray((shape.vertices - first.position()) @ turn.T + position[i])

"""The walls of a trajectory as a VTKHDF file of triangles: at rest, or where they are in every frame.

Cells have the data "surface", the place in `scene.surfaces`, and "solid", 1 where particles are kept out of it; where
there are unions also "part", the number of the part among those of all of them, or -1.
"""

from pathlib import Path

import h5py
import numpy as np

from . import vtkhdf
from .exported import Exported
from .shape import Shape
from .shapes import shapes_of, since_start

# Bodies of one surface that are drawn: each has some 200 vertices.
_MOST = 20_000


def shapes(chosen: Exported) -> list[Shape]:
    """The walls at the start, as far as there were particles in the first frame that is exported."""
    positions = chosen.trajectory.frame(chosen.numbers[0]).position
    return shapes_of(chosen.trajectory.scene, positions, most=_MOST)


def write_walls(chosen: Exported, drawn: list[Shape], path: Path) -> None:
    """Write the walls."""
    firsts = np.cumsum([0, *(len(shape.vertices) for shape in drawn)])
    triangles = np.concatenate([shape.triangles + first for shape, first in zip(drawn, firsts, strict=False)])
    with h5py.File(path, "w") as file:
        root = vtkhdf.begin(file, {"Polygons": triangles}, int(firsts[-1]))
        counts = [len(shape.triangles) for shape in drawn]
        root["CellData/surface"] = np.repeat([shape.surface for shape in drawn], counts)
        root["CellData/solid"] = np.repeat([int(shape.solid) for shape in drawn], counts)
        if parts := chosen.trajectory.scene.parts:
            numbers = [parts.index((shape.surface, shape.place)) if shape.place else -1 for shape in drawn]
            root["CellData/part"] = np.repeat(numbers, counts)
        if not chosen.trajectory.scene.moves():
            root["Points"] = np.concatenate([shape.vertices for shape in drawn])
            return
        steps = vtkhdf.timed(root, chosen, int(firsts[-1]))
        for name in root["CellData"]:
            steps[f"CellDataOffsets/{name}"] = np.zeros(len(chosen.numbers), np.int64)
        points = root.create_dataset("Points", (len(chosen.numbers) * firsts[-1], 3), np.float64)
        seen = chosen.trajectory.observables
        for done, number in enumerate(chosen.numbers):
            places = seen["wall_position"][number], seen["wall_orientation"][number]
            for shape, first in zip(drawn, done * firsts[-1] + firsts[:-1], strict=True):
                turn, way = since_start(chosen.trajectory.scene, shape, seen["time"][number], places)
                points[first : first + len(shape.vertices)] = shape.vertices @ turn.T + way

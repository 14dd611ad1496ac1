"""VTKHDF, the HDF5 format of VTK and ParaView: particles of all frames as one PolyData that changes in time.

https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/vtkhdf_specifications.html: the points of all steps
follow one another, and Steps has the first one of each; constant data are stored once. Read by VTK 9.3 and
9.7; ParaView was not tried. The walls are a file of their own (walls.py): blocks of one file need VTK 9.4; its reader
fails if steps are also at its root, while that of VTK 9.7 shows the first step for ever if they are not.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from .exported import Exported

VERSION = (2, 0)
# The order of the columns of CellOffsets and ConnectivityIdOffsets.
CELLS = ("Vertices", "Lines", "Polygons", "Strips")
# Digits of a number that a user types, and the largest distance of a multiple of it from the nearest float, in units
# in the last place.
_DIGITS, _ROUND_OFF = 12, 4.0


def write(chosen: Exported, path: Path) -> None:
    """Write the present particles; bonds of bodies are lines."""
    n, frames, counts = len(chosen), len(chosen.numbers), chosen.counts
    firsts = np.cumsum([0, *counts])
    # If particles come, each step has a part of its own. Present particles are the first ones, so the parts share
    # constant data and cells.
    parts = counts if len(set(counts)) > 1 else counts[:1]
    # Any of the balls may be present: a blocked birth comes later than others, or never.
    feeds = chosen.radius is not None and chosen.trajectory.has_births()
    with h5py.File(path, "w") as file:
        root = begin(file, {"Vertices": np.arange(n)[:, None], "Lines": chosen.bonds}, parts)
        steps = timed(root, chosen, firsts[:-1])
        values: dict[str, Any] = {}
        for done, moment in enumerate(chosen.moments()):
            columns = {"position": moment.position, "velocity": moment.velocity, **moment.more}
            if feeds and moment.radius is not None:
                columns |= {"id": moment.ids, "mass": moment.mass, "radius": moment.radius}
            for name, column in columns.items():
                if name not in values:
                    where = "Points" if name == "position" else f"PointData/{name}"
                    values[name] = root.create_dataset(where, (firsts[-1], *column.shape[1:]), column.dtype)
                    if name != "position":
                        steps[f"PointDataOffsets/{name}"] = firsts[:-1]
                values[name][firsts[done] : firsts[done + 1]] = column
        balls = {} if chosen.radius is None else {"radius": chosen.radius}
        for name, constant in {} if feeds else {"id": chosen.ids, "mass": chosen.mass, **balls}.items():
            root[f"PointData/{name}"], steps[f"PointDataOffsets/{name}"] = constant, np.zeros(frames, np.int64)


def begin(file: h5py.File, cells: dict[str, Any], parts: Sequence[int]) -> Any:
    """Create the root of a PolyData with these cells, each a row of points, in parts with these numbers of points.

    If there is more than one part, each has the first of the vertices, one a point. Other cells are the same in all
    parts, or a list with an array for each part.
    """
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array(VERSION)
    # VTK reads a text of fixed length only.
    root.attrs["Type"] = np.bytes_(b"PolyData")
    root["NumberOfPoints"] = np.array(parts)
    for name in CELLS:
        rows = cells.get(name, np.zeros((0, 1), np.int64))
        if isinstance(rows, list):
            each, most, rows = np.array([len(one) for one in rows]), max(map(len, rows)), np.concatenate(rows)
        else:
            is_first = name == "Vertices" and len(rows) > 0 and len(parts) > 1
            each, most = np.array(parts) if is_first else np.full(len(parts), len(rows)), len(rows)
        root[f"{name}/NumberOfCells"], root[f"{name}/NumberOfConnectivityIds"] = each, rows.shape[1] * each
        root[f"{name}/Connectivity"] = rows.astype(np.int64).ravel()
        # The offsets of the part with the most cells, which all parts share: a step begins at the first.
        root[f"{name}/Offsets"] = rows.shape[1] * np.arange(most + 1)
    return root


def timed(root: Any, chosen: Exported, firsts: NDArray[np.int64]) -> Any:
    """Create the steps, each with the index of its first point, and with a part of its own if there are several."""
    frames = len(chosen.numbers)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = frames
    steps["Values"] = [as_typed(time) for time in chosen.times.tolist()]
    # If all steps have one part, VTK 9.3 does not look for cells of other parts behind it.
    several = len(root["NumberOfPoints"]) > 1
    steps["PartOffsets"] = np.arange(frames) if several else np.zeros(frames, np.int64)
    steps["NumberOfParts"] = np.ones(frames, np.int64)
    steps["PointOffsets"] = firsts
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((frames, len(CELLS)), np.int64)
    return steps


def as_typed(time: float) -> float:
    """The decimal of few digits that equals a time up to round-off, or the time: 0.3 for frame 3 at every 0.1 s.

    Programs look for the last step at or before a time that a user types, and 0.30000000000000004 is after it.

    >>> as_typed(3 * 0.1), as_typed(1.0 / 3.0)
    (0.3, 0.3333333333333333)
    """
    typed = float(f"{time:.{_DIGITS}g}")
    return typed if abs(typed - time) <= _ROUND_OFF * math.ulp(time) else time

"""VTKHDF, the HDF5 format of VTK and ParaView: particles of all frames as one PolyData that changes in time.

https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/vtkhdf_specifications.html: the points of all steps
follow one another, and Steps says where those of each begin; what does not change is there once. Read by VTK 9.3 and
9.7; ParaView was not tried. The walls are a file of their own (walls.py): blocks of one file need VTK 9.4, whose reader
fails if steps are also at its root, while that of VTK 9.7 shows the first step for ever if they are not.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from .exported import Exported

VERSION = (2, 0)
# In the order of the columns of CellOffsets and ConnectivityIdOffsets.
CELLS = ("Vertices", "Lines", "Polygons", "Strips")


def write(chosen: Exported, path: Path) -> None:
    """Write the particles; bonds of bodies are lines."""
    n, frames = len(chosen), len(chosen.numbers)
    with h5py.File(path, "w") as file:
        root = begin(file, {"Vertices": np.arange(n)[:, None], "Lines": chosen.bonds}, n)
        steps = timed(root, chosen, n)
        values: dict[str, Any] = {}
        for done, moment in enumerate(chosen.moments(absent=True)):
            columns = {"position": moment.position, "velocity": moment.velocity, **moment.more}
            for name, column in columns.items():
                if name not in values:
                    where = "Points" if name == "position" else f"PointData/{name}"
                    values[name] = root.create_dataset(where, (frames * n, *column.shape[1:]), column.dtype)
                    if name != "position":
                        steps[f"PointDataOffsets/{name}"] = n * np.arange(frames)
                values[name][done * n : (done + 1) * n] = column
        balls = {} if chosen.radius is None else {"radius": chosen.radius}
        for name, constant in {"id": chosen.ids, "mass": chosen.mass, **balls}.items():
            root[f"PointData/{name}"], steps[f"PointDataOffsets/{name}"] = constant, np.zeros(frames, np.int64)


def begin(file: h5py.File, cells: dict[str, NDArray[np.int64]], points: int) -> Any:
    """The root of a PolyData of one part with these cells, rows of as many points as each has."""
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array(VERSION)
    # VTK reads a text of fixed length only.
    root.attrs["Type"] = np.bytes_(b"PolyData")
    root["NumberOfPoints"] = np.array([points])
    for name in CELLS:
        rows = cells.get(name, np.zeros((0, 1), np.int64))
        root[f"{name}/NumberOfConnectivityIds"], root[f"{name}/NumberOfCells"] = [rows.size], [len(rows)]
        root[f"{name}/Connectivity"] = rows.astype(np.int64).ravel()
        root[f"{name}/Offsets"] = rows.shape[1] * np.arange(len(rows) + 1)
    return root


def timed(root: Any, chosen: Exported, points: int) -> Any:
    """Its steps, each of which has so many points of its own, and the cells of all."""
    frames = len(chosen.numbers)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = frames
    steps["Values"] = chosen.times
    # All steps have the one part: VTK 9.3 would look for cells of others behind its own.
    steps["PartOffsets"], steps["NumberOfParts"] = np.zeros(frames, np.int64), np.ones(frames, np.int64)
    steps["PointOffsets"] = points * np.arange(frames)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((frames, len(CELLS)), np.int64)
    return steps

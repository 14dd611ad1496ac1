#!/usr/bin/env bash
# Of a file with many steps the first one is read, and the reader has no times.
#
# PyVista 0.49.1. A `.vtkhdf` with steps is ParaView's own format of series. `pyvista.read` gives the first step;
# `pyvista.get_reader` gives an `HDFReader`, which is no `TimeReader`: it has no `time_values` and no
# `set_active_time_value`, though VTK's reader below it has the steps. So a series looks like a file of one frame.
# `reader.reader.UpdateInformation()` and `reader.reader.SetStep(k)` before `reader.read()` give step k.
#
# Seen on 2026-11-29, Python 3.11.7:
#   HDFReader, times: False    read: x = 0    by VTK below it: 3 steps, the last x = 20
#
# Exit code 1 if that changes. Usage: bash findings/pyvista_steps_of_vtkhdf.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    pyvista==0.49.1 vtk==9.7.2 h5py==3.16.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import h5py
import numpy as np
import pyvista
import vtk

print(f"Python {sys.version.split()[0]}, PyVista {pyvista.__version__}, VTK {vtk.vtkVersion().GetVTKVersion()}")
kinds = ("Vertices", "Lines", "Polygons", "Strips")
with h5py.File("run.vtkhdf", "w") as file:
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = (2, 3)
    root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", 8))
    root["NumberOfPoints"] = np.ones(3, dtype=int)
    root["Points"] = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0]]
    for kind in kinds:
        some = kind == "Vertices"
        root[f"{kind}/NumberOfCells"] = np.full(3, int(some))
        root[f"{kind}/NumberOfConnectivityIds"] = np.full(3, int(some))
        root[f"{kind}/Connectivity"] = np.zeros(3 if some else 0, dtype=int)
        root[f"{kind}/Offsets"] = np.array([0, 1] * 3 if some else [0] * 3)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = 3
    steps["Values"] = [0.0, 0.5, 1.0]
    steps["PartOffsets"], steps["PointOffsets"], steps["NumberOfParts"] = range(3), range(3), np.ones(3, dtype=int)
    cells = np.zeros((3, 4), dtype=int)
    cells[:, 0] = range(3)
    steps["CellOffsets"], steps["ConnectivityIdOffsets"] = cells, cells

reader = pyvista.get_reader("run.vtkhdf")
first = pyvista.read("run.vtkhdf").points[0, 0]
has_times = hasattr(reader, "time_values")
reader.reader.UpdateInformation()
count = reader.reader.GetNumberOfSteps()
reader.reader.SetStep(count - 1)
last = reader.read().points[0, 0]
print(f"{type(reader).__name__}, times: {has_times}    read: x = {first:g}    "
      f"by VTK below it: {count} steps, the last x = {last:g}")
sys.exit((has_times, first, count, last) != (False, 0.0, 3, 20.0))
PYTHON
cd "$folder" && venv/bin/python main.py

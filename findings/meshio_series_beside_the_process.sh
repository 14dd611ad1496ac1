#!/usr/bin/env bash
# The numbers of a series are written into the folder of the process, not beside their file, and are not found there.
#
# meshio 5.3.5. `TimeSeriesWriter("out/run.xdmf")` writes out/run.xdmf, and its numbers to run.h5 in the current
# folder; the reader looks for out/run.h5, and raises. Two series of one name in two folders write into the same file.
# `meshio.write` of one mesh writes its .h5 beside the .xdmf. Change into the folder first.
#
# Seen on 2026-11-29, Python 3.11.7:
#   series: out/run.h5 False, run.h5 True, read: FileNotFoundError    one mesh: out/one.h5 True, one.h5 False
#
# Exit code 1 if that changes. Usage: bash findings/meshio_series_beside_the_process.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check meshio==5.3.5 h5py==3.16.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from pathlib import Path

import meshio
import numpy as np

print(f"Python {sys.version.split()[0]}, meshio {meshio.__version__}")
out = Path("out")
out.mkdir()
points, cells = np.eye(3), [("triangle", np.array([[0, 1, 2]]))]
with meshio.xdmf.TimeSeriesWriter(out / "run.xdmf") as writer:
    writer.write_points_cells(points, cells)
    writer.write_data(0.5, point_data={"v": np.arange(3.0)})
meshio.write(out / "one.xdmf", meshio.Mesh(points, cells))
try:
    with meshio.xdmf.TimeSeriesReader(out / "run.xdmf") as reader:
        reader.read_points_cells()
    found = "read"
except OSError as error:
    found = type(error).__name__
there = [path.exists() for path in (out / "run.h5", Path("run.h5"), out / "one.h5", Path("one.h5"))]
print(f"series: out/run.h5 {there[0]}, run.h5 {there[1]}, read: {found}    "
      f"one mesh: out/one.h5 {there[2]}, one.h5 {there[3]}")
sys.exit((there, found) != ([False, True, True, False], "FileNotFoundError"))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# A field that is written as .mrc and read again has moved, by up to half a cell.
#
# GridDataFormats 1.2.0. An MRC file has the place of its first point as `origin`, in ångström, and as `nstart`, in
# whole cells. GridDataFormats writes `nstart` alone, rounded, and 0 as `origin`, which can have any number: with cells
# of 0.8 a field at 10.3 comes back at 10.4. VTK takes `origin`, and so has the field at 0. The .dx of GridDataFormats
# keeps the place. Set `origin` of the file by mrcfile, and `nstart` to 0: both read that right.
#
# Seen on 2026-11-30, Python 3.11.7, a field at (10.3, -7, 0.39) with cells of 0.8, 1 and 0.8:
#   .mrc: GridDataFormats (10.4, -7, 0), VTK (0, 0, 0)     origin set by mrcfile: both (10.3, -7, 0.39)     .dx: right
#
# Exit code 1 if that changes. Usage: bash findings/griddataformats_origin_of_mrc.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    GridDataFormats==1.2.0 mrcfile==1.5.4 vtk==9.7.2 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version

import gridData
import mrcfile
import numpy as np
import vtk

warnings.simplefilter("ignore")
ORIGIN, CELL = np.array([10.3, -7.0, 0.39]), np.array([0.8, 1.0, 0.8])


def by_vtk(name):
    reader = vtk.vtkMRCReader()
    reader.SetFileName(name)
    reader.Update()
    return np.array(reader.GetOutput().GetOrigin())


def show(place):
    return "(" + ", ".join(f"{x:.4g}" for x in place + 0.0) + ")"


print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("GridDataFormats", "mrcfile", "vtk", "numpy")))
field = np.random.default_rng(0).random((4, 5, 6)).astype(np.float32)
grid = gridData.Grid(field, origin=ORIGIN, delta=CELL)
grid.export("field.mrc")
grid.export("field.dx")
written, dx, vtk_of_written = gridData.Grid("field.mrc"), gridData.Grid("field.dx"), by_vtk("field.mrc")
with mrcfile.open("field.mrc", mode="r+") as file:
    file.nstart = (0, 0, 0)
    file.header.origin = tuple(ORIGIN)
mended, vtk_of_mended = gridData.Grid("field.mrc"), by_vtk("field.mrc")
print(f".mrc: GridDataFormats {show(written.origin)}, VTK {show(vtk_of_written)}    .dx: {show(dx.origin)}")
print(f"origin set by mrcfile: GridDataFormats {show(mended.origin)}, VTK {show(vtk_of_mended)}")
close = lambda place, known: np.allclose(place, known, atol=1e-5)
same = all(np.array_equal(one.grid, field) for one in (written, mended))
sys.exit(not (same and close(written.origin, [10.4, -7, 0]) and close(vtk_of_written, 0) and close(dx.origin, ORIGIN)
              and close(mended.origin, ORIGIN) and close(vtk_of_mended, ORIGIN)))
PYTHON
cd "$folder" && venv/bin/python main.py

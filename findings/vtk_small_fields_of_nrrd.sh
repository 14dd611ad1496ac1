#!/usr/bin/env bash
# A small field is read as a flat one of vectors, and a field along other axes as if it had those of the file.
#
# VTK 9.7.2, and PyVista 0.49.1 by it. `vtkNrrdReader` takes a first axis of fewer than 10 points as the components of
# vectors, although `kinds` of the file says that it is one of space: a field of 9 x 20 x 30 numbers becomes 20 x 30 x 1
# vectors of 9 components. It takes the lengths of `space directions` alone: a field whose x runs down is read with x
# up, although images of VTK have a matrix of directions. SimpleITK reads both as they were written. Write .mha for VTK.
#
# Seen on 2026-11-30, Python 3.11.7, phi = x + 10 y + 100 z:
#   9 x 20 x 30: VTK 20 x 30 x 1 with 9 components       10 x 20 x 30: VTK 10 x 20 x 30 with 1
#   x down: at (-3, 1, 2) phi is 207, as SimpleITK says; VTK has nothing there, and 207 at (3, 1, 2)
#
# Exit code 1 if that changes. Usage: bash findings/vtk_small_fields_of_nrrd.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    vtk==9.7.2 pyvista==0.49.1 pynrrd==1.1.3 SimpleITK==2.5.7 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import nrrd
import numpy as np
import pyvista
import SimpleITK
import vtk


def write(shape, step):
    """A field phi = x + 10 y + 100 z on points that are 1 apart, with x in steps of `step`."""
    i, j, k = np.meshgrid(*map(np.arange, shape), indexing="ij")
    phi = (step * i + 10 * j + 100 * k).astype(np.float32)
    nrrd.write("phi.nrrd", phi, {
        "space": "left-posterior-superior", "space directions": np.diag([step, 1.0, 1.0]),
        "space origin": [0.0, 0.0, 0.0], "kinds": ["domain"] * 3})


def by_vtk():
    reader = vtk.vtkNrrdReader()
    reader.SetFileName("phi.nrrd")
    reader.Update()
    return reader.GetOutput()


def at(image, place):
    """The value at a point, or None outside."""
    point = image.FindPoint(place)
    return None if point < 0 else image.GetPointData().GetScalars().GetTuple1(point)


print(f"Python {sys.version.split()[0]}, VTK {vtk.vtkVersion().GetVTKVersion()}, PyVista {pyvista.__version__}, "
      f"pynrrd {nrrd.__version__}, SimpleITK {SimpleITK.Version_VersionString()}")
shapes = {}
for points in (9, 10):
    write((points, 20, 30), 1.0)
    image, other = by_vtk(), SimpleITK.ReadImage("phi.nrrd")
    shapes[points] = (image.GetDimensions(), image.GetNumberOfScalarComponents(), pyvista.read("phi.nrrd").dimensions,
                      other.GetSize(), other.GetNumberOfComponentsPerPixel())
    print(f"{points} x 20 x 30: VTK %s with %d components, PyVista %s, SimpleITK %s with %d" % shapes[points])
write((20, 20, 30), -1.0)
image, other = by_vtk(), SimpleITK.ReadImage("phi.nrrd")
values = at(image, (-3, 1, 2)), at(image, (3, 1, 2)), other[other.TransformPhysicalPointToIndex((-3, 1, 2))]
print("x down: at (-3, 1, 2) VTK %s, at (3, 1, 2) VTK %s; at (-3, 1, 2) SimpleITK %g" % values)
small, right = (20, 30, 1), (10, 20, 30)
sys.exit(not (shapes[9] == (small, 9, small, (9, 20, 30), 1) and shapes[10] == (right, 1, right, right, 1)
              and values == (None, 207.0, 207.0)))
PYTHON
cd "$folder" && venv/bin/python main.py

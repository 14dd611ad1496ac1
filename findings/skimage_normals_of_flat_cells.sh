#!/usr/bin/env bash
# The normals of a surface are not perpendicular to it where cells are no cubes, and do not turn with its faces.
#
# scikit-image 0.26.0. `marching_cubes` gives vertices in the units of `spacing`, and normals of the gradient by index,
# which nothing scales: of a ball whose cells are 1 : 1 : 4 they are up to 40 degrees off, and of cubes 1. The choice of
# `gradient_direction` turns the faces, and not the normals: with the default of "descent" and a distance below 0
# inside, faces look outwards and normals inwards; with "ascent" both look inwards. No choice gives outward normals.
# Take them of the faces, or of the gradient by `numpy.gradient(f, *spacing)`.
#
# Seen on 2026-11-29, Python 3.11.7:
#   cells 1 : 1 : 1  normals within 1 degree;    1 : 1 : 4  within 40 degrees; they look inwards in all cases
#   faces look outwards by "descent", inwards by "ascent"
#
# Exit code 1 if that changes. Usage: bash findings/skimage_normals_of_flat_cells.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check scikit-image==0.26.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import numpy as np
import skimage
from skimage.measure import marching_cubes


def surface(stretch, direction):
    """The greatest angle of normals of a unit ball to its radii, and the ways that normals and faces look."""
    axis = np.linspace(-1.5, 1.5, 121)
    x, y, z = np.meshgrid(axis, axis, axis[::stretch], indexing="ij")
    step = axis[1] - axis[0]
    points, faces, normals, _ = marching_cubes(
        np.sqrt(x**2 + y**2 + z**2) - 1, 0.0, spacing=(step, step, stretch * step), gradient_direction=direction)
    points = points - 1.5
    radii = points / np.linalg.norm(points, axis=1, keepdims=True)
    cosines = (normals * radii).sum(1)
    corners = points[faces]
    volume = np.linalg.det(corners).sum() / 6
    worst = float(np.degrees(np.arccos(np.abs(cosines).min())))
    return worst, float(np.sign(cosines.mean())), float(np.sign(volume))


print(f"Python {sys.version.split()[0]}, scikit-image {skimage.__version__}, NumPy {np.__version__}")
right = True
for stretch, low, high in ((1, 0.0, 2.0), (4, 35.0, 45.0)):
    for direction, way in (("descent", 1.0), ("ascent", -1.0)):
        worst, normals, faces = surface(stretch, direction)
        print(f'cells 1 : 1 : {stretch}, "{direction}": normals within {worst:.1f} degrees, and look '
              f"{'outwards' if normals > 0 else 'inwards'}; faces look {'outwards' if faces > 0 else 'inwards'}")
        right &= low < worst < high and normals == -1 and faces == way
sys.exit(not right)
PYTHON
cd "$folder" && venv/bin/python main.py

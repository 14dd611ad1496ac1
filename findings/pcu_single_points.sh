#!/usr/bin/env bash
# A single point has the distance to another mesh.
#
# point-cloud-utils 0.34.0. An array of one row is in the order of C and in that of Fortran. The package takes it for
# that of Fortran, and reads the other arrays of the call column by column, without a look at theirs: the vertices of
# the mesh, or the points to search, are others. So one point inside is outside, one ray hits elsewhere, and the nearest
# neighbour of one point is another; two equal points have the right answers. With one point a mesh in the order of
# Fortran is read right, by `np.asfortranarray`; two points refuse it with a sentence. Ask with the same point twice.
#
# Seen on 2026-11-30, Python 3.11.7:
#   0.35 inside of a cube: one point 0.245, two points -0.35     a ray from 2.5 above: one 0.5, two 2.5
#   the nearest of 50 points: one point: 11 at 0.174, two: 6 at 0.300, which is right
#
# Exit code 1 if that changes. Usage: bash findings/pcu_single_points.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check point-cloud-utils==0.34.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

import numpy as np
import point_cloud_utils as pcu

VERTICES = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
FACES = np.array(
    [[1, 3, 0], [4, 1, 0], [0, 3, 2], [2, 4, 0], [1, 7, 3], [5, 1, 4], [5, 7, 1], [3, 7, 2], [6, 4, 2], [2, 7, 6],
     [6, 5, 4], [7, 5, 6]], dtype=np.int32)
rng = np.random.default_rng(0)
POINTS, PLACE = rng.random((50, 3)), rng.random(3)


def ask(number):
    """The first answers of calls with so many equal points: the signed distance of (0.15, 0.15, 0.15), the way of a ray
    from (0.1, 0.2, 3) down, the number of the nearest of 50 points and its distance."""
    inside, start = np.full((number, 3), 0.15), np.tile([0.1, 0.2, 3.0], (number, 1))
    signed = pcu.signed_distance_to_mesh(inside, VERTICES, FACES)[0]
    way = pcu.ray_mesh_intersection(VERTICES, FACES, start, np.tile([0.0, 0.0, -1.0], (number, 1)))[2]
    far, index = pcu.k_nearest_neighbors(np.tile(PLACE, (number, 1)), POINTS, 1)
    return float(np.ravel(signed)[0]), float(np.ravel(way)[0]), int(np.ravel(index)[0]), float(np.ravel(far)[0])


apart = np.linalg.norm(POINTS - PLACE, axis=1)
right = -0.35, 2.5, int(apart.argmin()), float(apart.min())
answers = [ask(1), ask(2), right]
print(f"Python {sys.version.split()[0]}, point-cloud-utils {version('point-cloud-utils')}, NumPy {np.__version__}")
for name, (signed, way, index, far) in zip(("one point", "two points", "right"), answers):
    print(f"{name}: signed distance {signed:.3f}, ray {way:.3f}, nearest {index} at {far:.3f}")
fortran = float(pcu.signed_distance_to_mesh(np.full((1, 3), 0.15), np.asfortranarray(VERTICES), FACES)[0])
print(f"one point and a mesh in the order of Fortran: {fortran:.3f}")
close = lambda one, other: np.allclose(one, other, atol=2e-3)
sys.exit(not (close(answers[1], right) and close(fortran, -0.35) and not any(
    np.isclose(one, other, atol=2e-3) for one, other in zip(answers[0], right))))
PYTHON
cd "$folder" && venv/bin/python main.py

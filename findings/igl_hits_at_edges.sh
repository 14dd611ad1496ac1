#!/usr/bin/env bash
# A ray through a closed box has three hits, where it meets the diagonals of two faces.
#
# libigl 2.6.3. `igl.ray_mesh_intersect` gives a hit for each triangle. Of a cube of 12 triangles a ray along z at
# (0.3, 0.3) meets the diagonal of the lower face, which counts once, and that of the upper one, which counts twice, or
# the other way round: an odd number, by which a point far outside is inside. Through the middle of both faces there are
# 4, at (0.3, 0.1) the right 2. Count the different distances, not the hits.
#
# Seen on 2026-11-29, Python 3.11.7:
#   at (0.3, 0.3): 3    at (0, 0): 4    at (0.3, 0.1): 2
#
# Exit code 1 if that changes. Usage: bash findings/igl_hits_at_edges.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check libigl==2.6.3 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import igl
import numpy as np

print(f"Python {sys.version.split()[0]}, libigl 2.6.3, NumPy {np.__version__}")
V = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
F = np.array(
    [[1, 3, 0], [4, 1, 0], [0, 3, 2], [2, 4, 0], [1, 7, 3], [5, 1, 4], [5, 7, 1], [3, 7, 2], [6, 4, 2], [2, 7, 6],
     [6, 5, 4], [7, 5, 6]]
)
edges = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all(), "closed: each edge is of two triangles"


def hits(x, y):
    return len(igl.ray_mesh_intersect(np.array([x, y, -5.0]), np.array([0.0, 0.0, 1.0]), V, F))


places = ((0.3, 0.3), (0.0, 0.0), (0.3, 0.1))
found = [hits(*place) for place in places]
print("    ".join(f"at ({x:g}, {y:g}): {count}" for (x, y), count in zip(places, found)))
sys.exit(found != [3, 4, 2])
PYTHON
cd "$folder" && venv/bin/python main.py

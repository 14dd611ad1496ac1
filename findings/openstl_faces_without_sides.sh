#!/usr/bin/env bash
# Half of the faces of a mesh look inwards once triangles are made faces.
#
# openstl 4.0.1. `convert.verticesandfaces` gives the three numbers of each face in rising order, so that the order of
# its vertices, which says where outside is, is lost. About half of the faces of a closed mesh look inwards, its volume
# is near 0, and with `convert.triangles` and `write` the file has the wrong normals too. Nothing is said, in its
# documentation neither. The triangles that `read` gives are right. trimesh reads the same file as it was.
#
# Seen on 2026-11-30, Python 3.11.7, a ball of 320 triangles with volume 4.05:
#   read: 320 faces look outwards    verticesandfaces: 160, volume 0.00    written again: 160
#
# Exit code 1 if that changes. Usage: bash findings/openstl_faces_without_sides.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check openstl==4.0.1 trimesh==5.2.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

import numpy as np
import openstl
import trimesh


def measured(corners):
    """How many triangles of a ball around 0 look outwards, and the volume within."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flux = np.einsum("ij,ij->i", normals, corners.mean(axis=1))
    return int((flux > 0).sum()), float(flux.sum() / 6)


ball = trimesh.creation.icosphere(subdivisions=2)
ball.export("ball.stl")
triangles = openstl.read("ball.stl")
vertices, faces = openstl.convert.verticesandfaces(triangles)
faces = faces.astype(int)
same = all({tuple(x) for x in vertices[f]} == {tuple(x) for x in t[1:]} for f, t in zip(faces, triangles))
again = openstl.convert.triangles(vertices, faces)
openstl.write("again.stl", again, openstl.format.binary)
outward = int((np.einsum("ij,ij->i", again[:, 0], again[:, 1:].mean(axis=1)) > 0).sum())
reader = trimesh.load("ball.stl", force="mesh")
count = len(triangles)
print(f"Python {sys.version.split()[0]}, openstl {version('openstl')}, trimesh {version('trimesh')}")
of = {"read": measured(triangles[:, 1:]), "verticesandfaces": measured(vertices[faces]),
      "written again": measured(openstl.read("again.stl")[:, 1:]), "trimesh": measured(reader.triangles)}
for name, (number, volume) in of.items():
    print(f"{name}: {number} of {count} faces look outwards, volume {volume:.3f}")
print(f"the same triangles: {same}; numbers rise in each face: {bool((np.diff(faces, axis=1) > 0).all())}; normals "
      f"written again that look outwards: {outward}")
lost = all(0.4 < of[name][0] / count < 0.6 and abs(of[name][1]) < 1 for name in ("verticesandfaces", "written again"))
kept = all(of[name][0] == count and abs(of[name][1] - ball.volume) < 1e-3 for name in ("read", "trimesh"))
sys.exit(not (same and lost and kept and (np.diff(faces, axis=1) > 0).all() and 0.4 < outward / count < 0.6))
PYTHON
cd "$folder" && venv/bin/python main.py

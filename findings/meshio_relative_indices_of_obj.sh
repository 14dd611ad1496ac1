#!/usr/bin/env bash
# Faces that count their vertices backwards have the vertices of other faces.
#
# meshio 5.3.5, trimesh 5.2.0. In an .obj file -1 is the vertex before the face, as many exporters write it. meshio
# takes 1 from all indices alike, so -1 becomes -2, which is an index of NumPy too: each face has the vertices beside
# its own. trimesh counts from the last vertex of the file instead of from the face: where a second part follows the
# faces of the first, it is read twice and the first is lost, which its tracker knows. Neither warns. PyVista and
# pymeshlab read both parts. Where all vertices come before all faces, trimesh is right too.
#
# Seen on 2026-11-29, Python 3.11.7, heights of the corners of four triangles, two at z = 0 and two at z = 1:
#   a part after the other:     PyVista, pymeshlab 000 000 111 111    trimesh 111 111 111 111    meshio 011 011 011 011
#   all vertices before faces:  PyVista, pymeshlab 000 000 111 111    trimesh 000 000 111 111    meshio ?00 ?00 011 011
#
# Exit code 1 if that changes. Usage: bash findings/meshio_relative_indices_of_obj.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    meshio==5.3.5 trimesh==5.2.0 pyvista==0.49.1 pymeshlab==2025.7.post1 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version
from pathlib import Path

import meshio
import numpy as np
import pymeshlab
import pyvista
import trimesh

SQUARE = (0, 0), (1, 0), (1, 1), (0, 1)
TRIANGLES = (-4, -3, -2), (-4, -2, -1)


def lines(letter, rows):
    return [" ".join([letter, *map(str, row)]) for row in rows]


def by_meshio(name):
    mesh = meshio.read(name)
    return mesh.points, mesh.cells_dict["triangle"]


def by_trimesh(name):
    mesh = trimesh.load_mesh(name, process=False)
    return mesh.vertices, mesh.faces


def by_pyvista(name):
    mesh = pyvista.read(name)
    return mesh.points, mesh.regular_faces


def by_pymeshlab(name):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(name)
    return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()


def heights(reader, rows):
    """The heights of the corners of each triangle of the file, with ? where no vertex has the index."""
    Path("two.obj").write_text("\n".join(rows) + "\n")
    points, faces = reader("two.obj")
    z = dict(zip(range(-len(points), len(points)), 2 * [f"{point[2]:.0f}" for point in points]))
    return " ".join("".join(z.get(int(corner), "?") for corner in row) for row in faces)


lower, upper = (lines("v", [(*corner, z) for corner in SQUARE]) for z in (0, 1))
in_turn = [*lower, *lines("f", TRIANGLES), *upper, *lines("f", TRIANGLES)]
before = [*lower, *upper, *lines("f", np.subtract(TRIANGLES, 4)), *lines("f", TRIANGLES)]
print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("meshio", "trimesh", "pyvista", "pymeshlab")))
right, lost = "000 000 111 111", "111 111 111 111"
known = {by_pyvista: (right, right), by_pymeshlab: (right, right), by_trimesh: (lost, right),
         by_meshio: ("011 011 011 011", "?00 ?00 011 011")}
same = True
for reader, expected in known.items():
    found = tuple(heights(reader, rows) for rows in (in_turn, before))
    print(f"{reader.__name__}: a part after the other {found[0]}, all vertices before faces {found[1]}")
    same &= found == expected
sys.exit(not same)
PYTHON
cd "$folder" && venv/bin/python main.py

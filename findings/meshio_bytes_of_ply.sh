#!/usr/bin/env bash
# Colours of a binary PLY file are below 0.
#
# meshio 5.3.5. A PLY file names its kinds of numbers: `uchar`, or `uint8`, is a byte from 0 to 255. meshio takes
# `uchar` of a binary file as a signed byte: 200 is read as -56. `uint8`, which is the same kind, and text files are
# right. meshio itself writes `uint8`, so its own files come back; plyfile writes `uchar`. Take `.view("uint8")` of the
# arrays. trimesh, VTK and plyfile read all of them.
#
# Seen on 2026-11-30, Python 3.11.7, red, written as 1, 127, 200, 255:
#   binary uchar: [1 127 -56 -1] int8     binary uint8: [1 127 200 255] uint8     text uchar: [1 127 200 255] uint8
#
# Exit code 1 if that changes. Usage: bash findings/meshio_bytes_of_ply.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    meshio==5.3.5 plyfile==1.1.5 trimesh==5.2.0 vtk==9.7.2 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version
from pathlib import Path

import meshio
import numpy as np
import trimesh
import vtk
from plyfile import PlyData, PlyElement
from vtk.util.numpy_support import vtk_to_numpy

RED = np.array([1, 127, 200, 255], dtype=np.uint8)


def write(name, text):
    points = np.zeros(4, dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")])
    points["red"] = RED
    PlyData([PlyElement.describe(points, "vertex")], text=text).write(name)


def by_meshio(name):
    return meshio.read(name).point_data["red"]


print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("meshio", "plyfile", "trimesh", "vtk", "numpy")))
write("uchar.ply", text=False)
write("text.ply", text=True)
Path("uint8.ply").write_bytes(Path("uchar.ply").read_bytes().replace(b" uchar ", b" uint8 "))
names = Path("uchar.ply").read_bytes().count(b"property uchar")
found = {name: by_meshio(f"{name}.ply") for name in ("uchar", "uint8", "text")}
for name, red in found.items():
    print(f"{name}: {red} {red.dtype}")
reader = vtk.vtkPLYReader()
reader.SetFileName("uchar.ply")
reader.Update()
others = (trimesh.load("uchar.ply").colors[:, 0], vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())[:, 0],
          PlyData.read("uchar.ply")["vertex"]["red"])
print("uchar by trimesh, VTK, plyfile: " + ", ".join(str(red) for red in others))
signed = found["uchar"].dtype == np.int8 and (found["uchar"] == RED.view(np.int8)).all()
rest = all(found[name].dtype == np.uint8 and (found[name] == RED).all() for name in ("uint8", "text"))
sys.exit(not (names == 3 and signed and rest and all((red == RED).all() for red in others)))
PYTHON
cd "$folder" && venv/bin/python main.py

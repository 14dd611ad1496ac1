#!/usr/bin/env bash
# A PLY file with edges ends the process, not the call.
#
# meshio 5.3.5. PLY knows `element edge`, and Blender, MeshLab and trimesh read it. `meshio.read` prints two lines and
# calls `sys.exit(1)`: `SystemExit` is no `Exception`, so that a loop over files with `except Exception` ends at the
# first one. Without the edges the file is read.
#
# Seen on 2026-11-29, Python 3.11.7:
#   with edges: SystemExit(1)    without: 2 points
#
# Exit code 1 if that changes. Usage: bash findings/meshio_edges_end_the_process.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check meshio==5.3.5 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from pathlib import Path

import meshio

print(f"Python {sys.version.split()[0]}, meshio {meshio.__version__}")
POINTS = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
EDGES = "element edge 1\nproperty int vertex1\nproperty int vertex2\n"
Path("edges.ply").write_text(POINTS + EDGES + "end_header\n0 0 0\n1 0 0\n0 1\n")
Path("points.ply").write_text(POINTS + "end_header\n0 0 0\n1 0 0\n")
try:
    found = repr(meshio.read("edges.ply"))
except BaseException as error:
    found = repr(error)
without = len(meshio.read("points.ply").points)
print(f"with edges: {found}    without: {without} points")
sys.exit((found, without) != ("SystemExit(1)", 2))
PYTHON
cd "$folder" && venv/bin/python main.py

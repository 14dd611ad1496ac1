#!/usr/bin/env bash
# A part of 1 mm is 1 m long in glTF.
#
# CadQuery 2.8.0. Its numbers are millimetres: so its STEP files say. glTF is in metres, by its specification, and has
# y up. `Assembly.save("part.glb")` turns the axes, and does not scale: a box of 1 x 2 x 3 mm is 1 x 3 x 2 m in the
# file, a thousand times as large, for trimesh and every other reader. The STL of the same part is 1 x 2 x 3, without
# a unit.
#
# Seen on 2026-11-29, Python 3.11.7:
#   STEP: (.MILLI.,.METRE.)    glb: [1. 3. 2.] meters    STL: [1. 2. 3.] None
#
# Exit code 1 if that changes. Usage: bash findings/cadquery_gltf_units.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check cadquery==2.8.0 trimesh==5.2.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import re
import sys
from pathlib import Path

import cadquery
import numpy as np
import trimesh

print(f"Python {sys.version.split()[0]}, CadQuery {cadquery.__version__}, trimesh {trimesh.__version__}")
part = cadquery.Workplane().box(1, 2, 3)
cadquery.Assembly(part).save("part.glb")
cadquery.exporters.export(part, "part.step")
cadquery.exporters.export(part, "part.stl")
(unit,) = re.findall(r"SI_UNIT(\(\.MILLI\.,\.METRE\.\))", Path("part.step").read_text())
glb, stl = trimesh.load("part.glb"), trimesh.load("part.stl")
print(f"STEP: {unit}    glb: {glb.extents.round(6)} {glb.units}    STL: {stl.extents.round(6)} {stl.units}")
known = np.allclose(glb.extents, [1, 3, 2], atol=1e-6) and glb.units == "meters"
sys.exit(not (known and np.allclose(stl.extents, [1, 2, 3], atol=1e-6)))
PYTHON
cd "$folder" && venv/bin/python main.py

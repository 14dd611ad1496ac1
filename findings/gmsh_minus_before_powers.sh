#!/usr/bin/env bash
# `-x^2` is +x² in a formula of a mesh size, and -x² in a .geo file of the same program.
#
# gmsh 4.15.2. In the formulas of `MathEval` (the field of mesh sizes, and the plugin) a minus at the beginning, or
# after a bracket, binds more tightly than the power: `exp(-x^2)` is exp(x²). A line from -2 to 2 that should be fine at
# its ends has 21 nodes instead of 331, and is coarse there. `-(x^2)` and `0-x^2` are right; `1-x^2` is as well. The
# formulas of .geo files follow the rule of mathematics.
#
# Seen on 2026-11-29, Python 3.11.7:
#   0.1*exp(-x^2): 21 nodes    0.1*exp(-(x^2)): 331    0.1*exp(0-x^2): 331
#   with v0 = 2 -v0^2 is 4 for the plugin, 1-v0^2 is -3; -x^2 is -4 in .geo
#
# Exit code 1 if that changes. Usage: bash findings/gmsh_minus_before_powers.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check gmsh==4.15.2
cat >"$folder/main.py" <<'PYTHON'
import sys
from pathlib import Path

import gmsh


def nodes(formula):
    """The number of nodes of a line from -2 to 2 with this formula as the size of its elements."""
    gmsh.clear()
    field = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(field, "F", formula)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    ends = [gmsh.model.occ.addPoint(x, 0, 0) for x in (-2, 2)]
    gmsh.model.occ.addLine(*ends)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(1)
    return len(gmsh.model.mesh.getNodes()[0])


def plugin(formula):
    """The value of a formula of v0 = 2 by the plugin `MathEval`."""
    gmsh.clear()
    view = gmsh.view.add("two")
    gmsh.view.addListData(view, "SP", 1, [0.0, 0.0, 0.0, 2.0])
    gmsh.plugin.setNumber("MathEval", "View", 0)
    gmsh.plugin.setString("MathEval", "Expression0", formula)
    gmsh.plugin.run("MathEval")
    return gmsh.view.getListData(gmsh.view.getTags()[-1])[2][0][-1]


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
for name in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints"):
    gmsh.option.setNumber(f"Mesh.{name}", 0)
print(f"Python {sys.version.split()[0]}, gmsh {gmsh.GMSH_API_VERSION}")
counts = [nodes(formula) for formula in ("0.1*exp(-x^2)", "0.1*exp(-(x^2))", "0.1*exp(0-x^2)")]
values = [plugin(formula) for formula in ("-v0^2", "-(v0^2)", "1-v0^2")]
gmsh.clear()
Path("two.geo").write_text("x = 2; y = -x^2;\n")
gmsh.merge("two.geo")
geo = gmsh.parser.getNumber("y")[0]
print(f"nodes with exp(-x^2), exp(-(x^2)), exp(0-x^2): {counts}")
print(f"the plugin, v0 = 2: -v0^2, -(v0^2), 1-v0^2 = {[float(value) for value in values]}; .geo: -x^2 = {geo}")
sys.exit(not (counts[0] < 50 and counts[1] == counts[2] > 300 and values == [4, -4, -3] and geo == -4))
PYTHON
cd "$folder" && venv/bin/python main.py

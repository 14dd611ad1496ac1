#!/usr/bin/env bash
# The unit of an import stays set after `gmsh.finalize()`, where the option says that it is not.
#
# gmsh 4.15.2. With `Geometry.OCCTargetUnit` "M" a STEP file of a box 1 x 2 x 3 mm is read as 0.001 x 0.002 x 0.003.
# After `gmsh.finalize()` and `gmsh.initialize()` the option reads "" again, and the file is still read in metres,
# also when the option is set to "" in words; "MM" mends it. So what a part measures depends on what the process read
# before.
#
# Seen on 2026-11-29, Python 3.11.7:
#   first "": 1    "M": 0.001    then "" by default: 0.001    set to "": 0.001    "MM": 1
#
# Exit code 1 if that changes. Usage: bash findings/gmsh_target_unit_stays.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check gmsh==4.15.2
cat >"$folder/main.py" <<'PYTHON'
import subprocess
import sys

import gmsh

# By a process of its own, whose units are its own.
BOX = """
import gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0, 0, 0, 1, 2, 3)
gmsh.model.occ.synchronize()
gmsh.write("part.step")
gmsh.finalize()
"""
subprocess.run([sys.executable, "-c", BOX], check=True, stdout=subprocess.DEVNULL)


def width(unit=None):
    """What the option is at first, and how long the box is along x in a gmsh that has just begun."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    before = gmsh.option.getString("Geometry.OCCTargetUnit")
    if unit is not None:
        gmsh.option.setString("Geometry.OCCTargetUnit", unit)
    gmsh.model.occ.importShapes("part.step")
    gmsh.model.occ.synchronize()
    low, high = gmsh.model.occ.getBoundingBox(3, 1)[::3]
    gmsh.finalize()
    return before, round(high - low, 5)


print(f"Python {sys.version.split()[0]}, gmsh {gmsh.__version__}")
found = [width(unit) for unit in (None, "M", None, "", "MM")]
names = ('first ""', '"M"', 'then "" by default', 'set to ""', '"MM"')
print("    ".join(f"{name}: {size:g}" for name, (_, size) in zip(names, found)))
sys.exit(found != [("", 1.0), ("", 0.001), ("", 0.001), ("", 0.001), ("", 1.0)])
PYTHON
cd "$folder" && venv/bin/python main.py

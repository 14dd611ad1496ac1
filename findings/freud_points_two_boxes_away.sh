#!/usr/bin/env bash
# A point two boxes away from a periodic box has no neighbours, without a word.
#
# freud 3.4.0. Of a periodic box a point just outside is taken as its image inside: at 9.9 in a box of 10 around 0 it
# is 0.1 from the origin. At 19.9 it is the same image, and `AABBQuery`, which is what is taken by default, finds no
# neighbour, where `LinkCell` finds it. So trajectories whose positions are not wrapped, those of flights through
# cells that repeat, give neighbours at first and fewer and fewer later. `box.wrap(points)` mends it.
#
# Seen on 2026-11-29, Python 3.11.7, by AABBQuery and LinkCell:
#   at 9.9: 1, 1    at 19.9: 0, 1    at 19.9, wrapped: 1, 1
#
# Exit code 1 if that changes. Usage: bash findings/freud_points_two_boxes_away.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check freud-analysis==3.4.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import platform
import sys

import freud
import numpy as np

print(f"Python {platform.python_version()}, freud {freud.__version__}, NumPy {np.__version__}")
box = freud.box.Box.cube(10.0)


def neighbours(points):
    """How many neighbours the origin has within 2, by both ways to find them."""
    ways = freud.AABBQuery(box, points), freud.LinkCell(box, points, 2.0)
    about = {"r_max": 2.0, "exclude_ii": True}
    return [len(way.query(points[:1], about).toNeighborList()) for way in ways]


near, far = (np.array([[0.0, 0.0, 0.0], [x, 0.0, 0.0]]) for x in (9.9, 19.9))
found = [neighbours(near), neighbours(far), neighbours(box.wrap(far))]
names = ("at 9.9", "at 19.9", "at 19.9, wrapped")
print("    ".join(f"{name}: {a}, {b}" for name, (a, b) in zip(names, found)))
sys.exit(found != [[1, 1], [0, 1], [1, 1]])
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# A ball that has sunk into the end of a cylinder is pushed out through its side.
#
# Coal 3.0.3, formerly hpp-fcl, which Pinocchio uses. `distance` and the contacts of `collide` are signed distances: of
# bodies that overlap, the least motion that parts them. The pair sphere and cylinder has its own formula. Where the
# centre of the ball is inside, it looks at the side alone: near an end depth, normal and nearest points are those of a
# way through the side. On the axis the normal is (0, 0, 0). The same ball as an `Ellipsoid` is right, and so are balls
# whose centre is outside, and in boxes, capsules and cones.
#
# Seen on 2026-11-30, Python 3.11.7, a ball of radius 0.1 in a cylinder of radius 0.3 and length 1:
#   its centre 0.01 below the end, 0.05 off the axis: depth 0.35, normal (1, 0, 0); as an ellipsoid 0.11, (0, 0, 1)
#   there, on the axis: depth 0.4, normal (0, 0, 0)
#   of 20 000 places 3 611 have the centre inside, 733 of them are nearer to an end, and all 733 are wrong
#
# Exit code 1 if that changes. Usage: bash findings/coal_balls_in_cylinders.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check coal==3.0.3 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import coal
import numpy as np

RADIUS, HALF, BALL = 0.3, 0.5, 0.1
CYLINDER = coal.Cylinder(RADIUS, 2 * HALF)


def contact(ball, place):
    """The depth, below 0, and the normal of a ball at a place in the cylinder."""
    where, result = coal.Transform3s(), coal.CollisionResult()
    where.setTranslation(np.array(place))
    coal.collide(CYLINDER, coal.Transform3s(), ball, where, coal.CollisionRequest(), result)
    found = result.getContact(0)
    return found.penetration_depth, np.round(found.normal, 2)


def distance(place):
    where, result = coal.Transform3s(), coal.DistanceResult()
    where.setTranslation(place)
    return coal.distance(CYLINDER, coal.Transform3s(), coal.Sphere(BALL), where, coal.DistanceRequest(), result)


def sample(places):
    """Among random places: those with the centre inside, those of them nearer to an end, wrong ones of these, and
    wrong ones of all others."""
    p = np.random.default_rng(0).uniform(-1, 1, (places, 3)) * [0.5, 0.5, 0.8]
    gap = np.stack([np.hypot(p[:, 0], p[:, 1]) - RADIUS, np.abs(p[:, 2]) - HALF])
    true = np.linalg.norm(np.maximum(gap, 0), axis=0) + np.minimum(gap.max(axis=0), 0) - BALL
    wrong = np.abs([distance(place) for place in p] - true) > 1e-9
    inside = (gap < 0).all(axis=0)
    end = inside & (gap[1] > gap[0])
    return int(inside.sum()), int(end.sum()), int((wrong & end).sum()), int((wrong & ~end).sum())


print(f"Python {sys.version.split()[0]}, Coal {coal.__version__}, NumPy {np.__version__}")
ball, ellipsoid = coal.Sphere(BALL), coal.Ellipsoid(BALL, BALL, BALL)
beside, on_axis = contact(ball, (0.05, 0, 0.49)), contact(ball, (0, 0, 0.49))
right = contact(ellipsoid, (0.05, 0, 0.49))
for name, (depth, normal) in {"beside the axis": beside, "on the axis": on_axis, "as an ellipsoid": right}.items():
    print(f"{name}: depth {depth:.3f}, normal {normal + 0.0}")
inside, end, wrong, others = sample(20_000)
print(f"centre inside {inside}, nearer to an end {end}, wrong {wrong}, of all others {others}")
sys.exit(not (abs(beside[0] + 0.35) < 1e-6 and abs(beside[1][0] - 1) < 0.01 and abs(on_axis[0] + 0.4) < 1e-6
              and not on_axis[1].any() and abs(right[0] + 0.11) < 1e-4 and abs(right[1][2] - 1) < 0.01
              and wrong == end > 500 and others == 0))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# A ball that falls onto the middle of a floor falls through it, and beside the middle it does not.
#
# pybox3d 2026b0. Of a `Sphere` above the middle of a face of a `Box3D`, `overlaps` says that they touch, but for most
# depths with a normal (0, 0, 0) and the depth 0, so that nothing pushes. A ball of radius 0.25 m at 60 steps a second
# sinks on, although it overlaps the floor of 1 m for several steps, and leaves below. A hundredth of a metre beside the
# middle the normal and the depth are right, and the ball stays. Place nothing at the middle.
#
# Seen on 2026-11-30, Python 3.11.7:
#   25 depths from 0.01 to 0.25 m: without normal and depth 18 above the middle, none beside it
#   dropped from 40 heights of 0.5 to 4.4 m: 7 above the middle fall through, none beside it
#
# Exit code 1 if that changes. Usage: bash findings/pybox3d_balls_fall_through_the_middle.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pybox3d==2026b0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

from pybox3d import Box3D, RigidBody, Sphere, World

RADIUS, STEP = 0.25, 1 / 60


def without_normal(x, depths):
    """For how many depths, at x from the middle of a face, the contact has no normal and no depth, and for how many it
    is right."""
    box = Box3D((0, -0.5, 0), (5, 0.5, 5))
    none = right = 0
    for depth in depths:
        contact = box.overlaps(Sphere((x, RADIUS - depth, x), RADIUS))
        none += contact.normal.to_tuple() == (0, 0, 0) and contact.penetration == 0
        right += contact.normal.y > 0.99 and abs(contact.penetration - depth) < 2e-3
    return none, right


def lowest(x, height):
    """Where a ball is two seconds after it has reached the floor, of which the top is at 0."""
    world = World(gravity=(0, -9.81, 0))
    world.add_body(RigidBody((0, -0.5, 0), (5, 0.5, 5), mass=0.0))
    ball = world.add_body(RigidBody.sphere((x, height, x), RADIUS, mass=1.0))
    for _ in range(int(((2 * height / 9.81) ** 0.5 + 2) / STEP)):
        world.step(STEP)
    return ball.position.y


depths, heights = [0.01 * k for k in range(1, 26)], [0.5 + 0.1 * k for k in range(40)]
print(f"Python {sys.version.split()[0]}, pybox3d {version('pybox3d')}")
found = {}
for name, x in (("the middle", 0.0), ("beside it", 0.01)):
    none, right = without_normal(x, depths)
    through = sum(lowest(x, height) < -2 for height in heights)
    found[name] = none, right, through
    print(f"{name}: {none} of {len(depths)} depths without a normal, {right} right; {through} of {len(heights)} fall "
          "through")
sys.exit(not (found["the middle"][0] > 12 and found["the middle"][2] > 2 and found["beside it"][0] <= 2
              and found["beside it"][2] == 0))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# No free body is faster than 100 m/s along an axis; what is faster is turned aside.
#
# PyBullet 3.2.7. A sphere of 150 m/s along x and 50 m/s along y has 100 and 50 m/s after the first step: each
# component is cut at 100, so that the direction is another one too, and nothing says so. The limit is
# `maxJointVelocity` of `changeDynamics`, although the body has no joint. A gas at room temperature is four times as
# fast.
#
# Seen on 2026-11-29, Python 3.11.7:
#   by default: (150, 50, 0) -> (100, 50, 0)      maxJointVelocity=1000: (150, 50, 0) -> (150, 50, 0)
#
# Exit code 1 if that changes. Usage: bash findings/pybullet_speed_limit.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pybullet==3.2.7 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import pybullet as p


def after_a_step(limit):
    p.connect(p.DIRECT)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    p.changeDynamics(ball, -1, linearDamping=0.0)
    if limit is not None:
        p.changeDynamics(ball, -1, maxJointVelocity=limit)
    p.resetBaseVelocity(ball, [150, 50, 0])
    before = p.getBaseVelocity(ball)[0]
    p.stepSimulation()
    after = p.getBaseVelocity(ball)[0]
    p.disconnect()
    return before, after


print(f"Python {sys.version.split()[0]}, PyBullet API {p.getAPIVersion()}")
default, raised = after_a_step(None), after_a_step(1000)
print(f"by default: {default[0]} -> {default[1]}      maxJointVelocity=1000: {raised[0]} -> {raised[1]}")
fast = (150.0, 50.0, 0.0)
sys.exit((default, raised) != ((fast, (100.0, 50.0, 0.0)), (fast, fast)))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# A ball with restitution 1 on a floor with restitution 1 loses most of its energy, and more in shorter steps.
#
# PyBullet 3.2.7. A sphere of radius 0.1 m is dropped from 1 m, without damping. It should come back to 1 m for ever.
# At the default step of 1/240 s the first peaks are 1.04, 0.73 and 0.57 m; at 1 ms 0.95, 0.36 and 0.005 m: a shorter
# step is worse. (The default linear damping of 0.04 comes on top.)
#
# Seen on 2026-11-29, Python 3.11.7:
#   step 1/240 s: 1.040, 0.731, 0.566 m      step 1/1000 s: 0.953, 0.358, 0.005 m
#
# Exit code 1 if that changes. Usage: bash findings/pybullet_restitution_of_one.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pybullet==3.2.7 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import numpy as np
import pybullet as p


def peaks(step):
    """The heights of the first three peaks after the start, of the lowest point of the sphere."""
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.81)
    p.setTimeStep(step)
    floor = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 0, 1.1])
    p.changeDynamics(floor, -1, restitution=1.0)
    p.changeDynamics(ball, -1, restitution=1.0, linearDamping=0.0, angularDamping=0.0)
    z = []
    for _ in range(int(10 / step)):
        p.stepSimulation()
        z.append(p.getBasePositionAndOrientation(ball)[0][2] - 0.1)
    p.disconnect()
    found = [z[i] for i in range(1, len(z) - 1) if z[i - 1] < z[i] >= z[i + 1]]
    return np.array(found[:3])


print(f"Python {sys.version.split()[0]}, PyBullet API {p.getAPIVersion()}, NumPy {np.__version__}")
coarse, fine = peaks(1 / 240), peaks(1e-3)
for name, found in (("1/240", coarse), ("1/1000", fine)):
    print(f"step {name} s: " + ", ".join(f"{height:.3f}" for height in found) + " m")
known = np.allclose(coarse, [1.040, 0.731, 0.566], atol=2e-3) and np.allclose(fine, [0.953, 0.358, 0.005], atol=2e-3)
sys.exit(not known)
PYTHON
cd "$folder" && venv/bin/python main.py

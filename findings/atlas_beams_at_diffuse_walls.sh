#!/usr/bin/env bash
# A beam leaves a diffuse wall as a beam: what comes back is a function of the velocity that came.
#
# Atlas Engine 0.2.0, of DSMC of rarefied gas. A wall with `momentum_accommodation_coefficient` 1 and `cosine_weighted`
# sampling scatters by Lambert's law, each particle at random. Its random numbers come from the velocity and the normal
# alone: 2000 particles of one velocity at 2000 places of a plane leave in one direction, and with the coefficient 0.5
# all of them are reflected, or none. Velocities that differ by 0.01 % leave in 2000 directions, by the law of cosines,
# so a thermal gas does not show it. Give a beam a spread.
#
# Seen on 2026-11-30, Python 3.11.7, 2000 particles of (0.1, 0, -1) m/s at the plane z = 0:
#   one velocity: 1 direction     spread of 1e-4 m/s: 1987 directions, mean cosine 0.669, of 2/3 by the law
#
# Exit code 1 if that changes. Usage: bash findings/atlas_beams_at_diffuse_walls.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check atlas-engine==0.2.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import atlas
import numpy as np
from atlas import Float3

NUMBER, STEP, STEPS = 2000, 0.02, 12


def scattered(spread, accommodation):
    """Velocities of particles that have met a plane by a run, and those of whole directions that differ."""
    rng = np.random.default_rng(0)
    places = rng.uniform((0.1, 0.1, 0.05), (0.9, 0.9, 0.15), (NUMBER, 3)).astype(np.float32)
    start = np.array([0.1, 0.0, -1.0]) + spread * rng.standard_normal((NUMBER, 3))
    plane = atlas.Unit(atlas.Plane(Float3(0.0, 0.0, 0.0), Float3(0.0, 0.0, 1.0)))
    wall = atlas.IsothermalCollider(plane, accommodation, 1.0, atlas.DiffuseSampling.cosine_weighted)
    space = atlas.Universe(Float3(-1.0, -1.0, -1.0), Float3(2.0, 2.0, 2.0), 0.5)
    system = atlas.System(atlas.Fluid.from_arrays(places, start.astype(np.float32)), space, STEP, colliders=[wall])
    for _ in range(STEPS):
        system.advect()
    velocity = np.asarray(system.fluid.velocities()).reshape(-1, 3)
    velocity = velocity[velocity[:, 2] > 0]
    directions = velocity / np.linalg.norm(velocity, axis=1, keepdims=True)
    reflected = np.abs(velocity - start[0] * [1, 1, -1]).max(axis=1) < max(1e-5, 10 * spread)
    distinct = len(np.unique(directions.round(4), axis=0))
    return len(velocity), distinct, float(directions[:, 2].mean()), float(reflected.mean())


print(f"Python {sys.version.split()[0]}, Atlas Engine {atlas.__version__}, NumPy {np.__version__}")
found = {}
for spread in (0.0, 1e-4):
    for accommodation in (1.0, 0.5):
        back, distinct, cosine, share = found[spread, accommodation] = scattered(spread, accommodation)
        print(f"spread {spread:g}, coefficient {accommodation:g}: {back} of {NUMBER} have left the wall in {distinct} "
              f"directions, mean cosine {cosine:.3f}, {share:.0%} reflected")
beam, half = found[0.0, 1.0], found[0.0, 0.5]
gas, some = found[1e-4, 1.0], found[1e-4, 0.5]
sys.exit(not (beam[:2] == (NUMBER, 1) and half[:2] == (NUMBER, 1) and half[3] in (0, 1) and gas[1] > 0.95 * NUMBER
              and abs(gas[2] - 2 / 3) < 0.02 and abs(some[3] - 0.5) < 0.05))
PYTHON
cd "$folder" && venv/bin/python main.py

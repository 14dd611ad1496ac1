#!/usr/bin/env bash
# Collisions that are found between two steps are then taken for none, and the particles pass through one another.
#
# rebound 5.2.2. `collision = "line"` and "linetree" look for particles that meet during a step, not at its end alone,
# and find those. `collision_resolve = "hardsphere"` then asks whether they overlap at the end: those that have passed
# one another do not, and nothing happens, without a word. So "line" bounces as few as "direct". "halt" and "merge" take
# what "line" finds. Choose a step in which no particle moves by its radius, or set a function of your own as
# `collision_resolve`.
#
# Seen on 2026-11-30, Python 3.11.7, pairs that fly at one another and move by so many radii in a step:
#   0.1 radii: all 200 bounce by "direct", "line" and "linetree"
#   20 radii: 12 bounce by each; "halt" after "line" stops 200
#
# Exit code 1 if that changes. Usage: bash findings/rebound_collisions_on_the_way.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rebound==5.2.2 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import numpy as np
import rebound

RADIUS, PAIRS = 0.1, 200


def pair(search, resolve, stride, start):
    """Two particles that fly at one another, off centre by a radius, and move by `stride` radii in a step."""
    sim = rebound.Simulation()
    sim.gravity, sim.integrator, sim.root_size, sim.boundary = "none", "leapfrog", 100.0, "open"
    sim.collision, sim.collision_resolve = search, resolve
    sim.dt = stride * RADIUS
    sim.add(m=1, r=RADIUS, x=-start, vx=1)
    sim.add(m=1, r=RADIUS, x=start, y=RADIUS, vx=-1)
    return sim


def bounced(search, stride, starts):
    """How many pairs turn back."""
    count = 0
    for start in starts:
        sim = pair(search, "hardsphere", stride, start)
        sim.integrate(2 * start, exact_finish_time=0)
        count += sim.particles[0].vx != 1
    return count


def halted(stride, starts):
    """How many pairs stop the run by "line"."""
    count = 0
    for start in starts:
        try:
            pair("line", "halt", stride, start).integrate(2 * start, exact_finish_time=0)
        except rebound.Collision:
            count += 1
    return count


print(f"Python {sys.version.split()[0]}, rebound {rebound.__version__}, NumPy {np.__version__}")
starts = np.random.default_rng(0).uniform(2.0, 4.0, PAIRS)
found = {}
for stride in (0.1, 20):
    found[stride] = [bounced(search, stride, starts) for search in ("direct", "line", "linetree")]
    stops = halted(stride, starts)
    print(f"{stride:g} radii in a step: direct, line, linetree bounce {found[stride]} of {PAIRS}, line halts {stops}")
    found[stride].append(stops)
direct, line, tree, stops = found[20]
sys.exit(not (found[0.1] == [PAIRS] * 4 and direct == line == tree < 40 and stops == PAIRS))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# g(r) over frames of different numbers of particles is off by their ratio, and the order of the frames decides.
#
# freud 3.4.0. `RDF.compute(frame, reset=False)` adds up the pairs of all frames, and divides by the density of the last
# frame, times the number of frames. Where the numbers of particles change, as in a run with a source, or the volume of
# the box does, g(r) does not tend to 1: an ideal gas of 200 and 2000 particles by turns has 0.51 or 50. No error, no
# warning. Frames of equal numbers and one box are right. Compute each frame by itself, and take the mean.
#
# Seen on 2026-11-29, Python 3.11.7:
#   200, 2000 by turns: g = 0.506     2000, 200: g = 50.3     the mean of frames by themselves: g = 1.00
#   boxes of 8, 16 by turns: g = 4.5  16, 8: g = 0.56
#
# Exit code 1 if that changes. Usage: bash findings/freud_rdf_of_changing_numbers.sh
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


def ideal(count, side, rng):
    """A frame of points that are independent of one another: g(r) = 1 at every r."""
    return freud.box.Box.cube(side), rng.uniform(-side / 2, side / 2, (count, 3))


def mean_of(frames):
    """g(r) by one object over all of these frames, beyond r = 0.5."""
    rdf = freud.density.RDF(bins=20, r_max=2.0)
    for k, frame in enumerate(frames):
        rdf.compute(frame, reset=k == 0)
    return float(rdf.rdf[5:].mean())


print(f"Python {platform.python_version()}, freud {freud.__version__}, NumPy {np.__version__}")
rng = np.random.default_rng(0)
up = mean_of([ideal(n, 10.0, rng) for n in (200, 2000) * 3])
down = mean_of([ideal(n, 10.0, rng) for n in (2000, 200) * 3])
alone = np.mean([mean_of([ideal(n, 10.0, rng)]) for n in (2000,) * 6])
grows = mean_of([ideal(1000, side, rng) for side in (8.0, 16.0) * 3])
shrinks = mean_of([ideal(1000, side, rng) for side in (16.0, 8.0) * 3])
print(f"200, 2000 by turns: g = {up:.3f}    2000, 200: g = {down:.1f}    frames by themselves: g = {alone:.2f}")
print(f"boxes of 8, 16 by turns: g = {grows:.1f}    16, 8: g = {shrinks:.2f}")
expected = ((up, 0.505, 0.02), (down, 50.5, 2.0), (alone, 1.0, 0.03), (grows, 4.5, 0.2), (shrinks, 0.5625, 0.02))
sys.exit(any(abs(found - known) > off for found, known, off in expected))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# The mean square displacement in space is a third of what it is, and falls to 0 at long times.
#
# trajpy 1.4.4. `msd_time_averaged_` divides the sum over the N - tau displacements by the number of all coordinates
# less tau, d N - tau + 1 in d dimensions. Its documentation has one mean over them. So on a line it is right up to 1 /
# (N - tau), in a plane a half and in space a third. At half of the track's length a fifth is left in space, so that
# the diffusivity and the exponent of a fit are too small. `fractal_dimension_` rounds positions to two decimals: its
# number depends on the unit, and of a track of micrometres in metres it is 0. `straightness_` does not round.
#
# Seen on 2026-11-30, Python 3.11.7, 1000 points of a straight flight with speed 1, over tau^2:
#   a line 1.00, 1.00, 0.99    a plane 0.50, 0.33, 0.09    space 0.33, 0.20, 0.05    at lags 10, 500, 900
#   fractal dimension of a walk with steps of 1 m: 1.65 in m, 1.73 in units of 200 m, 0 in units of 1000 km
#
# Exit code 1 if that changes. Usage: bash findings/trajpy_msd_by_all_coordinates.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trajpy==1.4.4 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version

warnings.simplefilter("ignore")
import numpy as np
from trajpy.trajpy import Trajectory

POINTS, LAGS = 1000, np.array([10, 500, 900])


def flight(dimensions):
    """A straight flight with speed 1 in a time of 1 between points."""
    return np.outer(np.arange(POINTS), np.full(dimensions, dimensions**-0.5))


def mean(track, lag):
    return float((np.square(track[lag:] - track[:-lag]).sum(axis=1)).mean())


print(f"Python {sys.version.split()[0]}, trajpy {version('trajpy')}, NumPy {np.__version__}")
known = True
for dimensions in (1, 2, 3):
    track = flight(dimensions)
    right = np.array([mean(track, lag) for lag in LAGS])
    found = Trajectory.msd_time_averaged_(track, LAGS)
    share = (POINTS - LAGS) / (dimensions * POINTS - LAGS + 1)
    print(f"{dimensions} dimensions: {np.round(found / right, 3)} of the right ones at lags {LAGS}")
    known &= np.allclose(found / right, share, rtol=1e-9) and np.allclose(right, LAGS**2.0)
walk = np.random.default_rng(0).normal(size=(400, 2)).cumsum(axis=0)
of = {}
for unit in (1.0, 200.0, 1e6):
    scaled = walk / unit
    of[unit] = (float(Trajectory.fractal_dimension_(scaled)[0]), float(Trajectory.straightness_(scaled)))
    print(f"a walk in units of {unit:g} m: fractal dimension {of[unit][0]}, straightness {of[unit][1]:.6f}")
known &= np.ptp([straight for _, straight in of.values()]) < 1e-9
known &= bool(np.isfinite(of[1.0][0])) and of[200.0][0] != of[1.0][0] and of[1e6][0] == 0
sys.exit(not known)
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# Mean square displacements of many tracks are one lag early, and a fit in micrometres returns 2e-10 for any diffusivity.
#
# TRAIT2D 1.2.1. Expected: `ListOfTracks.get_msd` returns lags and their means; `msd_analysis` fits the diffusivity.
# Seen: the times that it returns are those of the longest track's points, so that the mean of lag 1 stands at the time
# 0, or at whatever time the track begins, and a line through them crosses the axis at 4 D dt, which is read as an
# error of places. Times of one track's own plot and fit are right. The fit starts at 0, where its bounds are, and not
# at 1 as its documentation says: of diffusivities of about 1, such as of µm^2/s, it returns some 1e-10 without a
# word, and in metres it is right. Subtract t[0] and add a step, and give `initial_guesses`.
#
# Seen on 2026-11-30, Python 3.11.7:
#   a straight flight, speed 1, points 0.1 apart from 100 on: mean squares 0.01, 0.04, 0.09 at 100, 100.1, 100.2
#   300 tracks with D = 0.5: a line through them has 0.19 at 0, with right times -0.02
#   fitted D over D: 1.0 in metres, 5e-10 with micrometres as unit, with initial guesses 1.0
#
# Exit code 1 if that changes. Usage: bash findings/trait2d_lags_of_ensembles.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps \
    trait2d==1.2.1 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 python-dateutil==2.9.0.post0 six==1.17.0 tqdm==4.70.1
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version

warnings.simplefilter("ignore")
import numpy as np
from trait2d.analysis import ListOfTracks, Track

STEP, POINTS, DIFFUSIVITY = 0.1, 200, 0.5


def track(points, start=0.0):
    own = Track(x=points[:, 0], y=points[:, 1], t=start + STEP * np.arange(POINTS))
    own.calculate_msd()
    return own


def walks(number, unit):
    """Random walks in the plane with the diffusivity 0.5 µm²/s, in a unit."""
    rng = np.random.default_rng(0)
    return [track(1e-6 / unit * np.sqrt(2 * DIFFUSIVITY * STEP) * rng.normal(size=(POINTS, 2)).cumsum(axis=0))
            for _ in range(number)]


def fitted(tracks, guess):
    """The median of the diffusivities."""
    guesses = {"initial_guesses": {"model1": guess}} if guess else {}
    return float(np.median([own.msd_analysis(**guesses)["fit_results"]["model1"]["params"][0] for own in tracks]))


print(f"Python {sys.version.split()[0]}, TRAIT2D {version('trait2d')}, NumPy {np.__version__}")
flight = np.c_[STEP * np.arange(POINTS), np.zeros(POINTS)]
known = True
for start in (0.0, 100.0):
    times, squares, _ = ListOfTracks([track(flight, start)]).get_msd()
    print(f"a straight flight from the time {start:g} on: mean squares {squares[:3]} at {times[:3]}")
    known &= np.allclose(times[:3], start + STEP * np.arange(3)) and np.allclose(squares, (times - start + STEP) ** 2)
many = walks(300, 1e-6)
times, squares, _ = ListOfTracks(many).get_msd()
at_0 = [float(np.polyfit(when[:20], squares[:20], 1)[1]) for when in (times, times - times[0] + STEP)]
print(f"300 walks: a line crosses the axis at {at_0[0]:.3f}, with right times at {at_0[1]:.3f}; 4 D dt is "
      f"{4 * DIFFUSIVITY * STEP:g}")
known &= abs(at_0[0] - at_0[1] - 4 * DIFFUSIVITY * STEP) < 0.02 and at_0[0] > 0.1 > abs(at_0[1])
found = {}
for name, unit, guess in (("metres", 1.0, None), ("micrometres", 1e-6, None), ("micrometres, guessed", 1e-6, [1, 0.1])):
    found[name] = fitted(walks(40, unit), guess) / (DIFFUSIVITY * (1e-6 / unit) ** 2)
    print(f"fitted over the right diffusivity, in {name}: {found[name]:.3g}")
known &= abs(found["metres"] - 1) < 0.2 and found["micrometres"] < 1e-6 and abs(found["micrometres, guessed"] - 1) < 0.2
sys.exit(not known)
PYTHON
cd "$folder" && venv/bin/python main.py 2>"$folder/progress"

#!/usr/bin/env bash
# The mean square displacement of grains that hardly move is noise, and negative, since a Fourier transform computes it.
#
# tidynamics 1.1.2 and freud 3.4.0 (mode "window"). They take sums of x² and the transform of x, which grow with the
# distance from the origin: the small difference is lost. freud has float32: motion of 0.1 mm, 1 m from the origin, has
# an MSD of the wrong sign. tidynamics has doubles: motion of 10 nm is lost there, or of 1 µm at 100 m. No warning.
# Subtract the mean position of each particle first; then both are right.
#
# Seen on 2026-11-29, Python 3.11.7, error over the mean of the MSD, and the least MSD over the least true one:
#   freud, 1 m, 1e-4 m: 17, -17             after subtraction of the mean: 1e-8, 1
#   tidynamics, 1 m, 1e-8 m: 7.9, -3.1      after subtraction of the mean: 7e-16, 1
#   tidynamics, 100 m, 1e-6 m: 9.6, -9.0    after subtraction of the mean: 1e-15, 1
#
# Exit code 1 if that changes. Usage: bash findings/msd_by_fft_of_grains_at_rest.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    freud-analysis==3.4.0 tidynamics==1.1.2 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

import freud
import numpy as np
import tidynamics

LAGS = slice(1, 1000)


def direct(x):
    """The mean square displacement by its definition."""
    return np.array([((x[k:] - x[: len(x) - k]) ** 2).sum(-1).mean() for k in range(len(x))])


def by_freud(x):
    return freud.msd.MSD(mode="window").compute(x[:, None]).msd


def compare(name, msd, off, amplitude):
    """Positions around a point at `off` in x, y and z, with independent deviations of `amplitude`."""
    x = off + amplitude * np.random.default_rng(0).standard_normal((2000, 3))
    found = []
    for part in (x, x - x.mean(axis=0)):
        true, seen = direct(part)[LAGS], np.asarray(msd(part))[LAGS]
        found += [float(np.abs(seen - true).max() / true.mean()), float(seen.min() / true.min())]
    print(f"{name}, {off:g} m, {amplitude:g} m: error {found[0]:.2g}, least {found[1]:.2g}; "
          f"without the mean: {found[2]:.0e}, {found[3]:.3f}")
    return found[0] > 3 and found[1] < 0 and found[2] < 1e-5 and abs(found[3] - 1) < 1e-5


print(f"Python {sys.version.split()[0]}, freud {freud.__version__}, tidynamics {version('tidynamics')}, "
      f"NumPy {np.__version__}")
results = [compare("freud", by_freud, 1.0, 1e-4), compare("tidynamics", tidynamics.msd, 1.0, 1e-8),
           compare("tidynamics", tidynamics.msd, 100.0, 1e-6)]
sys.exit(not all(results))
PYTHON
cd "$folder" && venv/bin/python main.py

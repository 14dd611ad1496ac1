#!/usr/bin/env bash
# The spectrum of a track lacks most of its power, and its frequencies are 2 pi times too high.
#
# yupi 1.0.2. Expected: `PsdStat` is the spectrum of the velocities over frequencies in Hz, or over angular ones with
# `omega=True`. Seen: it is the Fourier transform of their correlations from lag 1 on, without lag 0, of one side, and
# taken as its modulus. So the velocities of Brownian motion, of which lag 0 is all, have a spectrum that is noise and
# falls as tracks get longer. Frequencies are 2 pi / time with the label Hz, and (2 pi)^2 / time with `omega=True`.
# Correlations and mean square displacements begin at lag 1 too, but their plots draw them from time 0 on.
#
# Seen on 2026-11-30, Python 3.11.7:
#   Brownian motion in the plane, D = 1, 30 tracks of 4000 steps: 0.40 on average, where 4 D is right; 16 000 steps 0.20
#   a point that turns once a second: the peak is at 6.28 "Hz", with omega at 39.5 rad/s
#   a straight flight: the first mean square displacement, (v dt)^2, is drawn at time 0
#
# Exit code 1 if that changes. Usage: bash findings/yupi_spectra_without_lag_0.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    yupi==1.0.2 numpy==2.4.6 matplotlib==3.11.2 opencv-python==5.0.0.93
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot
import numpy as np
from yupi import Trajectory
from yupi.stats import MsdTimeAvgStat, PsdStat

STEP, LAG, DIFFUSIVITY, TRACKS = 0.1, 100, 1.0, 30
rng = np.random.default_rng(0)


def brownian(steps):
    """A random walk in the plane."""
    return Trajectory(points=np.sqrt(2 * DIFFUSIVITY * STEP) * rng.normal(size=(steps, 2)).cumsum(axis=0), dt=STEP)


def spectrum_at_lag_0(tracks):
    """What lag 0 alone gives: the mean square of the velocity times the step."""
    return float(np.mean([np.square(np.asarray(track.v)).sum(axis=1).mean() for track in tracks])) * STEP


print(f"Python {sys.version.split()[0]}, yupi {version('yupi')}, NumPy {np.__version__}")
found = {}
for steps in (4000, 16000):
    tracks = [brownian(steps) for _ in range(TRACKS)]
    found[steps] = float(PsdStat(tracks, lag=LAG).psd_mean.mean()), spectrum_at_lag_0(tracks)
    print(f"Brownian motion, {steps} steps: {found[steps][0]:.3f} on average, lag 0 alone {found[steps][1]:.3f}, right "
          f"{4 * DIFFUSIVITY:g}")
time = 0.01 * np.arange(3000)
circle = Trajectory(points=np.c_[np.cos(2 * np.pi * time), np.sin(2 * np.pi * time)], dt=0.01)
peaks = {}
for omega in (False, True):
    spectrum = PsdStat([circle], lag=1000, omega=omega)
    peaks[omega] = float(abs(spectrum.frecuency[np.argmax(spectrum.psd_mean)]))
    label = spectrum.plot(show=False).get_xlabel()
    print(f"a point that turns once a second: the peak is at {peaks[omega]:.3f}, {label}")
flight = Trajectory(points=np.c_[STEP * np.arange(200), np.zeros(200)], dt=STEP)
matplotlib.pyplot.figure()
line = MsdTimeAvgStat([flight], lag=20).plot(show=False).lines[0]
times, squares = line.get_xdata(), line.get_ydata()
print(f"a straight flight with speed 1: {squares[:3]} drawn at times {times[:3]}")
known = found[4000][0] < 0.6 and found[16000][0] < 0.7 * found[4000][0]
known &= all(abs(of / (4 * DIFFUSIVITY) - 1) < 0.05 for _, of in found.values())
known &= abs(peaks[False] - 2 * np.pi) < 0.05 and abs(peaks[True] - 4 * np.pi**2) < 0.3
known &= np.allclose(times[:3], [0, STEP, 2 * STEP]) and np.allclose(squares[:3], np.square([STEP, 2 * STEP, 3 * STEP]))
sys.exit(not known)
PYTHON
cd "$folder" && venv/bin/python main.py

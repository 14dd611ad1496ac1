#!/usr/bin/env bash
# The mean of float32 numbers in a compiled function is off by 9 %, and their variance is far from 0.
#
# Numba 0.68.1. Ten million times 0.1 in float32: NumPy adds in pairs, and its mean is 0.1 to 1e-7. Numba's `np.mean`,
# `np.sum` and `np.var` add one after the other in float32, though what they return is a float64: 0.1088, and a
# standard deviation of 0.0088 of numbers that are all equal. `values.astype(np.float64)` mends it.
#
# Seen on 2026-11-29, Python 3.11.7:
#   mean: NumPy 0.1000000, Numba 0.1087937 (float)    std: NumPy 7.5e-09, Numba 8.8e-03
#
# Exit code 1 if that changes. Usage: bash findings/numba_means_of_float32.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys

import numba
import numpy as np


@numba.njit
def mean(values):
    return np.mean(values)


@numba.njit
def std(values):
    return np.std(values)


print(f"Python {sys.version.split()[0]}, Numba {numba.__version__}, NumPy {np.__version__}")
values = np.full(10_000_000, 0.1, dtype=np.float32)
means, stds = (np.mean(values), mean(values)), (np.std(values), std(values))
kind = type(means[1]).__name__
print(f"mean: NumPy {means[0]:.7f}, Numba {means[1]:.7f} ({kind})    std: NumPy {stds[0]:.1e}, Numba {stds[1]:.1e}")
sys.exit(not (abs(means[0] - 0.1) < 1e-6 and abs(means[1] - 0.1088) < 1e-3 and stds[0] < 1e-6 < 5e-3 < stds[1]))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# A histogram in a compiled function puts values at edges into other bins, and of equal values counts none.
#
# Numba 0.68.1. NumPy gives a value that is an edge to the bin on its right, of whatever rounding. Numba multiplies
# and cuts: of the 50 edges of 49 bins of 0 to 1, 26 counts are others. Where all values are equal NumPy takes half on
# each side; Numba takes bins of no width, and counts nothing: 3 particles of one speed are in none of its bins. No
# warning.
#
# Seen on 2026-11-29, Python 3.11.7:
#   26 of 49 bins differ; the first: [2 1 0 2 1 0] and not [1 1 1 1 1 1]
#   of three ones: NumPy [0 3 0], Numba [0 0 0]
#
# Exit code 1 if that changes. Usage: bash findings/numba_histogram.sh
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
def given(values, bins, low, high):
    return np.histogram(values, bins, (low, high))[0]


@numba.njit
def found(values, bins):
    return np.histogram(values, bins)[0]


print(f"Python {sys.version.split()[0]}, Numba {numba.__version__}, NumPy {np.__version__}")
edges = np.linspace(0.0, 1.0, 50)
plain, compiled = np.histogram(edges, 49, (0.0, 1.0))[0], given(edges, 49, 0.0, 1.0)
ones = np.histogram(np.ones(3), 3)[0], found(np.ones(3), 3)
print(f"{(plain != compiled).sum()} of 49 bins differ; the first: {compiled[:6]} and not {plain[:6]}")
print(f"of three ones: NumPy {ones[0]}, Numba {ones[1]}")
sys.exit(not ((plain != compiled).sum() == 26 and ones[0].tolist() == [0, 3, 0] and ones[1].tolist() == [0, 0, 0]))
PYTHON
cd "$folder" && venv/bin/python main.py

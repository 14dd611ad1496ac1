#!/usr/bin/env bash
# The square of an interval that has zero in it is nan, and its product with itself is not.
#
# python-flint 0.9.0. `x ** 2` of an `arb` around zero, such as 0 +/- 1, is nan, and so is `x ** 3`; `x * x` is +/-
# 1.01, as it should be. An interval beside zero, exact zero, and balls whose middle is not zero are right. So |r|^2
# of a box that holds the centre is nan, or not, by how it is written and by where the box is.
#
# Seen on 2026-11-29, Python 3.11.7:
#   (0 +/- 1)**2: nan   (0 +/- 1)**3: nan   (0 +/- 1)*(0 +/- 1): [+/- 1.01]   (1 +/- 2)**2: [+/- 9.01]   0**2: 0
#
# Exit code 1 if that changes. Usage: bash findings/flint_powers_of_intervals.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check python-flint==0.9.0
cat >"$folder/main.py" <<'PYTHON'
import platform
import sys

import flint
from flint import arb

print(f"Python {platform.python_version()}, python-flint {flint.__version__}")
around = arb(0, 1)
found = {
    "(0 +/- 1)**2": around**2,
    "(0 +/- 1)**3": around**3,
    "(0 +/- 1)*(0 +/- 1)": around * around,
    "(1 +/- 2)**2": arb(1, 2) ** 2,
    "0**2": arb(0) ** 2,
}
print("   ".join(f"{name}: {value}" for name, value in found.items()))
sys.exit([value.is_nan() for value in found.values()] != [True, True, False, False, False])
PYTHON
cd "$folder" && venv/bin/python main.py

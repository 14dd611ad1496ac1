#!/usr/bin/env bash
# A comparison of intervals that overlap raises a ValueError without a word; it was None before.
#
# mpmath 1.4.1. `iv.mpf([0, 1]) < iv.mpf([0.5, 2])` is neither true nor false. In 1.3.0 it is None, as the
# documentation has it; in 1.4.1 it raises `ValueError()`. So do `max`, `min` and `<` with a number at the end of the
# interval. Comparisons that are decided are as before.
#
# Seen on 2026-11-29, Python 3.11.7:
#   1.3.0: [0, 1] < [0.5, 2]: None            [0, 1] < 1: None            [0, 1] < 2: True
#   1.4.1: [0, 1] < [0.5, 2]: ValueError()    [0, 1] < 1: ValueError()    [0, 1] < 2: True
#
# Exit code 1 if that changes. Usage: bash findings/mpmath_overlapping_intervals.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
cat >"$folder/main.py" <<'PYTHON'
import subprocess
import sys

CODE = """
import mpmath
from mpmath import iv

def less(a, b):
    try:
        return repr(a < b)
    except ValueError as error:
        return repr(error)

x = iv.mpf([0, 1])
print(mpmath.__version__, less(x, iv.mpf([0.5, 2])), less(x, 1), less(x, 2))
"""
print(f"Python {sys.version.split()[0]}")
seen = {}
for version in ("1.3.0", "1.4.1"):
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"mpmath=={version}"]
    subprocess.run(pip, check=True)
    done = subprocess.run([sys.executable, "-c", CODE], check=True, text=True, capture_output=True)
    name, *found = done.stdout.split()
    seen[name] = found
    print(f"{name}: [0, 1] < [0.5, 2]: {found[0]:12}    [0, 1] < 1: {found[1]:12}    [0, 1] < 2: {found[2]}")
expected = {"1.3.0": ["None", "None", "True"], "1.4.1": ["ValueError()", "ValueError()", "True"]}
sys.exit(seen != expected)
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# A literal 0.1 among doubles is the float32 beside it.
#
# Taichi 1.7.4. Kernels whose arguments, fields and results are all `ti.f64` still have literals, and numbers of Python
# that they read from outside, in the type `default_fp`, which is float32: `x * 0.1` is off by 1.5e-8. A fall with
# g = 9.81 from outside is off by 4e-8, a hundred million times the round-off of doubles, and `ti.math.pi` by 3e-8. No
# warning. `ti.init(default_fp=ti.f64)` makes all right.
#
# Seen on 2026-11-29, Python 3.11.7, relative errors:
#   float32 as it is by itself: x * 0.1 1.5e-08, 9.81 from outside 4.3e-08, pi 2.8e-08
#   with default_fp=ti.f64:     0, 0, 0
#
# Exit code 1 if that changes. Usage: bash findings/taichi_literals_of_float32.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check taichi==1.7.4 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import math
import sys

import taichi as ti

GRAVITY = 9.81


def errors(**options):
    """The relative errors of a product with a literal, of a number from outside and of pi, all of them as f64."""
    ti.init(arch=ti.cpu, log_level=ti.ERROR, **options)

    @ti.kernel
    def tenth(x: ti.f64) -> ti.f64:
        return x * 0.1

    @ti.kernel
    def fall(time: ti.f64) -> ti.f64:
        return time * time * GRAVITY

    @ti.kernel
    def half_turn(radius: ti.f64) -> ti.f64:
        return radius * ti.math.pi

    found = tenth(3.0) / (3.0 * 0.1) - 1, fall(2.0) / (4.0 * GRAVITY) - 1, half_turn(1.0) / math.pi - 1
    return [abs(error) for error in found]


single, double = errors(), errors(default_fp=ti.f64)
print(f"Python {sys.version.split()[0]}, Taichi {'.'.join(map(str, ti.__version__))}")
for name, found in (("by itself", single), ("with default_fp=ti.f64", double)):
    print(f"{name}: x * 0.1 {found[0]:.1e}, 9.81 from outside {found[1]:.1e}, pi {found[2]:.1e}")
sys.exit(not (all(1e-8 < error < 1e-7 for error in single) and all(error < 1e-15 for error in double)))
PYTHON
cd "$folder" && venv/bin/python main.py

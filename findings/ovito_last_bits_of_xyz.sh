#!/usr/bin/env bash
# The numbers of a text file are read with an error of the last bit.
#
# OVITO 3.17.2. Of 3000 numbers that are written with all the digits that a double needs 325 are read as the double
# beside it: its reader of `.xyz` does not round correctly, where Python, NumPy and ASE do. Energies and chaotic paths
# that are computed from such a file are not those of the run; binary formats (`.gsd`, `.nc`) have the bits that are
# written.
#
# Seen on 2026-11-29, Python 3.11.7:
#   325 of 3000 numbers differ, by 1.1e-16 at most; those of NumPy: 0
#
# Exit code 1 if that changes. Usage: bash findings/ovito_last_bits_of_xyz.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check ovito==3.17.2 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from pathlib import Path

import numpy as np
import ovito
from ovito.io import import_file

print(f"Python {sys.version.split()[0]}, OVITO {ovito.version_string}, NumPy {np.__version__}")
written = np.random.default_rng(0).random((1000, 3))
rows = "".join("X " + " ".join(map(repr, map(float, row))) + "\n" for row in written)
Path("run.xyz").write_text("1000\nProperties=species:S:1:pos:R:3\n" + rows)
read = np.array(import_file("run.xyz").compute().particles.positions)
plain = np.loadtxt("run.xyz", skiprows=2, usecols=(1, 2, 3))
off = read != written
print(f"{off.sum()} of {off.size} numbers differ, by {np.abs(read - written).max():.1e} at most; "
      f"those of NumPy: {(plain != written).sum()}")
sys.exit(not (200 < off.sum() < 500 and np.abs(read - written).max() < 2.3e-16 and (plain == written).all()))
PYTHON
cd "$folder" && venv/bin/python main.py

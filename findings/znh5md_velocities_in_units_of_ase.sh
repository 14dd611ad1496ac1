#!/usr/bin/env bash
# Velocities of an H5MD file are ten times those of its attribute `unit`.
#
# ZnH5MD 0.4.8 with ASE 3.29.0. It writes velocities as ASE holds them, in Å √(eV/u), and gives them the attribute
# `unit` of "Angstrom/fs": by the file a particle of 1 Å/fs has 10.18 Å/fs. It reads the file back as it was, and a file
# of another program whose velocities are what that unit says comes out as much too slow. Positions and times beside
# them are in their units, so displacements between frames show the factor. MDAnalysis refuses the unit.
#
# Seen on 2026-11-30, Python 3.11.7, a particle that moves by 1 Å in each femtosecond:
#   positions 0, 1, 2 Å at 0, 1, 2 fs; velocity 10.18, and its unit Angstrom/fs
#
# Exit code 1 if that changes. Usage: bash findings/znh5md_velocities_in_units_of_ase.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps \
    znh5md==0.4.8 ase==3.29.0 h5py==3.16.0 numpy==2.4.6 scipy==1.17.1
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version

import ase
import ase.units
import h5py
import numpy as np
import znh5md

STEP = 1.0  # fs


def frame(k):
    """A particle that moves by 1 Å/fs along x."""
    atoms = ase.Atoms("Ar", positions=[[k * STEP, 0, 0]], cell=[10, 10, 10], pbc=True)
    atoms.set_velocities([[1 / ase.units.fs, 0, 0]])
    return atoms


znh5md.IO("run.h5", timestep=STEP).extend([frame(k) for k in range(3)])
with h5py.File("run.h5") as file:
    particles = next(iter(file["particles"].values()))
    position, velocity = particles["position"], particles["velocity"]
    x, v = position["value"][:, 0, 0], velocity["value"][:, 0, 0]
    spacing, clock = float(position["time"][()]), position["time"].attrs["unit"]
    units = position["value"].attrs["unit"], velocity["value"].attrs["unit"]
rate = float(np.diff(x)[0]) / spacing
back = znh5md.IO("run.h5")[1].get_velocities()[0, 0] * ase.units.fs
with h5py.File("run.h5", "r+") as file:  # as another program writes it
    next(iter(file["particles"].values()))["velocity/value"][:, 0, 0] = 1.0
slow = znh5md.IO("run.h5")[1].get_velocities()[0, 0] * ase.units.fs
print(f"Python {sys.version.split()[0]}, ZnH5MD {version('znh5md')}, ASE {ase.__version__}, h5py {h5py.__version__}")
print(f"positions {x} {units[0]}, {spacing:g} {clock} apart: {rate:g} {units[0]}/{clock}; velocities {v.round(3)} "
      f"{units[1]}; read back {back:.6f}, and where the file has 1 {slow:.4f} Angstrom/fs")
sys.exit(not (units == ("Angstrom", "Angstrom/fs") and clock == "fs" and abs(rate - 1) < 1e-9 and abs(back - 1) < 1e-9
              and abs(slow - ase.units.fs) < 1e-9
              and np.allclose(v, 1 / ase.units.fs) and abs(v[0] - 10.18) < 0.01))
PYTHON
cd "$folder" && venv/bin/python main.py

#!/usr/bin/env bash
# Velocities of a .gro file are a tenth of those that the positions have.
#
# OVITO 3.17.2. It turns the positions and the cell of a .gro file from nm to ångström, as its manual says, and leaves
# the velocities in nm/ps. So a particle that moves by 1 Å in each ps has 0.1, kinetic energies are a hundredth, and
# arrows or a prediction of the next frame are ten times too short. Nothing is said, and the time of the frame (`t=`)
# is not kept. Positions are moved to a box around the origin, as `centering` says. ASE, chemfiles and MDAnalysis have
# both in the same unit.
#
# Seen on 2026-11-30, Python 3.11.7, two frames that are 1 ps apart:
#   positions 1 Å further; velocity 0.1 by OVITO, 1 Å/ps by ASE, chemfiles and MDAnalysis
#
# Exit code 1 if that changes. Usage: bash findings/ovito_velocities_of_gro.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    ovito==3.17.2 ase==3.29.0 chemfiles==0.10.4 MDAnalysis==2.11.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version
from pathlib import Path

warnings.simplefilter("ignore")
import ase.io
import ase.units
import chemfiles
import MDAnalysis
from ovito.io import import_file

SPEED, EDGE = 0.1, 10.0  # nm/ps, nm


def frame(time):
    """A particle that moves along x, as GROMACS writes it."""
    place = "".join(f"{x:8.3f}" for x in (1 + SPEED * time, 2, 3)) + "".join(f"{v:8.4f}" for v in (SPEED, 0, 0))
    return f"run t= {time:.1f}\n    1\n    1AR      AR    1{place}\n" + f"{EDGE:10.5f}" * 3 + "\n"


names = ["0.gro", "1.gro"]
for time, name in enumerate(names):
    Path(name).write_text(frame(time))


def by_ovito(name):
    data = import_file(name).compute()
    return data.particles.positions[0][0], data.particles["Velocity"][0][0]


def by_ase(name):
    atoms = ase.io.read(name)
    return atoms.positions[0, 0], atoms.get_velocities()[0, 0] * 1000 * ase.units.fs


def by_chemfiles(name):
    with chemfiles.Trajectory(name) as file:
        read = file.read()
        return float(read.positions[0, 0]), float(read.velocities[0, 0])


def by_mdanalysis(name):
    atoms = MDAnalysis.Universe(name).atoms
    return atoms.positions[0, 0], atoms.velocities[0, 0]


print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("ovito", "ase", "chemfiles", "MDAnalysis")))
found = {}
for reader in (by_ovito, by_ase, by_chemfiles, by_mdanalysis):
    (start, velocity), (end, _) = map(reader, names)
    found[reader.__name__[3:]] = (round(float(end - start), 3), round(float(velocity), 3))
for name, (way, velocity) in found.items():
    print(f"{name}: {way} Å further after 1 ps, velocity {velocity}")
sys.exit(found != {"ovito": (1, 0.1), "ase": (1, 1), "chemfiles": (1, 1), "mdanalysis": (1, 1)})
PYTHON
cd "$folder" && venv/bin/python main.py

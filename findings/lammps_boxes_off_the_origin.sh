#!/usr/bin/env bash
# The same frame of LAMMPS is read at three places, none of them its own.
#
# ASE 3.29.0, MDAnalysis 2.11.0, MDTraj 1.11.1. `dump atom` of LAMMPS writes shares of the box by itself: x = lo + xs
# (hi - lo). In a box from -3 to 7, ASE forgets `lo`, and is 3 off. MDAnalysis moves boxes to the origin, which its
# documentation says, but takes `lo` away from shares too, and is 6 off. MDTraj gives the shares themselves as lengths.
# None warns. chemfiles is right. With `dump custom ... x y z` ASE and MDTraj are right, so files of one run differ by
# their columns alone. Write `dump_modify ID scale no`.
#
# Seen on 2026-11-29, Python 3.11.7, a particle at x = 2 in a box from -3 to 7:
#   columns xs ys zs: ASE 5, MDAnalysis 8, MDTraj 0.5, chemfiles 2
#   columns x y z:    ASE 2, MDAnalysis 5, MDTraj 2, chemfiles 2
#
# Exit code 1 if that changes. Usage: bash findings/lammps_boxes_off_the_origin.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    ase==3.29.0 MDAnalysis==2.11.0 mdtraj==1.11.1.post2 chemfiles==0.10.4 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version
from pathlib import Path

warnings.simplefilter("ignore")
import ase.io
import chemfiles
import MDAnalysis
import mdtraj

LOW, HIGH, PLACES = -3.0, 7.0, (2.0, -1.0)


def by_ase(name):
    return ase.io.read(name, format="lammps-dump-text").positions[0, 0]


def by_mdanalysis(name):
    return MDAnalysis.Universe(name, format="LAMMPSDUMP", topology_format="LAMMPSDUMP").atoms.positions[0, 0]


def by_mdtraj(name):
    topology = mdtraj.Topology()
    residue = topology.add_residue("X", topology.add_chain())
    for _ in PLACES:
        topology.add_atom("X", mdtraj.element.virtual, residue)
    return 10 * mdtraj.load_lammpstrj(name, top=topology).xyz[0, 0, 0]  # ångström from nm


def by_chemfiles(name):
    with chemfiles.Trajectory(name) as file:
        frame = file.read()
    return frame.positions[0, 0]


def read(columns, numbers):
    """The x of the first particle of one frame, by each reader."""
    rows = "".join(f"{i} 1 {x!r} {x!r} {x!r}\n" for i, x in enumerate(numbers, 1))
    Path("run.lammpstrj").write_text(
        f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{len(numbers)}\nITEM: BOX BOUNDS ff ff ff\n"
        + f"{LOW} {HIGH}\n" * 3 + f"ITEM: ATOMS id type {columns}\n" + rows)
    found = [round(float(reader("run.lammpstrj")), 4) for reader in (by_ase, by_mdanalysis, by_mdtraj, by_chemfiles)]
    names = "ASE", "MDAnalysis", "MDTraj", "chemfiles"
    print(f"columns {columns}: " + ", ".join(f"{name} {x:g}" for name, x in zip(names, found)))
    return found


print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("ase", "MDAnalysis", "mdtraj", "chemfiles")))
scaled = read("xs ys zs", [(x - LOW) / (HIGH - LOW) for x in PLACES])
plain = read("x y z", PLACES)
sys.exit(not (scaled == [5, 8, 0.5, 2] and plain == [2, 5, 2, 2]))
PYTHON
cd "$folder" && venv/bin/python main.py

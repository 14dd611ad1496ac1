#!/usr/bin/env bash
# A tilted box is written to GSD with other tilts, and read from GSD as the transposed one.
#
# MDTraj 1.11.1. GSD has the tilt factors of HOOMD-blue: the second edge of a box is (xy Ly, Ly, 0). `save_gsd` writes
# the tilts of LAMMPS, xy Ly, in place of xy, and `load` takes the edges as rows of a matrix that has them as columns.
# Both are silent, and one does not undo the other: a box of 10 x 12 x 14 comes back with a volume of 1680 and a first
# edge of 43. Positions stay, so distances through the boundary are wrong. Boxes without tilt are right, and so are
# tilted ones as DCD, XTC, NetCDF and .gro.
#
# Seen on 2026-11-30, Python 3.11.7, edges (10, 0, 0), (1.2, 12, 0), (2.8, 4.2, 14), tilt factors 0.1, 0.2, 0.3:
#   saved tilt factors: 1.2, 2.8, 4.2
#   lengths of the edges, loaded from a file of gsd: 10.45, 12.71, 14.00, where 10, 12.06, 14.88 is right
#   saved and loaded: 42.9, 60.0, 14.0
#
# Exit code 1 if that changes. Usage: bash findings/mdtraj_tilted_boxes_of_gsd.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    mdtraj==1.11.1.post2 gsd==5.0.1 freud-analysis==3.4.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version

warnings.simplefilter("ignore")
import freud
import gsd.hoomd
import mdtraj
import numpy as np

LENGTHS = np.array([10.0, 12.0, 14.0])


def edges(box):
    """Edges as rows, as the file means them."""
    return freud.box.Box.from_box(box).to_matrix().T


def gsd_box(name):
    with gsd.hoomd.open(name) as file:
        return np.array(file[0].configuration.box)


def read(name):
    return mdtraj.load(name).unitcell_vectors[0]


def compare(factors):
    """The box that MDTraj writes, and edges of a file of gsd and of its own, read again."""
    right = [*LENGTHS, *factors]
    frame = gsd.hoomd.Frame()
    frame.particles.N, frame.particles.types, frame.particles.typeid = 1, ["A"], [0]
    frame.particles.position = [[1, 2, 3]]
    frame.configuration.box = right
    with gsd.hoomd.open("right.gsd", "w") as file:
        file.append(frame)
    run = mdtraj.load("right.gsd")
    run.unitcell_vectors = edges(right)[None].astype(np.float32)
    run.save_gsd("saved.gsd")
    run.save_dcd("saved.dcd")
    other = mdtraj.load("saved.dcd", top=run.topology).unitcell_vectors[0]
    saved, loaded, again = gsd_box("saved.gsd"), read("right.gsd"), read("saved.gsd")
    norms = [np.linalg.norm(e, axis=1).round(2) for e in (edges(right), loaded, again)]
    print(f"tilt factors {factors}: saved {saved[3:].round(3)}; lengths of edges {norms[0]}, loaded {norms[1]}, "
          f"saved and loaded {norms[2]}, by DCD {np.linalg.norm(other, axis=1).round(2)}")
    return saved, loaded, again, np.allclose(other, edges(right), atol=1e-4)


def is_turned(loaded, matrix):
    """Whether edges are, but for a rotation, the rows of a matrix that has them as columns."""
    return np.allclose(loaded @ loaded.T, matrix.T @ matrix, rtol=1e-3)


print(f"Python {sys.version.split()[0]}, MDTraj {version('mdtraj')}, gsd {version('gsd')}, freud {freud.__version__}")
straight, tilted = compare([0.0, 0.0, 0.0]), compare([0.1, 0.2, 0.3])
known = straight[3] and tilted[3] and np.allclose(straight[0], [*LENGTHS, 0, 0, 0], atol=1e-4)
known &= all(np.allclose(found, np.diag(LENGTHS), atol=1e-4) for found in straight[1:3])
known &= np.allclose(tilted[0], [*LENGTHS, 1.2, 2.8, 4.2], atol=1e-4)
known &= is_turned(tilted[1], edges([*LENGTHS, 0.1, 0.2, 0.3])) and is_turned(tilted[2], edges(tilted[0]))
sys.exit(not known)
PYTHON
cd "$folder" && venv/bin/python main.py

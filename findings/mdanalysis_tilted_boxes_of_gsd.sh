#!/usr/bin/env bash
# A tilted box of a GSD file is read as another box.
#
# MDAnalysis 2.11.0. GSD stores a box as Lx, Ly, Lz and the tilt factors xy, xz, yz of HOOMD-blue: its second edge is
# (xy Ly, Ly, 0). MDAnalysis takes the three lengths as those of the edges, and arccos of the tilt factors, in that
# order, as the angles alpha, beta, gamma. So xy tilts the edges b and c, and yz the edges a and b. The volume and
# distances through the boundary are others, and of a factor above 1 the angle is nan. Nothing is said, and no report of
# it was found. Boxes without tilt are right. freud reads the same numbers as the file means them.
#
# Seen on 2026-11-30, Python 3.11.7, a box of 10 x 10 x 10, two particles that are 0.5 apart through the boundary:
#   xy = 0.5: second edge (5, 10, 0), by MDAnalysis (0, 10, 0); volume 1000, 866; distance 0.5, 5.02
#   xy = 1.2: angle alpha nan, volume 0
#
# Exit code 1 if that changes. Usage: bash findings/mdanalysis_tilted_boxes_of_gsd.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    MDAnalysis==2.11.0 gsd==5.0.1 freud-analysis==3.4.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version

warnings.simplefilter("ignore")
import freud
import gsd.hoomd
import MDAnalysis
import numpy as np
from MDAnalysis.lib.distances import calc_bonds

LENGTH, GAP = 10.0, 0.5


def compare(xy):
    """The second edge, the volume and a distance through the boundary: by the file, freud and MDAnalysis."""
    edges = np.array([[LENGTH, 0, 0], [xy * LENGTH, LENGTH, 0], [0, 0, LENGTH]])
    start = np.array([0.0, -4.75, 0.0])
    frame = gsd.hoomd.Frame()
    frame.particles.N = 2
    frame.particles.position = [start, start + edges[1] - [0, GAP, 0]]
    frame.configuration.box = [LENGTH, LENGTH, LENGTH, xy, 0, 0]
    with gsd.hoomd.open("run.gsd", "w") as file:
        file.append(frame)
    with gsd.hoomd.open("run.gsd") as file:
        box = freud.box.Box.from_box(file[0].configuration.box)
        between = box.wrap(file[0].particles.position[1] - file[0].particles.position[0])
    universe = MDAnalysis.Universe("run.gsd")
    first, second = universe.atoms.positions
    apart = float(calc_bonds(first, second, box=universe.dimensions))
    edge, volume = universe.trajectory.ts.triclinic_dimensions[1], universe.trajectory.ts.volume
    print(f"xy = {xy:g}: by freud second edge {box.to_matrix()[:, 1]}, volume {box.volume:.4g}, distance "
          f"{np.linalg.norm(between):.3f}; by MDAnalysis {universe.dimensions}, second edge {np.round(edge, 4)}, "
          f"volume {volume:.4g}, distance {apart:.3f}")
    right = (np.allclose(box.to_matrix(), edges.T, atol=1e-5) and abs(np.linalg.norm(between) - GAP) < 1e-5)
    return right, universe.dimensions[3:], edge, float(volume), apart


print(f"Python {sys.version.split()[0]}, MDAnalysis {MDAnalysis.__version__}, gsd {version('gsd')}, "
      f"freud {freud.__version__}")
straight, tilted, far = (compare(xy) for xy in (0.0, 0.5, 1.2))
known = straight[0] and tilted[0] and far[0]
known &= np.allclose(straight[1], 90) and abs(straight[3] - LENGTH**3) < 0.1 and abs(straight[4] - GAP) < 1e-5
known &= np.allclose(tilted[1], [60, 90, 90], atol=1e-3) and np.allclose(tilted[2], [0, LENGTH, 0], atol=1e-3)
known &= abs(tilted[3] / LENGTH**3 - np.sqrt(0.75)) < 1e-3 and tilted[4] > 4
known &= bool(np.isnan(far[1][0]))
sys.exit(not known)
PYTHON
cd "$folder" && venv/bin/python main.py

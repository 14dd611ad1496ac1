#!/usr/bin/env bash
# A tilted box of a LAMMPS dump is read as a larger one.
#
# chemfiles 0.10.4. For a tilted box LAMMPS dumps the bounds of the box around it: xhi_bound = xhi + max(0, xy, xz, xy +
# xz), and so on, as its documentation says. chemfiles takes these bounds as the lengths of the edges. What depends on
# them is off too: positions given as shares of the box, and those that it moves back by the image flags `ix iy iz` of
# the file, which it does unasked. A dump that it writes has the lengths where bounds belong, so that others read a
# smaller box. Nothing is said. ASE, OVITO and lammpsio give the box of the run. Boxes without tilt are right.
#
# Seen on 2026-11-30, Python 3.11.7, edges 10, 12, 14 with xy = 1.2, xz = 2.8, yz = 4.2:
#   first edge: chemfiles 14, ASE, OVITO and lammpsio 10; volume 3175 and 1680
#   x of a particle at 0.4: as x 0.4; as a share 2.4; with image 1 along x 14.4, where 10.4 is right
#   the same box written by chemfiles: first edge 6 by ASE and OVITO
#
# Exit code 1 if that changes. Usage: bash findings/chemfiles_tilted_boxes_of_lammps.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    chemfiles==0.10.4 ase==3.29.0 ovito==3.17.2 lammpsio==0.9.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version
from pathlib import Path

warnings.simplefilter("ignore")
import ase.io
import chemfiles
import lammpsio
import numpy as np
from ovito.io import import_file

EDGES = np.array([[10.0, 0, 0], [1.2, 12, 0], [2.8, 4.2, 14]])
SHARES = np.array([0.5, 0.25, 0.75])
LOW = np.array([-7.0, -8.1, -7.0])
(_, _, _), (XY, _, _), (XZ, YZ, _) = EDGES
HIGH = LOW + np.diag(EDGES)
LEAST = LOW + [min(0, XY, XZ, XY + XZ), min(0, YZ), 0]  # bounds as LAMMPS has them
MOST = HIGH + [max(0, XY, XZ, XY + XZ), max(0, YZ), 0]
PLACE = LOW + SHARES @ EDGES


def write(columns, *numbers):
    """A frame with one particle."""
    rows = "".join(f"{low!r} {high!r} {tilt!r}\n" for low, high, tilt in
                   zip(LEAST.tolist(), MOST.tolist(), (XY.item(), XZ.item(), YZ.item())))
    Path("run.lammpstrj").write_text(
        f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS xy xz yz pp pp pp\n{rows}"
        f"ITEM: ATOMS id type {columns}\n1 1 " + " ".join(map(str, numbers)) + "\n")


def by_chemfiles():
    """The cell, with edges as rows, and x."""
    with chemfiles.Trajectory("run.lammpstrj") as file:
        frame = file.read()
        return frame.cell.matrix.T.copy(), round(float(frame.positions[0, 0]), 6)


print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("chemfiles", "ase", "ovito", "lammpsio")))
write("x y z", *PLACE.tolist())
cell, plain = by_chemfiles()
box = next(iter(lammpsio.DumpFile("run.lammpstrj"))).box
others = {"ASE": ase.io.read("run.lammpstrj", format="lammps-dump-text").cell[:],
          "OVITO": import_file("run.lammpstrj").compute().cell[:, :3].T,
          "lammpsio": np.diag(np.array(box.high) - box.low) + np.array(
              [[0, 0, 0], [box.tilt[0], 0, 0], [box.tilt[1], box.tilt[2], 0]])}
write("xs ys zs", *SHARES.tolist())
_, shared = by_chemfiles()
write("x y z ix iy iz", *PLACE.tolist(), 1, 0, 0)
_, image = by_chemfiles()
frame = chemfiles.Frame()
frame.add_atom(chemfiles.Atom("Ar"), PLACE)
frame.cell = chemfiles.UnitCell(EDGES.T)
with chemfiles.Trajectory("written.lammpstrj", "w") as file:
    file.write(frame)
written = [float(import_file("written.lammpstrj").compute().cell[0, 0]),
           float(ase.io.read("written.lammpstrj", format="lammps-dump-text").cell[0, 0])]
print(f"edges of chemfiles: {cell.round(4).tolist()}, volume {np.linalg.det(cell):.0f}; of the run, as by "
      f"{', '.join(others)}: {EDGES.tolist()}, volume {np.linalg.det(EDGES):.0f}")
print(f"x of a particle at {PLACE[0]:g}: as x {plain}, as a share {shared}, in the next image {image}")
print(f"first edge of a dump that chemfiles writes: {written} by OVITO and ASE")
right = all(np.allclose(found, EDGES, atol=1e-9) for found in others.values())
larger = EDGES.copy()
larger[0, 0], larger[1, 1] = (MOST - LEAST)[:2]
sys.exit(not (right and np.allclose(cell, larger) and (plain, shared, image) == (0.4, 2.4, 14.4)
              and np.allclose(written, 6)))
PYTHON
cd "$folder" && venv/bin/python main.py

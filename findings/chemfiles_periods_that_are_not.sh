#!/usr/bin/env bash
# Distances go through walls: a cell is periodic although the file says that it is not.
#
# chemfiles 0.10.4. An extended .xyz file has a cell in `Lattice`, and `pbc` with T or F for each of its directions.
# chemfiles keeps `pbc` as a text, and takes all three directions as periodic: two particles at either end of a box with
# walls are 1 apart instead of 9. ASE reads the same file with 9. Set `frame.cell = chemfiles.UnitCell()` for a box
# without periods. What chemfiles writes as .xyz has 6 digits of each position, and no velocities that it was given.
#
# Seen on 2026-11-29, Python 3.11.7:
#   pbc "T T F": 1, "F F F": 1     ASE: 9, 9     0.123456789 is written as 0.123457, velocities in the file: none
#
# Exit code 1 if that changes. Usage: bash findings/chemfiles_periods_that_are_not.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check chemfiles==0.10.4 ase==3.29.0 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version
from pathlib import Path

import ase.io
import chemfiles


def distances(pbc):
    """The distance of two particles, 9 apart along z in a cell of 10, by chemfiles and by ASE."""
    Path("two.xyz").write_text(
        f'2\nLattice="10 0 0 0 10 0 0 0 10" Properties=species:S:1:pos:R:3 pbc="{pbc}"\nX 1 2 0.5\nX 1 2 9.5\n')
    with chemfiles.Trajectory("two.xyz") as file:
        by_chemfiles = file.read().distance(0, 1)
    return by_chemfiles, float(ase.io.read("two.xyz").get_distance(0, 1, mic=True))


frame = chemfiles.Frame()
frame.add_velocities()
frame.add_atom(chemfiles.Atom("X"), [0.123456789, 2.0, 3.0], [7.0, 8.0, 9.0])
with chemfiles.Trajectory("written.xyz", "w") as file:
    file.write(frame)
row = Path("written.xyz").read_text().splitlines()[2]
print(f"Python {sys.version.split()[0]}, chemfiles {version('chemfiles')}, ASE {ase.__version__}")
found = [distances(pbc) for pbc in ("T T F", "F F F")]
for pbc, (one, other) in zip(("T T F", "F F F"), found):
    print(f'pbc "{pbc}": chemfiles {one:g}, ASE {other:g}')
print(f"a particle at 0.123456789, 2, 3 with a velocity is written as: {row}")
sys.exit(not (all(abs(one - 1) < 1e-9 and abs(other - 9) < 1e-9 for one, other in found)
              and row.split() == ["X", "0.123457", "2", "3"]))
PYTHON
cd "$folder" && venv/bin/python main.py

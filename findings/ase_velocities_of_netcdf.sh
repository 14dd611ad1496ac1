#!/usr/bin/env bash
# Velocities of a trajectory are read 98 times too fast, and written so that positions have a unit of velocities.
#
# ASE 3.29.0. The AMBER convention of NetCDF has velocities in ångström per picosecond. ASE takes their numbers as its
# own unit, ångström per 10.18 fs, without a look at `units`: 1 Å/ps is read as 98.2 Å/ps, and kinetic energies are 9649
# times too large. Its reader of `.gro` converts. What it writes has velocities in its own unit and without `units`;
# "Angstrom/Femtosecond", which they do not have either, is set on `coordinates` in their place. MDAnalysis then refuses
# the file, with a sentence about the unit of positions. Multiply by `ase.units.Angstrom / (1000 * ase.units.fs)`.
#
# Seen on 2026-11-29, Python 3.11.7:
#   1 Å/ps from MDAnalysis is read as 98.227 Å/ps by ASE
#   written by ASE: 1 Å/ps as 0.01018 without a unit, units of coordinates "Angstrom/Femtosecond"
#
# Exit code 1 if that changes. Usage: bash findings/ase_velocities_of_netcdf.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    ase==3.29.0 MDAnalysis==2.11.0 netCDF4==1.7.5.1.post1 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
import warnings
from importlib.metadata import version

warnings.simplefilter("ignore")
import ase.io
import MDAnalysis
import netCDF4
from ase import units
from ase.io.netcdftrajectory import NetCDFTrajectory

PER_PS = units.Angstrom / (1000 * units.fs)


def from_mdanalysis():
    """1 Å/ps along x, written by MDAnalysis: its unit in the file, and what ASE and MDAnalysis read."""
    universe = MDAnalysis.Universe.empty(1, trajectory=True, velocities=True)
    universe.dimensions = [10, 10, 10, 90, 90, 90]
    universe.atoms.velocities = [[1, 0, 0]]
    with MDAnalysis.Writer("one.ncdf", n_atoms=1, velocities=True) as file:
        file.write(universe.atoms)
    with netCDF4.Dataset("one.ncdf") as file:
        unit = file["velocities"].units
    by_ase = ase.io.read("one.ncdf", format="netcdftrajectory").get_velocities()[0, 0] / PER_PS
    again = MDAnalysis.Universe.empty(1)
    again.load_new("one.ncdf")
    return unit, float(by_ase), float(again.trajectory.ts.velocities[0, 0])


def from_ase():
    """1 Å/ps along x, written by ASE: the number and the units in the file, and what MDAnalysis says."""
    atoms = ase.Atoms("Ar", positions=[(1, 2, 3)], cell=(10, 10, 10), pbc=True)
    atoms.set_velocities([(PER_PS, 0, 0)])
    with NetCDFTrajectory("two.nc", "w", atoms, netcdf_format="NETCDF3_64BIT_OFFSET") as file:
        file.write(atoms)
    with netCDF4.Dataset("two.nc") as file:
        number = float(file["velocities"][0, 0, 0])
        found = number, getattr(file["velocities"], "units", None), file["coordinates"].units
    try:
        MDAnalysis.Universe.empty(1).load_new("two.nc", format="NCDF")
    except NotImplementedError as error:
        return *found, str(error)
    return *found, ""


print(f"Python {sys.version.split()[0]}, " + ", ".join(
    f"{name} {version(name)}" for name in ("ase", "MDAnalysis", "netCDF4")))
unit, by_ase, by_mdanalysis = from_mdanalysis()
print(f"1 {unit} from MDAnalysis: ASE reads {by_ase:.3f} Å/ps, MDAnalysis {by_mdanalysis:g} Å/ps")
number, of_velocities, of_positions, message = from_ase()
print(f"1 Å/ps from ASE: {number:.5f}, units of velocities {of_velocities}, units of coordinates {of_positions}")
print(f"MDAnalysis says: {message}")
sys.exit(not (unit == "angstrom/picosecond" and abs(by_ase - 98.227) < 1e-3 and by_mdanalysis == 1
              and abs(number - PER_PS) < 1e-8 and of_velocities is None and of_positions == "Angstrom/Femtosecond"
              and of_positions in message))
PYTHON
cd "$folder" && venv/bin/python main.py

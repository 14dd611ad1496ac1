#!/usr/bin/env bash
# Every mass of a run of one species of DynamO is read as 1, and so is every mass of a column that the reader wrote.
#
# atooms 3.30.2. DynamO, a program of event-driven dynamics, gives each species of its file a `Mass`. `TrajectoryDynamO`
# reads it where there are two species or more; where there is one, which is the usual gas, all particles get 1, and
# temperatures and energies are off by the mass. `TrajectoryXYZ` writes the column `mass` if asked to, and says so in
# its header, but reads masses of a header alone: they come back as 1, while `radius`, beside it, is right.
# `TrajectoryEXYZ` keeps both. None warns.
#
# Seen on 2026-11-30, Python 3.11.7:
#   DynamO, one species of mass 2.5: mass 1, temperature 0.095, not 0.2375     two species: masses 2.5 and 4, 0.345
#   xyz, masses 2.5 and 4: 1 and 1, radii 0.3 and 0.4     extended xyz: 2.5 and 4, 0.3 and 0.4
#
# Exit code 1 if that changes. Usage: bash findings/atooms_masses_are_one.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check atooms==3.30.2 numpy==2.4.6
cat >"$folder/main.py" <<'PYTHON'
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from atooms.system import Cell, Particle, System
from atooms.trajectory import TrajectoryDynamO, TrajectoryEXYZ, TrajectoryXYZ

ROWS = [(1, 2, 3), (-1, -2, -3), (4, 2, 3)]


def configuration(*species):
    """A file of DynamO of three hard spheres, with (mass, name, range of particles) of each species."""
    kinds = "".join(f'<Species Mass="{mass}" Name="{name}" Type="Point"><IDRange {ids}/></Species>'
                    for mass, name, ids in species)
    particles = "".join(f'<Pt ID="{i}"><P x="{x}" y="{y}" z="{z}"/><V x="{x / 10}" y="{y / 10}" z="{z / 10}"/></Pt>'
                        for i, (x, y, z) in enumerate(ROWS))
    Path("config.xml").write_text(
        f'<?xml version="1.0"?><DynamOconfig version="1.5.0"><Simulation><SimulationSize x="10" y="10" z="10"/>'
        f'<Genus>{kinds}</Genus><BC Type="PBC"/><Interactions><Interaction Type="HardSphere" Diameter="1" '
        f'Elasticity="1" Name="Bulk"><IDPairRange Type="All"/></Interaction></Interactions>'
        f'<Dynamics Type="Newtonian"/></Simulation><ParticleData>{particles}</ParticleData></DynamOconfig>')


def by_dynamo(*species):
    configuration(*species)
    with TrajectoryDynamO("config.xml") as file:
        system = file[0]
    return [p.mass for p in system.particle], round(float(system.temperature), 6)


def round_trip(kind):
    """Masses and radii through a file that the class writes and reads."""
    particles = [Particle(species="A", position=np.array(row, dtype=float), mass=mass, radius=radius)
                 for row, mass, radius in zip(ROWS, (2.5, 4.0), (0.3, 0.4))]
    with kind("run.xyz", "w") as file:
        file.variables = ["species", "position", "mass", "radius"]
        file.write(System(particle=particles, cell=Cell([10.0, 10.0, 10.0])), 0)
    with kind("run.xyz") as file:
        system = file[0]
    return [p.mass for p in system.particle], [round(p.radius, 6) for p in system.particle]


print(f"Python {sys.version.split()[0]}, atooms {version('atooms')}, NumPy {np.__version__}")
one = by_dynamo((2.5, "A", 'Type="All"'))
two = by_dynamo((2.5, "A", 'Type="Ranged" Start="0" End="0"'), (4, "B", 'Type="Ranged" Start="1" End="2"'))
print(f"DynamO, one species of mass 2.5: masses {one[0]}, temperature {one[1]}; two species: {two[0]}, {two[1]}")
plain, extended = round_trip(TrajectoryXYZ), round_trip(TrajectoryEXYZ)
print(f"xyz: masses {plain[0]}, radii {plain[1]}; extended xyz: masses {extended[0]}, radii {extended[1]}")
sys.exit(not (one == ([1, 1, 1], 0.095) and two == ([2.5, 4, 4], 0.345) and plain == ([1, 1], [0.3, 0.4])
              and extended == ([2.5, 4], [0.3, 0.4])))
PYTHON
cd "$folder" && venv/bin/python main.py

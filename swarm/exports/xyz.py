"""Extended XYZ: text, a line a particle and two before each frame; for OVITO, ASE and others.

Readers have no common names: OVITO takes velocities from `velo` and masses from `mass`, ASE from `momenta` and
`masses`. All are written, except a `mass` that all particles share, which is in the line before them.

Species are X. Lattice and Origin are written for a periodic scene: in a direction without a period the cell has
the length of the scene. Numbers have enough digits for the same bits.
"""

import math
from pathlib import Path

import numpy as np

from .exported import Exported, lines_of

# The names that readers know; others stay as they are.
_NAMES = {"position": "pos", "velocity": "velo", "mass": "mass"}
_KINDS = {"f": "R", "i": "I"}


def write(chosen: Exported, path: Path) -> None:
    """Write the particles."""
    alike = bool((chosen.mass == chosen.mass[0]).all())
    cell = _cell(chosen)
    with open(path, "wb") as file:
        for moment in chosen.moments():
            columns = {
                "position": moment.position,
                "velocity": moment.velocity,
                "momenta": moment.mass[:, None] * moment.velocity,
                "masses": moment.mass,
                "id": moment.ids,
                **moment.more,
            }
            columns |= {} if alike else {"mass": moment.mass}
            columns |= {} if moment.radius is None else {"radius": moment.radius}
            about = [cell, "Properties=species:S:1"]
            for name, column in columns.items():
                about[1] += f":{_NAMES.get(name, name)}:{_KINDS[column.dtype.kind]}:{math.prod(column.shape[1:])}"
            about += [f"Time={moment.time!r}", f"frame={moment.number}"]
            about += [f"mass={float(chosen.mass[0])!r}"] if alike else []
            file.write(f"{len(moment.ids)}\n{' '.join(filter(None, about))}\n".encode())
            file.write(lines_of(columns.values(), b"X ", b" ", b"nan"))


def _cell(chosen: Exported) -> str:
    """The keys of a periodic cell."""
    periods, scene = chosen.periods, chosen.trajectory.scene
    if not periods.any():
        return 'pbc="F F F"'
    low, high = np.array(scene.bounds())
    low, high = np.where(np.isfinite(low), low, -scene.extent()), np.where(np.isfinite(high), high, scene.extent())
    edges = np.where(periods > 0.0, periods, high - low)
    lattice, origin = " ".join(map(repr, np.diag(edges).ravel().tolist())), " ".join(map(repr, low.tolist()))
    return f'Lattice="{lattice}" Origin="{origin}" pbc="{" ".join("T" if length else "F" for length in periods)}"'

"""CSV: a line a particle and frame, for spreadsheets, pandas and R, with enough digits for the same bits.

The first line has the plain names of the columns, so that every program reads the file unaided: frame, time [s],
id, x, y, z [m], vx, vy, vz [m/s], mass [kg], for balls radius [m], if they turn wx, wy, wz [rad/s], then impacts and
further columns; for points of bodies also body, its number. A cell without a value is empty, such as
the escape time of a particle inside. A file of one frame can be a start: `from = "start.csv"`,
`Particles.from_csv`.
"""

from pathlib import Path
from typing import Any

from .exported import Exported, lines_of

# The columns of vectors by name; other vectors have the columns NAME_x, NAME_y, NAME_z.
_VECTORS = {"position": ("x", "y", "z"), "velocity": ("vx", "vy", "vz"), "spin": ("wx", "wy", "wz")}


def write(chosen: Exported, path: Path) -> None:
    """Write the particles."""
    begun, copies = False, chosen.trajectory.copies
    with open(path, "wb") as file:
        for moment in chosen.moments():
            columns: dict[str, Any] = {"id": moment.ids, "position": moment.position, "velocity": moment.velocity}
            columns["mass"] = moment.mass
            columns |= {} if moment.radius is None else {"radius": moment.radius}
            columns |= {"spin": moment.more["spin"]} if "spin" in moment.more else {}
            columns |= {"body": moment.ids % copies} if copies else {}
            columns |= moment.more
            if not begun:
                names = [part for name, column in columns.items() for part in _names(name, column.ndim)]
                file.write(f"frame,time,{','.join(names)}\n".encode())
                begun = True
            file.write(lines_of(columns.values(), f"{moment.number},{moment.time!r},".encode(), b","))


def _names(name: str, dimensions: int) -> tuple[str, ...]:
    return _VECTORS.get(name, tuple(f"{name}_{axis}" for axis in "xyz")) if dimensions > 1 else (name,)

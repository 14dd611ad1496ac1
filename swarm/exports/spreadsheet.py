"""CSV: a line a particle and frame, for spreadsheets, pandas and R, with the digits that give the same bits again.

The first line has the names, plain ones, of the columns, so that every program reads the file unaided: frame, time [s],
id, x, y, z [m], vx, vy, vz [m/s], mass [kg], of balls radius [m], where they turn wx, wy, wz [rad/s], then impacts and
what else there is; of points of bodies also body, its number. A cell is empty where there is no number, such as
the escape time of a particle that is inside. A file of one frame is a start: `from = "start.csv"`,
`Particles.from_csv`.
"""

from pathlib import Path
from typing import Any

from .exported import Exported, lines_of

# Columns of vectors, by their names; of others the names of the components are NAME_x, NAME_y, NAME_z.
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

"""PLY files, one a frame, for Blender, MeshLab, Open3D, trimesh and game engines; binary, little-endian.

Vertices have x, y, z, vx, vy, vz, speed, mass and, for balls, radius as float, with seven digits, which most
readers keep of any number; red, green, blue as in pictures; and `particle`, its number, since Blender accepts no
`id`. With openings they have escaped, and with absorbing walls absorbed, 0 or 1; particles that come later in a
run are left out. Points of bodies have the number of their `body`: one with faces has its contact points as vertices,
without a mass, and its triangles as faces, another one its bonds as edges. Comments have the time, the number of the
frame, the meaning of colours and, in a scene far from the origin, the center that positions are relative to. The walls
are written as .obj (obj.py). Read by Blender 4.5.
"""

import glob
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files.origin import origin_of
from ..pictures import colours
from ..state import Floats
from .exported import Exported, ExportedFrame

_KINDS = {"f4": "float", "u1": "uchar", "i4": "int"}
# A face is written as the number of its corners, and their indices.
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
_EDGE = np.dtype([("vertex1", "<i4"), ("vertex2", "<i4")])
_BEGIN = b"ply\nformat binary_little_endian 1.0\ncomment swarm"
# Digits of the number in a file's name.
_DIGITS = 4


def names_of(target: Path, count: int) -> list[Path]:
    """The names of `count` files: `target` itself for one, else OUT_0000.ply and so on."""
    if count == 1:
        return [target]
    digits = max(_DIGITS, len(str(count - 1)))
    return [target.with_name(f"{target.stem}_{k:0{digits}}{target.suffix}") for k in range(count)]


def older(target: Path) -> list[Path]:
    """The files of an earlier sequence with the name `target`."""
    found = []
    for path in sorted(target.parent.glob(f"{glob.escape(target.stem)}_*{glob.escape(target.suffix)}")):
        digits = path.stem[len(target.stem) + 1 :]
        if digits.isdecimal() and len(digits) >= _DIGITS:
            # Files of other programs with such names stay.
            with open(path, "rb") as file:
                if file.read(len(_BEGIN)) == _BEGIN:
                    found.append(path)
    return found


def write_sequence(chosen: Exported, files: list[Path]) -> None:
    """Write a file for each frame."""
    writer = _PlyWriter(chosen)
    for moment, path in zip(chosen.moments(), files, strict=True):
        with open(path, "wb") as file:
            for part in writer.parts(moment):
                file.write(part)


class _PlyWriter:
    """A writer with the common data of all files."""

    def __init__(self, chosen: Exported) -> None:
        trajectory, self._chosen = chosen.trajectory, chosen
        scene, first = trajectory.scene, trajectory.frame(chosen.numbers[0])
        self._center = origin_of(scene, first)
        last = trajectory.frame(chosen.numbers[-1])
        self._scale, self._values = colours.by_speed(scene, trajectory.method, first, last)
        self._body = trajectory.body
        self._copies = chosen.ids % trajectory.copies if trajectory.copies else None

    def parts(self, moment: ExportedFrame) -> Iterator[bytes]:
        """The parts of the file of a frame."""
        columns, faces = self._columns(moment)
        bonds = self._chosen.bonds if not len(faces) else self._chosen.bonds[:0]
        named = _named(columns)
        rows = np.empty(len(columns["particle"]), [(name, f"<{kind}") for name, (kind, _) in named.items()])
        for name, (_kind, values) in named.items():
            rows[name] = values
        header = [
            f"{_BEGIN.decode()}, frame {moment.number}", "comment units m, s, kg", f"comment time {moment.time!r}",
            f"comment colour {self._scale.quantity} from {self._scale.low:g} to {self._scale.high:g}",
            *[f"comment center {' '.join(map(repr, self._center.tolist()))}"] * bool(self._center.any()),
            f"element vertex {len(rows)}",
            *(f"property {_KINDS[kind]} {name}" for name, (kind, _) in named.items()),
        ]  # fmt: skip
        if len(faces):
            header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
        if len(bonds):
            header += [f"element edge {len(bonds)}", "property int vertex1", "property int vertex2"]
        yield "\n".join([*header, "end_header\n"]).encode("ascii")
        yield rows.tobytes()
        if len(faces):
            triangles = np.empty(len(faces), _FACE)
            triangles["count"], triangles["corners"] = 3, faces
            yield triangles.tobytes()
        if len(bonds):
            edges = np.empty(len(bonds), _EDGE)
            edges["vertex1"], edges["vertex2"] = bonds.T
            yield edges.tobytes()

    def _columns(self, moment: ExportedFrame) -> tuple[dict[str, Any], NDArray[np.int64]]:
        """The columns of the vertices, and the triangles between them."""
        position, velocity, ids = (np.asarray(rows) for rows in (moment.position, moment.velocity, moment.ids))
        faces, held = np.zeros((0, 3), np.int64), dict[str, Any]()
        if self._body is not None and len(self._body.faces):
            contacts, copies = self._body.contacts, len(ids) // len(self._body)
            position, velocity = (_contacts(contacts, rows, copies) for rows in (position, velocity))
            bodies = self._copies[:copies]  # type: ignore[index]
            ids = (np.arange(len(contacts))[:, None] * self._chosen.trajectory.copies + bodies).ravel()
            faces = (self._body.faces[:, None, :] * copies + np.arange(copies)[:, None]).reshape(-1, 3)
            held["body"] = np.tile(bodies, len(contacts))
        else:
            held["mass"] = moment.mass
            held |= {} if self._copies is None else {"body": self._copies}
        packed = self._scale.colours(self._values(_rows(position), _rows(velocity)))
        columns = {
            "position": position - self._center, "velocity": velocity, "speed": np.sqrt((velocity**2).sum(axis=1)),
            "colour": np.stack([packed >> shift & 0xFF for shift in (24, 16, 8)], axis=1).astype(np.uint8),
            "particle": ids, **held,
        }  # fmt: skip
        if moment.radius is not None:
            columns["radius"] = moment.radius
        for name, what in (("escape_time", "escaped"), ("absorbed_time", "absorbed")):
            if name in moment.more:
                columns[what] = (~np.isnan(moment.more[name])).astype(np.uint8)
        return columns, faces


def _rows(values: Floats) -> Floats:
    return np.ascontiguousarray(values.T, np.float64)


def _contacts(contacts: Floats, rows: Floats, copies: int) -> Floats:
    """The contact points of bodies, from their points (P copies, 3): (K copies, 3)."""
    return np.asarray(np.einsum("kp,pcx->kcx", contacts, rows.reshape(-1, copies, 3)).reshape(-1, 3))


def _named(columns: dict[str, Any]) -> dict[str, tuple[str, Any]]:
    """The columns by property, each with the type of its numbers."""
    found: dict[str, tuple[str, Any]] = {}
    for name, values in columns.items():
        parts = {"position": ("x", "y", "z"), "velocity": ("vx", "vy", "vz"), "colour": ("red", "green", "blue")}
        kind = "u1" if values.dtype == np.uint8 else "i4" if values.dtype.kind in "iu" else "f4"
        for part, column in zip(parts.get(name, (name,)), np.atleast_2d(values.T), strict=True):
            found[part] = kind, column
    return found

"""Recordings (.rrd) are read back, and their completeness is checked."""

import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from ..errors import FileError, SceneError
from ..files import paths
from ..files.sources import DAMAGE, DamagedError, commands_for, reason, require_file
from ..state import Floats
from ..triangles.shape import Shape

_BEGIN = b"RRF"
_ABOUT = ("quantity", "low", "high", "particles", "shown", "stride")
# Recordings of older versions do not have these values.
_NOUN, _CENTER, _PLANE, _TITLE, _VERDICTS = "noun", "center", "plane", "title", "verdicts"
# The entities of particles, and of bodies, also used by the writer.
PARTICLES, LINES, MESH = "/scene/particles", "/scene/bodies/lines", "/scene/bodies/mesh"
_POSITIONS, _COLOURS, _SCALARS = "Points3D:positions", "Points3D:colors", "Scalars:scalars"
_RADII = "Points3D:radii"
_STRIPS, _TINTS, _CORNERS = "LineStrips3D:strips", "LineStrips3D:colors", "Mesh3D:vertex_positions"
_WAYS, _TURNS = "Transform3D:translation", "Transform3D:mat3x3"
_TRIANGLES, _PAINT, _NORMALS = "Mesh3D:triangle_indices", "Mesh3D:vertex_colors", "Mesh3D:vertex_normals"

Colours = NDArray[np.uint32]

# The entities of walls.
_SURFACES, _SOLIDS = "/scene/surfaces/", "/scene/solids/"


class Playback:
    """A recording of swarm, read completely.

    Attributes:
        numbers, times: the numbers of the frames, and their times [s].
        entities: path -> number of rows.
        series: path -> (times, values).
        names: path -> name in the legend.
        about: meaning of the colours: quantity, low, high; number of particles or bodies, of shown ones, stride of
            frames; "noun": "particles" or "bodies"; "title": the run in words, if it ended.
        verdicts: sentences on the quality of the run, "✓ walls: no particle ..."; None if the file has none.
        center: (3,) the origin of the positions in the file [m], already added to positions of this object.
        radius: radii of balls (n,) [m], None for points.

    Raises:
        SceneError: the file is missing, damaged or truncated, or not a recording of swarm.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        require_file(path, "a recording (.rrd)")
        try:
            self._read()
        except DAMAGE as error:
            with open(path, "rb") as file:
                foreign = not file.read(len(_BEGIN)).startswith(_BEGIN)
            if foreign:
                raise SceneError(f"{path} is not a recording of swarm{commands_for(path, '.rrd')}") from error
            problem = reason(error).replace(f"Failed to read RRD file at {path}: ", "")
            raise DamagedError(f"{path} is damaged: {problem}; swarm info --repair may repair it") from error

    def _read(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about a missing footer, which is_whole reports
            chunks = RrdReader(self.path).stream().to_chunks()
        self.entities: dict[str, int] = {}
        # The constant data, and the row of each frame, by entity and column.
        self._static: dict[tuple[str, str], Any] = {}
        self._rows: dict[tuple[str, str], dict[int, tuple[Any, int]]] = {}
        scalars: dict[str, dict[int, float]] = {}
        for chunk in chunks:
            entity = chunk.entity_path
            if entity.startswith("/__"):
                continue
            self.entities[entity] = self.entities.get(entity, 0) + chunk.num_rows
            batch = chunk.to_record_batch()
            columns = dict(zip(batch.schema.names, batch.columns, strict=True))
            if "frame" not in columns:
                # Rerun may store data that were logged at once as rows of one chunk.
                self._static |= {
                    (entity, name): [one for one in column if one.is_valid][-1]
                    for name, column in columns.items()
                    if column.null_count < len(column)
                }
                continue
            numbers = columns["frame"].to_pylist()
            if _SCALARS in columns:
                values = columns[_SCALARS].flatten().to_numpy(zero_copy_only=False)
                scalars.setdefault(entity, {}).update(zip(numbers, values, strict=True))
                continue
            for name, column in columns.items():
                self._rows.setdefault((entity, name), {}).update({k: (column, i) for i, k in enumerate(numbers)})
        drawn = self._rows.get((PARTICLES, _POSITIONS))
        if not drawn or "/time" not in scalars:
            raise ValueError("it is not a recording of swarm, or holds no frame")
        facts = {name: column for (entity, name), column in self._static.items() if entity == "/about"}
        for name in _ABOUT:
            if name not in facts:
                raise ValueError(f"it does not say its {name}")
        known = (*_ABOUT, _NOUN, _PLANE, _TITLE)
        self.about = {_NOUN: "particles", **{name: facts[name].as_py()[0] for name in known if name in facts}}
        self.verdicts: list[str] | None = facts[_VERDICTS].as_py() if _VERDICTS in facts else None
        self.center = np.array(facts[_CENTER].as_py()) if _CENTER in facts else np.zeros(3)
        moments = scalars.pop("/time")
        # A crash may have left more points than rows of the time series.
        self.numbers = sorted(number for number in drawn if number in moments)
        if not self.numbers:
            raise ValueError("it holds no frame with a known time")
        self.times = np.array([moments[number] for number in self.numbers])
        self.series = {
            entity: (np.array([moments[number] for number in found]), np.array(list(found.values())))
            for entity, found in scalars.items()
        }
        self.names: dict[str, str] = {
            entity: kept.as_py()[0] for (entity, name), kept in self._static.items() if name == "SeriesLines:names"
        }
        shown = [e for e, name in (*self._static, *self._rows) if name in (_STRIPS, _CORNERS)]
        walls = {e.rpartition("/")[0]: None for e in shown if e.startswith((_SURFACES, _SOLIDS))}
        self._walls = list(walls)
        changing = {e.rpartition("/")[0] for e, name in self._rows if name in (_STRIPS, _CORNERS)}
        self._still = {wall: self._shape(wall, None) for wall in walls if wall not in changing}
        sizes = self._static.get((PARTICLES, _RADII))
        wide = np.array([] if sizes is None else sizes.as_py(), np.float64)
        # Radii of dots are below 0: points of the screen.
        self.radius = wide if wide.size and (wide > 0.0).all() else None
        triangles = self._static.get((MESH, _TRIANGLES))
        self._triangles = np.array([] if triangles is None else triangles.as_py(), np.int64).reshape(-1, 3)

    def shapes_at(self, number: int) -> list[Shape]:
        """The walls at the frame of this number: they may move, appear and disappear."""
        found = []
        for wall in self._walls:
            shape = self._still.get(wall) or self._shape(wall, number)
            way, turn = (np.array(self._row(wall, name, number)) for name in (_WAYS, _TURNS))
            # Rerun keeps matrices column by column: this is the transpose.
            turned = turn.reshape(3, 3).T if turn.size else np.eye(3)
            found.append(shape.moved(turned, (way if turn.size else np.zeros(3)) + self.center))
        return found

    def _shape(self, wall: str, number: int | None) -> Shape:
        """A wall as the file has it, or, if it appears and disappears, at the frame of a number."""
        # Its curves are sent at each such change, its mesh where it has one.
        sent = self._rows.get((f"{wall}/levels", _STRIPS)) or self._rows.get((f"{wall}/wires", _STRIPS), {})
        latest = -1 if number is None else max((k for k in sent if k <= number), default=-1)

        def column(part: str, name: str) -> Any:
            if number is not None:
                return self._row(f"{wall}/{part}", name, latest) or []
            kept = self._static.get((f"{wall}/{part}", name))
            return [] if kept is None else kept.as_py() or []

        mesh = [np.reshape(column("mesh", name), (-1, 3)) for name in (_CORNERS, _TRIANGLES, _NORMALS)]
        edges, levels = ([np.array(strip) for strip in column(part, _STRIPS)] for part in ("wires", "levels"))
        name, solid = wall.rpartition("/")[2], wall.startswith(_SOLIDS)
        corners, triangles, normals = mesh
        return Shape(name, solid, corners.astype(float), triangles.astype(np.int64), normals.astype(float), edges,
                     levels=levels, many=not edges and not levels)  # fmt: skip

    def frame(self, number: int) -> tuple[Floats, Colours]:
        """Positions (n, 3) and colours (n,), 0xRRGGBBAA, of the frame of this number."""
        return self._points(PARTICLES, _POSITIONS, number), self._colours(PARTICLES, _COLOURS, number)

    def lines(self, number: int) -> tuple[Floats, Colours]:
        """Lines of bodies (S, 2, 3) and their colours (S,) at a frame; empty if bodies have faces."""
        colours = self._colours(LINES, _TINTS, number)
        return self._points(LINES, _STRIPS, number)[: 2 * len(colours)].reshape(-1, 2, 3), colours

    def faces(self, number: int) -> tuple[Floats, Colours]:
        """Triangles of bodies (T, 3, 3) and the colours of their corners (T, 3) at a frame."""
        corners, colours = self._points(MESH, _CORNERS, number), self._colours(MESH, _PAINT, number)
        return corners[self._triangles], colours[self._triangles]

    def _row(self, entity: str, name: str, number: int) -> Any:
        """The entry of a frame in a column, as nested lists; an empty list if the column has no entry."""
        column, row = self._rows.get((entity, name), {}).get(number, (None, 0))
        return [] if column is None else column[row].as_py()

    def _points(self, entity: str, name: str, number: int) -> Floats:
        """Positions (n, 3), relative to the origin of the scene."""
        return np.reshape(self._row(entity, name, number), (-1, 3)) + self.center

    def _colours(self, entity: str, name: str, number: int) -> Colours:
        return np.array(self._row(entity, name, number), np.uint32)


def is_whole(path: Path) -> bool:
    """Whether the file is complete and has the footer that every viewer needs."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            RrdReader(path).store()
    except (RuntimeError, ValueError, OSError):
        return False
    return True


def repaired(path: Path, target: Path) -> Playback:
    """Copy the readable part of a truncated recording to a complete one in another file.

    Raises:
        SceneError: no frame can be read, or it is not a recording of swarm.
        FileError: the other file cannot be written.
    """
    command = [sys.executable, "-m", "rerun", "rrd", "merge", "--continue-on-error", str(path), "-o", str(target)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode or not target.is_file():
        output = done.stderr.strip().splitlines() or ["rerun gave no reason"]
        raise FileError(f"cannot repair {path}: {output[-1]}")
    try:
        return Playback(target)
    except SceneError as error:
        raise SceneError(f"{path} is not a recording of swarm, or no frame of it can be read") from error


def repair(path: Path) -> Playback:
    """Repair a recording in place.

    Raises:
        SceneError, FileError: as for `repaired`; the file is unchanged.
    """
    require_file(path, "a recording (.rrd)")
    target = paths.part_of(path)
    try:
        repaired(path, target)
        os.replace(target, path)
    finally:
        target.unlink(missing_ok=True)
    return Playback(path)


def described(path: Path) -> tuple[Playback, bool]:
    """A recording, and whether it is complete; of an incomplete one the part that can be repaired."""
    require_file(path, "a recording (.rrd)")
    if is_whole(path):
        return Playback(path), True
    with tempfile.TemporaryDirectory() as folder:
        return repaired(path, Path(folder) / "repaired.rrd"), False

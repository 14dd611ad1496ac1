"""Recordings (.rrd) read back, and whether they are complete."""

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
from ..particles import Floats
from . import paths
from .sources import DAMAGE, DamagedError, reason, require_file

_BODIES = "/scene/bodies/"
_BEGIN = b"RRF"
_ABOUT = ("quantity", "low", "high", "particles", "shown", "stride")
# Recordings of older versions do not say it.
_NOUN, _CENTER = "noun", "center"
_POSITIONS, _COLOURS, _SCALARS = "Points3D:positions", "Points3D:colors", "Scalars:scalars"
_STRIPS, _TINTS, _CORNERS = "LineStrips3D:strips", "LineStrips3D:colors", "Mesh3D:vertex_positions"
_WAYS, _TURNS = "Transform3D:translation", "Transform3D:mat3x3"
_TRIANGLES, _PAINT = "Mesh3D:triangle_indices", "Mesh3D:vertex_colors"


class Playback:
    """A recording of swarm, read completely.

    Attributes:
        numbers, times: of the frames, times in [s].
        entities: path -> number of rows.
        series: path -> (times, values).
        names: path -> name in the legend.
        about: meaning of the colours: quantity, low, high; number of particles or bodies, how many are shown, stride of
            frames; "noun": "particles" or "bodies".
        center: (3,) the origin of the positions in the file [m], which those given here are not less.
        wires: of each surface, whether it is a solid and its curves, at the start.

    Raises:
        SceneError: there is no such file, it is damaged or truncated, or not a recording of swarm.
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
                raise SceneError(f"{path} is not a recording of swarm") from error
            problem = reason(error).replace(f"Failed to read RRD file at {path}: ", "")
            raise DamagedError(f"{path} is damaged: {problem}; swarm info --repair may repair it") from error

    def _read(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about a missing footer, which is_whole reports
            chunks = RrdReader(self.path).stream().to_chunks()
        self.entities: dict[str, int] = {}
        self.series: dict[str, tuple[Floats, Floats]] = {}
        self.names: dict[str, str] = {}
        self.wires: list[tuple[bool, list[Floats]]] = []
        self._walls: list[str] = []  # the entity of each
        self._poses: dict[str, dict[int, tuple[Floats, Floats]]] = {}
        self.about: dict[str, Any] = {_NOUN: "particles"}
        self.center = np.zeros(3)
        self._triangles = np.zeros((0, 3), np.int64)
        # Of each column, where the row of a frame is.
        self._rows: dict[str, dict[int, tuple[Any, int]]] = {name: {} for name in (_POSITIONS, _STRIPS, _CORNERS)}
        rows: dict[str, list[tuple[NDArray[np.int64], Floats]]] = {}
        for chunk in chunks:
            entity = chunk.entity_path
            if entity.startswith("/__"):
                continue
            self.entities[entity] = self.entities.get(entity, 0) + chunk.num_rows
            batch = chunk.to_record_batch()
            names = batch.schema.names
            for name in self._rows.keys() & names if "frame" in names else ():
                numbers = batch.column("frame").to_pylist()
                self._rows[name] |= {number: (batch, row) for row, number in enumerate(numbers)}
            if _SCALARS in names:
                values = batch.column(_SCALARS).flatten().to_numpy(zero_copy_only=False)
                rows.setdefault(entity, []).append((batch.column("frame").to_numpy(), values))
            if _TURNS in names and "frame" in names:
                ways, turns = (_numbers(batch, name) for name in (_WAYS, _TURNS))
                # Rerun keeps matrices column by column.
                both = zip(ways, turns.reshape(-1, 3, 3).transpose(0, 2, 1), strict=True)
                found = dict(zip(batch.column("frame").to_pylist(), both, strict=True))
                self._poses.setdefault(entity, {}).update(found)
            self._static(entity, batch, names)
        if not self._rows[_POSITIONS] or "/time" not in rows:
            raise ValueError("it is not a recording of swarm, or holds no frame")
        missing = [name for name in _ABOUT if name not in self.about]
        if missing:
            raise ValueError(f"it does not say its {missing[0]}")
        moments = {k: t for numbers, values in rows.pop("/time") for k, t in zip(numbers, values, strict=True)}
        # A crash may have left more points than rows of the time series.
        self.numbers = sorted(number for number in self._rows[_POSITIONS] if number in moments)
        if not self.numbers:
            raise ValueError("it holds no frame whose time is known")
        self.times = np.array([moments[number] for number in self.numbers])
        for entity, parts in rows.items():
            numbers, values = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
            self.series[entity] = np.array([moments[number] for number in numbers]), values

    def _static(self, entity: str, batch: Any, names: list[str]) -> None:
        if "SeriesLines:names" in names:
            self.names[entity] = batch.column("SeriesLines:names")[0].as_py()[0]
        if entity == "/about" and _CENTER in names:
            self.center = np.array(batch.column(_CENTER)[0].as_py())
        if entity == "/about":
            self.about |= {name: batch.column(name)[0].as_py()[0] for name in names if name in (*_ABOUT, _NOUN)}
        if _TRIANGLES in names and entity.startswith(_BODIES):
            self._triangles = batch.column(_TRIANGLES)[0].values.flatten().to_numpy().reshape(-1, 3)
        if _STRIPS in names and not entity.startswith(_BODIES):
            strips = batch.column(_STRIPS)[0].as_py()
            self.wires.append((entity.startswith("/scene/solids/"), [np.array(strip) for strip in strips]))
            self._walls.append(entity.rpartition("/")[0])

    def wires_at(self, number: int) -> list[tuple[bool, list[Floats]]]:
        """The curves of each surface at the frame of this number: surfaces may move."""
        found = []
        for (solid, curves), entity in zip(self.wires, self._walls, strict=True):
            pose = self._poses.get(entity, {}).get(number)
            moved = curves if pose is None else [curve @ pose[1].T + pose[0] for curve in curves]
            found.append((solid, [curve + self.center for curve in moved]))
        return found

    def frame(self, number: int) -> tuple[Floats, NDArray[np.uint32]]:
        """Positions (n, 3) and colours (n,), 0xRRGGBBAA, of the frame of this number."""
        batch, row = self._rows[_POSITIONS][number]
        return self._points(batch, _POSITIONS, row), _colours(batch, _COLOURS, row)

    def lines(self, number: int) -> tuple[Floats, NDArray[np.uint32]]:
        """Lines of bodies (S, 2, 3) and their colours (S,) at a frame; none where bodies have faces."""
        batch, row = self._rows[_STRIPS].get(number, (None, 0))
        if batch is None or _TINTS not in batch.schema.names:
            return np.zeros((0, 2, 3)), np.zeros(0, np.uint32)
        ends = batch.column(_STRIPS)[row].values.flatten().flatten().to_numpy(zero_copy_only=False)
        return ends.reshape(-1, 2, 3) + self.center, _colours(batch, _TINTS, row)

    def faces(self, number: int) -> tuple[Floats, NDArray[np.uint32]]:
        """Triangles of bodies (T, 3, 3) and the colours of their corners (T, 3) at a frame."""
        batch, row = self._rows[_CORNERS].get(number, (None, 0))
        if batch is None:
            return np.zeros((0, 3, 3)), np.zeros((0, 3), np.uint32)
        return self._points(batch, _CORNERS, row)[self._triangles], _colours(batch, _PAINT, row)[self._triangles]

    def _points(self, batch: Any, name: str, row: int) -> Floats:
        """Positions (n, 3), with the origin of the file."""
        kept = batch.column(name)[row].values.flatten().to_numpy(zero_copy_only=False).reshape(-1, 3)
        return np.asarray(kept + self.center)


def _numbers(batch: Any, name: str) -> Floats:
    """A column of vectors or matrices, one row a frame."""
    rows = batch.column(name)
    return np.array([np.ravel(row.as_py()[0]) for row in rows])


def _colours(batch: Any, name: str, row: int) -> NDArray[np.uint32]:
    return np.asarray(batch.column(name)[row].values.to_numpy(zero_copy_only=False))


def is_whole(path: Path) -> bool:
    """Whether the file is complete: with the footer that every viewer needs."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            RrdReader(path).store()
    except (RuntimeError, ValueError, OSError):
        return False
    return True


def repaired(path: Path, target: Path) -> Playback:
    """Copy what can be read of a truncated recording to a complete one in another file.

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
        SceneError, FileError: as `repaired`; the file is unchanged.
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
    """A recording, and whether it is complete; if it is not, what could be repaired of it."""
    require_file(path, "a recording (.rrd)")
    if is_whole(path):
        return Playback(path), True
    with tempfile.TemporaryDirectory() as folder:
        return repaired(path, Path(folder) / "repaired.rrd"), False

"""Recordings for Rerun (https://rerun.io), written during a run or from its trajectory.

/scene/particles              Points3D, a frame's; coloured; of bodies, their points; of particles also their mass and
                              number, static. A velocity would double the file
/scene/bodies/lines, .../mesh LineStrips3D and Mesh3D of bodies, a frame's; the points of each triangle are static
/scene/surfaces/0_KIND/       mesh: Mesh3D, wires (edges) and levels: LineStrips3D; static; /scene/solids/... likewise;
                              of a moving wall also Transform3D, a frame's, relative to the start; in a scene with
                              doors not static, but from each frame on in which the walls change
                              fields of more than 2000 solids have bodies: Points3D with radii, Boxes3D, ... for mesh
/energy/..., /energy_error, /penetration, /impacts, /pressure/0_KIND (or /force/...), /sliding, /heat/0_KIND   Scalars
/overlap                      Scalars: of soft balls
/time                         Scalars: the exact time [s], since `sim_time` counts nanoseconds
/about                        meaning of the colours, as text and as values, the origin, and of a run that has ended
                              `title` and `verdicts`, the run in words and its quality; static

Rerun's positions are float32. In a scene far from the origin they are relative to its centre, `center` of /about.
"""

import atexit
import bisect
import ctypes
import math
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from ..bodies.body import Body
from ..common import checks
from ..common.catalog import COLOURINGS
from ..errors import FileError, SceneError
from ..files import marks
from ..files.origin import origin_of
from ..files.replaced import no_room
from ..files.writer import WriteFrames, Written, rows
from ..methods import Method
from ..particles import Particles
from ..pictures import colours, series
from ..pictures.drawn import Drawn
from ..scene import Scene
from ..triangles import solids
from ..triangles.shapes import shapes_of, since_start
from ..words.content import Content
from . import instanced, looks, viewer
from .playback import LINES, MESH, PARTICLES, is_whole

# Bytes of a particle (position and colour), of a line (ends, offset, colour), and at most of a number of a
# time series, which may be a chunk of its own.
_PARTICLE_BYTES, _LINE_BYTES, _NUMBER_BYTES = 16, 32, 2000
# Bytes of the static data of a particle: its mass and its number.
_FIXED_BYTES = 16
_MEGABYTE = 1e6
# Rows of the time series that are sent together, unless they take longer than this [s].
_ROWS, _PATIENCE = 50, 0.5
# The longest flush [s]: usually milliseconds, but it may never return if the file cannot be written.
_LONGEST = 10.0
# Bytes of a blueprint and of the static data besides surfaces, rounded up.
_BEGINNING = 1 << 18
# Rerun counts nanoseconds in 64 bits, 292 years; the exact time is in /time.
_LATEST = 9.2e9


@dataclass(frozen=True)
class Settings:
    """The choices of a recording.

    Args:
        particles: the largest number of recorded particles, or points of whole bodies, evenly chosen.
        color: "speed" or "energy-error".
        megabytes: the largest size; if all frames exceed it, every k-th and the last are recorded.
        live: True to show it in a viewer on this machine during the run, or the URL of a viewer.
    """

    particles: int = 5000
    color: str = "speed"
    megabytes: float = 100.0
    live: bool | str = False

    def __post_init__(self) -> None:
        checks.count("record_particles", self.particles)
        checks.one_of("record_color", self.color, COLOURINGS)
        checks.positive("record_megabytes", self.megabytes)


class RecordingWriter:
    """A context that creates the recording and returns the function that appends frames.

    `start` holds particles, or the points of copies of `body`; `frames` is the number of frames of the run. Without a
    path and a viewer the recording stays in memory, in `stream`.
    """

    def __init__(
        self,
        path: Path | None,
        overwrite: bool,
        scene: Scene,
        method: Method,
        start: Particles,
        frames: int,
        settings: Settings,
        body: Body | None = None,
    ) -> None:
        if path is not None:
            marks.check_target(path, overwrite, "recording")
            # Tested first: a sink of Rerun that fails prints lines of its own.
            if not os.access(path if path.exists() else path.parent, os.W_OK):
                raise FileError(f"cannot write the recording {path}: no permission")
        self._path, self._scene, self._method, self._settings = path, scene, method, settings
        self._last, self._body, self._start, self.count = frames - 1, body, start, len(start)
        # A trajectory may keep only a part of the particles.
        self.numbers: Any = np.arange(len(start))
        self._fed = start.births is not None or bool(np.isnan(start.position).any())
        self._drawn = drawn = Drawn(len(start), body, settings.particles, start.radius)
        some = {"collisions": start.radius is not None, "rotational_energy": start.spin is not None}
        some["largest_overlap"] = start.radius is not None and method.law() is not None
        self._more = [name for name, there in {"source_energy": self._fed, **some}.items() if there]
        self._at_start, self._center = drawn.points(start.position), origin_of(scene, start)
        if body is not None and settings.color != "speed":
            raise SceneError(
                f"record_color must be 'speed' for bodies, got {settings.color!r}: their points exchange energy"
            )
        self.colour_by(start)
        # The number, the time and the observables of frames with time series to be sent, and of the frame before.
        self._rows: list[tuple[int, float, dict[str, Any]]] = []
        self._before: list[tuple[int, float, dict[str, Any]]] = []
        self._due = 0.0
        # The observables of all recorded frames, for the words about the run.
        self._seen: list[dict[str, Any]] = []
        # Where walls appear and disappear, they are sent at each instant; this is the number of the last one.
        self._has_doors, self._instant = scene.has_doors() and not scene.moves(), -1
        # The number of particles that have come by the last frame, if they come during the run and all are recorded.
        self._came: int | None = None
        self._failed = False
        # The file that is written: another name until it is complete, if it is made from a trajectory.
        self.file = path
        self._url = viewer.live_url(settings.live) if settings.live else None

    def colour_by(self, shown: Particles) -> None:
        """Set the scale of colours from these particles, or bodies."""
        points = self._drawn.points
        if self._body is None:
            position = points(shown.position)
            mass, there = points(shown.mass[None])[0], ~np.isnan(position[0])
            shown = Particles.of_frame(position, points(shown.velocity), mass, None, there)
        color, scene, method = self._settings.color, self._scene, self._method
        self._scale, self._values = colours.colouring(color, scene, method, shown)

    def __enter__(self) -> WriteFrames:
        self._shapes = shapes_of(self._scene, self._at_start, most=solids.MANY)
        self._series = series.lines_of(self._scene, self._method, self._shapes, self._body, self._more)
        fixed = sum(24 * len(s.vertices) + 12 * len(s.triangles) + 12 * sum(map(len, s.wires)) for s in self._shapes)
        many = solids.solids_of(self._scene, 0.0)
        fixed += sum(map(instanced.bytes_of, many))
        lines, triangles = len(self._drawn.lines), len(self._drawn.triangles)
        points = self._at_start.shape[1] * (2 if triangles else 1)
        frame = _PARTICLE_BYTES * points + _LINE_BYTES * lines + _NUMBER_BYTES * (4 + len(self._series))
        fixed += 12 * triangles + _FIXED_BYTES * points
        room = max(self._settings.megabytes * _MEGABYTE - fixed, frame)
        self._stride = math.ceil((self._last + 1) * frame / room)
        is_new = self.file is not None and not self.file.exists()
        # Rerun never returns from a file without room for its blueprint.
        if problem := no_room(self.file, _BEGINNING + fixed):
            if is_new and self.file is not None:
                self.file.unlink(missing_ok=True)
            raise FileError(f"cannot write the recording {self._path}: {problem}")
        self.stream = rr.RecordingStream("swarm")
        sinks: list[Any] = [rr.GrpcSink(self._url)] if self._url else []
        try:
            sinks += [rr.FileSink(self.file)] if self.file else []
            plane = self._scene.plane
            eye = looks.eye_controls(plane, self._shapes, self._at_start.T, self._center)
            blueprint = looks.blueprint(self._series, self._drawn.noun, eye, plane)
            if sinks:
                self.stream.set_sinks(*sinks, default_blueprint=blueprint)
            else:
                self.stream.send_blueprint(blueprint)
            self.stream.flush(timeout_sec=_LONGEST)
            self._log_static(many)
            # Only a flush notices a full disk, and a later `send` may never return.
            self.stream.flush(timeout_sec=_LONGEST)
        except (RuntimeError, ValueError) as error:
            raise self._error(f"cannot write the recording {self._path}", error) from error
        return self._write

    def _log_static(self, many: list[solids.Solids]) -> None:
        """Log the static data."""
        self.stream.set_log_time_enabled(False)
        looks.log_static(self.stream, self._drawn, [] if self._has_doors else self._shapes, self._center)
        if self._body is None:
            mass, number = (self._drawn.points(row[None])[0] for row in (self._start.mass, self.numbers))
            fixed = rr.DynamicArchetype("Particles", components={"mass": mass, "number": number})
            self.stream.log(PARTICLES, fixed, static=True)
        if not self._has_doors:
            self._log_solids(many, static=True)
        looks.log_series(self.stream, self._series)
        looks.log_about(self.stream, self._drawn, self._scale, self._stride, self._center, self._scene.plane)

    def _error(self, what: str, error: Exception) -> FileError:
        """Return the error of a recording that ends here."""
        self._failed = True
        # Closing the stream, or Rerun at the exit of the process, would wait forever for its dead thread.
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self.stream))
        atexit.unregister(rr.rerun_shutdown)
        return FileError(f"{what}: {no_room(self.file) or error}")

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if self._failed:
            return  # another flush never returns
        try:
            self._send_rows()
            if error is None and self._seen:
                self._log_outcome()
            self.stream.flush(timeout_sec=_LONGEST)
            if self._url or self._path:
                self.stream.disconnect()
            # Rerun reports no error if it could not write the end.
            if self.file is not None and not is_whole(self.file):
                raise RuntimeError("its end could not be written")
        except (RuntimeError, ValueError) as problem:
            if error is None:
                raise self._error(f"cannot close the recording {self._path}", problem) from problem

    def _write(self, frames: list[Written]) -> None:
        chosen = [frame for frame in frames if frame[0] % self._stride == 0 or frame[0] == self._last]
        if not chosen:
            return
        numbers, times = [frame[0] for frame in chosen], [frame[1] for frame in chosen]
        shown, colour, lines = [], [], []
        for number, moment, state, seen in chosen:
            position, packed, tints = self._drawn.coloured(state, self._scale, self._values)
            shown.append(position - self._center[:, None])
            colour.append(packed)
            lines.append(tints)
            self._rows.append((number, moment, seen))
            self._seen.append({**seen, "time": moment})
        if self._fed and len(chosen[-1][2].position[0]) == self.count:
            self._came = int(np.count_nonzero(~np.isnan(chosen[-1][2].position[0])))
        points = rows(shown, np.float32)
        try:
            self._send_points(numbers, times, points, np.array(colour), np.array(lines))
            if self._has_doors:
                self._send_doors(numbers, times)
            if self._scene.moves():
                walls = [(seen["wall_position"], seen["wall_orientation"]) for *_, seen in chosen]
                self._send_walls(numbers, times, walls)
            self._send("/time", numbers, times, rr.Scalars.columns(scalars=times))
            # A dozen series cost as much as the points of a few frames: rows are collected for a short time.
            if len(self._rows) >= _ROWS or time.monotonic() > self._due:
                self._send_rows()
            # Without a flush a full disk is not noticed, and the next `send` to the thread that it ended never returns.
            self.stream.flush(timeout_sec=_LONGEST)
        except (RuntimeError, ValueError) as error:
            raise self._error(f"cannot write frame {numbers[0]} to the recording {self._path}", error) from error

    def _log_outcome(self) -> None:
        """Log the run in the words above and below its plots."""
        seen = {name: np.array([row[name] for row in self._seen]) for name in self._seen[0]}
        known, count = {"start": self._start}, self.count if self._came is None else self._came
        looks.log_outcome(self.stream, Content("", self._scene, self._method, self._body, count, seen, known))

    def _send_points(self, numbers: Any, times: Any, points: Any, colour: Any, lines: Any) -> None:
        """Send points (frames, n, 3) with their colours, and their lines and faces."""
        drawn, (frames, n, _three) = self._drawn, points.shape
        columns = rr.Points3D.columns(positions=points.reshape(-1, 3), colors=colour.ravel())
        self._send(PARTICLES, numbers, times, columns.partition([n] * frames))
        if len(drawn.lines):
            strips = points[:, drawn.lines].reshape(-1, 2, 3)
            tinted = {"colors": lines.ravel()} if lines.size else {}
            columns = rr.LineStrips3D.columns(strips=strips, **tinted)
            self._send(LINES, numbers, times, columns.partition([len(drawn.lines)] * frames))
        if len(drawn.triangles):
            columns = rr.Mesh3D.columns(vertex_positions=points.reshape(-1, 3), vertex_colors=colour.ravel())
            self._send(MESH, numbers, times, columns.partition([n] * frames))

    def _send_doors(self, numbers: list[int], times: list[float]) -> None:
        """Send the present walls if they have changed."""
        for number, moment in zip(numbers, times, strict=True):
            instant = bisect.bisect_right(self._scene.instants, moment)
            if instant != self._instant:
                self._instant = instant
                self.stream.set_time("frame", sequence=number)
                self.stream.set_time("sim_time", duration=min(moment, _LATEST))
                shapes = shapes_of(self._scene, self._at_start, moment, most=solids.MANY)
                looks.log_walls(self.stream, shapes, self._center, static=False)
                self._log_solids(solids.solids_of(self._scene, moment), static=False)
                self.stream.reset_time()

    def _log_solids(self, many: list[solids.Solids], static: bool) -> None:
        """Log the fields of many solids, statically or from the current time of the stream on."""
        for shape in self._shapes:
            for one in (one for one in many if one.surface == shape.surface):
                instanced.log(self.stream, looks.path_of(shape), one, self._center, looks.SOLID_LOOKS, static)

    def _send_walls(self, numbers: Any, times: Any, walls: list[tuple[Any, Any]]) -> None:
        """Send the places of moving surfaces, (position, orientation) a frame, relative to their first drawing."""
        for shape in self._shapes:
            surface = self._scene.surfaces[shape.surface]
            if shape.motion is not None or surface.motion is not None or surface.reacts():
                moves = [
                    since_start(self._scene, shape, moment, places) for moment, places in zip(times, walls, strict=True)
                ]
                turns, ways = (np.array(parts) for parts in zip(*moves, strict=True))
                # Relative to the centre: x1 - c = A (x0 - c) + (b + A c - c)
                ways = ways + (turns @ self._center - self._center)
                columns = rr.Transform3D.columns(translation=ways, mat3x3=turns)
                self._send(looks.path_of(shape), numbers, times, columns)

    def sync(self) -> None:
        """Do nothing: no checkpoint refers to a recording."""

    def _send_rows(self) -> None:
        """Send the time series of the frames since the last call."""
        known = self._before + self._rows
        if self._rows:
            numbers, times = (np.array([row[part] for row in known]) for part in (0, 1))
            seen = {name: np.array([row[2][name] for row in known]) for name in known[0][2]}
            for line in self._series:
                values = line.values(times, seen)
                new = ~np.isnan(values)
                new[: len(self._before)] = False
                if new.any():
                    self._send(line.path, numbers[new], times[new], rr.Scalars.columns(scalars=values[new]))
        self._before, self._rows = known[-1:], []
        self._due = time.monotonic() + _PATIENCE

    def _send(self, path: str, numbers: Any, times: Any, columns: Any) -> None:
        indexes = [
            rr.TimeColumn("frame", sequence=numbers),
            rr.TimeColumn("sim_time", duration=np.clip(times, -_LATEST, _LATEST)),
        ]
        self.stream.send_columns(path, indexes, columns)

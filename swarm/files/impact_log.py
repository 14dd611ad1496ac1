"""Logs of impacts, read on demand. impacts.py describes the file and writes it."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..common import checks, notebook
from ..common.columns import flattened
from ..common.extras import needed_by
from ..errors import SceneError
from . import layout
from .checksums import checksum_of
from .stored import Stored, finite, in_order, parsed, whole

if TYPE_CHECKING:
    import pandas

_VECTORS = ("position", "velocity_before", "velocity_after")
_LASTED = ("duration", "largest_force", "friction_loss")
_TEXTS = ("scene", "method", "kept", "start")
_NEEDED = (
    "impacts/time", "frames/complete", "frames/time", "frames/rows", "walls/surface", "walls/member",
    "parameters/scene",
)  # fmt: skip
# Rows that are read at once, so that rows that are not wanted take no memory.
_AT_ONCE = 1 << 20


class ImpactLog(Stored):
    """A log of impacts on disk, read on demand.

    Attributes:
        times: (frames,) the times of the complete frames [s].
        ends: (frames,) the number of impacts until the end of each.
        scene, method: those of the run.
        count: number of particles of the run.

    The impacts are those of complete frames. A log that is being written, or that a killed run left, can be read, with
    the frames that are complete when it is opened. Inconsistent content raises a SceneError that names the part.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, "a log of impacts (.h5)", "swarm.load_impacts")
        try:
            with self._reading("its structure") as file:
                foreign = missing(file)
                if foreign is None:
                    self._check(file)
            if foreign is not None:
                raise SceneError(f"{self.path} is an HDF5 file, but not a log of impacts of swarm: it has no {foreign}")
        except SceneError:
            self.close()
            raise

    def _check(self, file: Any) -> None:
        """Read the data that say which rows exist; raise a ValueError about an inconsistent part."""
        for name in _TEXTS:
            if h5py.check_string_dtype(layout.dataset(file, f"parameters/{name}").dtype) is None:
                raise ValueError(f"parameters/{name} must be a text")
        frames, *known = layout.dataset(file, "frames/complete", "iu", (None,))[()].tolist()
        if frames < 0:
            raise ValueError(f"frames/complete must be 0 or more, got {frames}")
        # Files of older versions have no checksum of the number.
        if known and known[0] != checksum_of(np.int64(frames)):
            raise ValueError(f"frames/complete does not match its checksum, got {frames}")
        layout.require_fits(layout.dataset(file, "frames/time", "f", (frames,)), frames, self.path)
        self.times = in_order(self._checked.rows("frames/time", 0, frames))
        layout.dataset(file, "frames/rows", "iu", (frames,))
        self.ends = np.array(self._checked.rows("frames/rows", 0, frames), np.int64)
        if (np.diff(self.ends, prepend=0) < 0).any():
            raise ValueError(f"frame {int((np.diff(self.ends, prepend=0) < 0).argmax())} has fewer impacts than none")
        self._rows = int(self.ends[-1]) if frames else 0
        self._columns: dict[str, Any] = {}
        for name in file["impacts"]:
            shape = (self._rows, 3) if name in (*_VECTORS, "slip", "image") else (self._rows,)
            kinds = "iu" if name in ("particle", "wall", "image", "partner") else "f"
            self._columns[name] = layout.dataset(file, f"impacts/{name}", kinds, shape)
            layout.require_fits(self._columns[name], self._rows, self.path)
        for name in ("time", "particle", "wall", *_VECTORS, "impulse"):
            if name not in self._columns:
                raise ValueError(f"it has no impacts/{name}")
        layout.dataset(file, "walls/member", "iu", layout.dataset(file, "walls/surface", "iu", (None,)).shape)
        walls = (self._checked.constant(f"walls/{name}").astype(np.int32) for name in ("surface", "member"))
        self._surface, self._member = walls
        # The number of counters; their rows have walls below 0.
        self._counters = len(self.counters)

    def __len__(self) -> int:
        """Number of impacts of complete frames."""
        return self._rows

    def __repr__(self) -> str:
        return f"ImpactLog({str(self.path)!r}, {len(self)} impacts)"

    def _repr_html_(self) -> str:
        rows = {"impacts": f"{len(self)}", "frames": f"{len(self.times)}", "walls": f"{len(self._surface)}"}
        rows |= {"time": f"{self.times[0]:g} s to {self.times[-1]:g} s"} if len(self.times) else {}
        return notebook.table(f"ImpactLog {self.path.name}", rows.items())

    @property
    def kept(self) -> int | list[int]:
        """The particles with impacts that are kept: k for every k-th one, or a list of their numbers."""
        with self._reading("which particles it keeps"):
            kept = parsed(self._text("kept"))["particles"]
            if kept == "all":
                return 1
            return int(kept) if isinstance(kept, int) else sorted({whole("particle", i) for i in kept})

    def counts(self) -> NDArray[np.int64]:
        """Number of impacts on each surface, without collisions; a passage through an opening counts as one."""
        return self._counted()[0]

    def crossings(self) -> NDArray[np.int64]:
        """Number of rows of each counter, (counters, 2): out of its admissible side, and back."""
        return self._counted()[1]

    def _counted(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        self._require_sums(0, self._rows)
        counts, crossings = np.zeros(self._surfaces(), np.int64), np.zeros(2 * self._counters, np.int64)
        for k in range(0, self._rows, _AT_ONCE):
            with self._reading(f"its rows from {k} on"):
                rows = slice(k, min(k + _AT_ONCE, self._rows))
                walls = self._columns["wall"][rows]
                counts += np.bincount(self._surface[walls[walls >= 0]], minlength=len(counts))
                if self._counters:
                    crosses = (walls < 0) & ~self._is_collision(rows)
                    crossings += np.bincount(-1 - walls[crosses], minlength=len(crossings))
        return counts, crossings.reshape(-1, 2)

    @property
    def identity(self) -> dict[str, Any]:
        """The values that identify the run."""
        texts = {name: self._text(name) for name in ("scene", "method", "kept")}
        identity = {"particles": self.count, "start": self.start, "seed": self.seed}
        return {**texts, **identity, "counters": self.counters_text}

    def require_holds(self, frames: int, rows: int, sums: str, checkpoint: Path) -> None:
        """Raise a SceneError if there are fewer frames, or other rows, than `checkpoint` says.

        Args:
            frames: the number of complete frames.
            rows: the number of rows of these frames and of the frame after them.
            sums: the checksums of the rows after these frames, by column, as text; "": they are not known.
            checkpoint: the file with these numbers, for the sentence.
        """
        with self._reading("its rows") as file:
            layout.require_index(file)
            there = min(column.shape[0] for column in self._columns.values())
        if len(self.times) < frames or there < rows:
            raise SceneError(
                f"{self.path} must hold {frames} frames and {rows} impacts, as {checkpoint} says, got "
                f"{len(self.times)} and {there}: it was changed since; remove them and the trajectory to start again"
            )
        for name, known in json.loads(sums or "{}").items():
            with self._reading(f"impacts/{name} after frame {frames - 1}"):
                found = 0
                for begin in range(int(self.ends[frames - 1]), rows, _AT_ONCE):
                    found = checksum_of(self._columns[name][begin : min(begin + _AT_ONCE, rows)], found)
                if found != known:
                    raise ValueError(f"expected the checksum that {checkpoint} has")

    @property
    def dtype(self) -> np.dtype[Any]:
        """The dtype of the rows of `table`."""
        real = self._columns["position"].dtype
        fields: list[Any] = [("time", "f8"), ("particle", "i4"), ("surface", "i4"), ("member", "i4")]
        fields += [*((name, real, 3) for name in _VECTORS), ("impulse", real)]
        fields += [field for field in (("slip", real, 3), ("image", "i4", 3)) if field[0] in self._columns]
        fields += [("partner", "i4")] * ("partner" in self._columns)
        fields += [(name, real) for name in _LASTED if name in self._columns]
        fields += [("counter", "i4"), ("sense", "i4")] * (self._counters > 0)
        return np.dtype(fields)

    def table(
        self,
        particles: int | Sequence[int] | None = None,
        surfaces: int | Sequence[int] | None = None,
        begin: float | None = None,
        end: float | None = None,
    ) -> NDArray[Any]:
        """The impacts as a structured array, in the order of time, and of particles at the same time.

        The order and every bit are the same for any number of threads. Rows that are left out take no memory; only the
        frames between `begin` and `end` are read from the file.

        Args:
            particles: only rows of this particle, or of these; None: all.
            surfaces: only rows of this surface of the scene, or of these; None: all, and crossings of counters.
            begin: only rows from this time on [s]; None: from the start.
            end: only rows before this time [s]; None: to the last frame.

        Returns:
            One row an impact: `time` [s], `particle`, `surface` (index in `scene.surfaces`), `member` (the number of
            the body in a surface of several bodies, of the triangle in a mesh, of the part of a union among
            `scene.parts`; else -1), `position` (3,) [m] of the particle at the impact,
            `velocity_before` and `velocity_after` (3,) [m/s], `impulse` [N s], given along the wall's normal. Where a
            surface has friction also `slip` (3,) [m/s], the tangential velocity relative to the wall before the impact.
            In a periodic scene the position is in the cell and `image` (3,) says how many cells away that cell is.

            A particle that passes an opening of a surface has its last row there, with an impulse of 0.

            For bodies `particle` is the number of the copy, and an impact of several contact points has a row for each:
            position, velocities and impulse are those of the contact point. Impacts in cavities carried by a point of
            the body, and passages through openings, have no rows. A crossing is that of the centre of mass.

            For particles with a radius a collision of two is a row too, under the smaller of their numbers: `partner`
            is the number of the other one, -1 at a wall, `impulse` acts on each along the line of their centres, and
            both `surface` and `member` are -1.

            A contact of two grains, or of a grain with a wall, lasts, and has its row where it ends, as laws of walls
            act there: `time` is the end of the step, `velocity_before` the velocity at the start of the contact,
            `impulse` the sum of its normal impulses, and further columns are `duration` [s], `largest_force` [N] along
            the normal and `friction_loss` [J], the energy that friction and rolling resistance have taken. For a mesh
            or an outline `member` is the face at the end. A contact has no row if it lasts at the end of the run, or
            if the wall goes, by an opening or because it is no longer `present`.

            A contact of a point with a soft wall has its row at its end too, with the whole impulse of that wall. If
            laws do not end it, because the wall goes or another wall absorbs the point, both velocities are the same.
            The observable "impacts" counts a contact at its start: it is the number of rows and of contacts that last.

            In a run with counters a crossing is a row too, with an impulse of 0 and the velocity at the crossing twice:
            `counter` is the index of the counter in `counters` and `sense` 0 out of its admissible side, 1 back, and
            both `surface` and `member` are -1. Rows of impacts have -1 for `counter` and `sense`.

            A contact step begins at the impact, and `velocity_after` is the velocity at its end. After the last impact
            of a series `velocity_after` is the velocity along the wall. A particle that slides, rests or is pressed
            into an edge by several walls has no impacts: its impulse is in the observable alone.

        Raises:
            SceneError: an argument is out of its range, or the file is damaged.
        """
        low = -np.inf if begin is None else checks.number("begin", begin)
        high = np.inf if end is None else checks.number("end", end)
        if low > high:
            raise SceneError(f"end must be begin or later, got {high:g} before {low:g}")
        wanted = (
            _among("particles", particles, self.count), _among("surfaces", surfaces, self._surfaces()),
            surfaces is None,
        )  # fmt: skip
        # The rows of the frames that overlap this span of time.
        begins = np.append(0, self.ends)
        first = int(begins[np.searchsorted(self.times, low)])
        last = int(begins[min(int(np.searchsorted(self.times, high)) + 1, len(self.ends))])
        self._require_sums(first, last)
        parts = [
            self._part(slice(k, min(k + _AT_ONCE, last)), wanted, (low, high)) for k in range(first, last, _AT_ONCE)
        ]
        table = np.concatenate([np.empty(0, self.dtype), *parts])
        return table[np.lexsort((table["particle"], table["time"]))]

    def frame(self, **chosen: Any) -> "pandas.DataFrame":
        """The rows of `table` as a pandas frame, with columns x, y, z for components; arguments as for `table`."""
        with needed_by("a frame of impacts", "table"):
            import pandas
        table = self.table(**chosen)
        return pandas.DataFrame(flattened({name: table[name] for name in self.dtype.names or ()}))

    def require_intact(self) -> None:
        """Raise a SceneError that names the part that does not match its checksum."""
        with self._reading("its values"):
            self._checked.require_constants()
        self._require_sums(0, self._rows)

    def _require_sums(self, first: int, last: int) -> None:
        """Raise a SceneError if rows of complete frames do not match their checksums."""
        begins = np.append(0, self.ends)
        if not self._checked.has_any():
            return
        for k in range(int(np.searchsorted(begins, first, side="right")) - 1, len(self.ends)):
            if begins[k] >= last:
                return
            with self._reading(f"its rows {begins[k]} to {begins[k + 1] - 1}"):
                for name, column in self._columns.items():
                    self._checked.compare_rows(f"impacts/{name}", column, k, (int(begins[k]), int(begins[k + 1])))

    def _is_collision(self, rows: slice) -> Any:
        """Whether rows are collisions of two particles: these have the wall -1, like crossings of the first counter."""
        return self._columns["partner"][rows] >= 0 if "partner" in self._columns else np.False_

    def _surfaces(self) -> int:
        return int(self._surface.max()) + 1 if len(self._surface) else 0

    def _part(self, rows: slice, wanted: tuple[Any, Any, bool], span: tuple[float, float]) -> NDArray[Any]:
        """Return the wanted rows among `rows`."""
        with self._reading(f"its rows from {rows.start} on"):
            time = finite(self._columns["time"][rows], "row")
            particle, wall = self._columns["particle"][rows], self._columns["wall"][rows]
            lowest = min(-2 * self._counters, -1 if "partner" in self._columns else 0)
            if len(wall) and not (wall.min() >= lowest and wall.max() < len(self._surface)):
                raise ValueError(
                    f"expected walls from {lowest} to {len(self._surface) - 1}, got {wall.min()} to {wall.max()}"
                )
            if len(particle) and not (particle.min() >= 0 and particle.max() < self.count):
                raise ValueError(f"expected particles below {self.count}, got {particle.min()} to {particle.max()}")
            (particles, surfaces, crossings), (begin, end) = wanted, span
            is_impact = wall >= 0
            surface = _of_walls(self._surface, wall, -1)
            taken = (time >= begin) & (time < end) & particles[particle]
            taken &= _of_walls(surfaces[self._surface], wall, crossings)
            k = np.flatnonzero(taken)
            table = np.empty(len(k), self.dtype)
            table["time"], table["particle"], table["surface"] = time[k], particle[k], surface[k]
            table["member"] = _of_walls(self._member, wall[k], -1)
            if self._counters:
                is_event = (is_impact | self._is_collision(rows))[k]
                table["counter"] = np.where(is_event, -1, (-1 - wall[k]) // 2)
                table["sense"] = np.where(is_event, -1, (-1 - wall[k]) % 2)
            if len(k):
                within = slice(rows.start + int(k[0]), rows.start + int(k[-1]) + 1)
                for name in (name for name in table.dtype.names[4:] if name in self._columns):
                    table[name] = finite(self._columns[name][within], "row")[k - k[0]]
        return table


def missing(file: Any) -> str | None:
    """The first part of a log of impacts that this file lacks, or None."""
    return next((name for name in _NEEDED if name not in file), None)


def _of_walls(values: NDArray[Any], wall: NDArray[np.integer], other: Any) -> NDArray[Any]:
    """The value of the wall of each row; `other` where the wall is below 0: a scene without a surface has no wall."""
    return np.append(values, other)[np.where(wall >= 0, wall, -1)]


def _among(name: str, numbers: Any, n: int) -> NDArray[np.bool_]:
    """A mask of the n numbers that are wanted."""
    if numbers is None:
        return np.ones(n, np.bool_)
    listed = numbers if isinstance(numbers, (Sequence, np.ndarray)) else [numbers]
    found = np.zeros(n, np.bool_)
    for given in listed:
        i = whole(name, given)
        if not 0 <= i < n:
            allowed = f"numbers from 0 to {n - 1}" if n else "left out of a scene without any"
            raise SceneError(f"{name} must be {allowed}, got {i}")
        found[i] = True
    return found


def load_impacts(path: str | Path) -> ImpactLog:
    """Open a log of impacts for reading; see `ImpactLog`.

    Args:
        path: the file, HDF5.

    Returns:
        The `ImpactLog`, which a `with` statement closes.

    Raises:
        SceneError: the file does not exist, or it is not a log of impacts.

    >>> import swarm, tempfile
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     start = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    ...     run = swarm.simulate(cavity, start, swarm.Impact(), until=2.0, impacts=folder + "/impacts.h5")
    ...     with swarm.load_impacts(folder + "/impacts.h5") as log:
    ...         log.table()["time"]
    array([0.5, 1.5])
    """
    return ImpactLog(path)

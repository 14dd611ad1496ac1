"""The exported part of a trajectory: a selection of its frames, and of its particles or bodies."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from ..common import checks
from ..errors import SceneError
from ..files.stored import whole

# A function of the number of written frames and of the number of all frames to write.
Progress = Callable[[int, int], None]


class ExportedFrame(NamedTuple):
    """A frame; rows are particles, as in files."""

    number: int
    time: float  # [s]
    position: NDArray[Any]  # (n, 3) [m]
    velocity: NDArray[Any]  # (n, 3) [m/s]
    # Further columns by their names, (n,) or (n, 3): "impacts"; if the file has them "image", "escape_time",
    # "absorbed_time"; for balls "collisions" and "spin".
    more: dict[str, NDArray[Any]]
    ids: NDArray[np.int64]  # (n,) numbers of the particles
    mass: NDArray[np.float64]  # (n,) [kg]
    radius: NDArray[np.float64] | None  # (n,) of balls [m]


class Exported:
    """The chosen frames and particles of a trajectory.

    Attributes:
        trajectory: the trajectory that is exported.
        numbers, times: the numbers of the frames, and their times [s].
        ids: (n,) numbers of the particles; mass: (n,) [kg]; radius: (n,) for balls [m], else None.
        bonds: (B, 2) pairs of tied rows, for bodies.
        periods: the lengths of the cell, 0 in directions without a period.
    """

    def __init__(self, trajectory: Any, frames: slice | int | None, particles: int, progress: Progress | None) -> None:
        """Choose frames by a slice or one number, and every k-th particle or body by `particles` = k.

        Raises:
            SceneError: a frame does not exist, or the file keeps no particles.
        """
        self.trajectory, self._progress = trajectory, progress
        trajectory.require_frames()
        self.numbers = numbers_of(frames, len(trajectory))
        self.times = trajectory.times[list(self.numbers)]
        checks.count("particles", particles)
        ids, size = trajectory.ids, trajectory.copies
        # Point p of body i is particle p n + i: a body is exported whole, or not.
        some = np.arange(len(ids)) % particles == 0 if not size else ids % size % particles == 0
        self._rows: Any = slice(None) if some.all() else np.flatnonzero(some)
        self.ids = ids[self._rows]
        self.mass = trajectory.frame(self.numbers[0]).mass[self._rows]
        radius = trajectory.radius
        self.radius = None if radius is None else radius[self._rows]
        self.bonds = _among(self.ids, trajectory.bonds)
        self.periods = np.array([length or 0.0 for length in trajectory.scene.period or (None,) * 3])

    def __len__(self) -> int:
        """Number of particles of the largest frame."""
        return len(self.ids)

    @property
    def counts(self) -> list[int]:
        """The number of particles of each frame; particles that come during the run are the last, in this order."""
        if not self.trajectory.has_births():
            return [len(self)] * len(self.numbers)
        return [int(self.trajectory.born(k)[self._rows].sum()) for k in self.numbers]

    def moments(self) -> Iterator[ExportedFrame]:
        """Yield the frames one after the other; each is written when the next is requested.

        Particles that are not yet born in a run with sources are left out.
        """
        for done, (number, time) in enumerate(zip(self.numbers, self.times.tolist(), strict=True)):
            held = {name: column[self._rows] for name, column in self.trajectory.columns(number).items()}
            there = ~np.isnan(held["position"][:, 0])
            if not there.all():
                held = {name: column[there] for name, column in held.items()}
            position, velocity = held.pop("position"), held.pop("velocity")
            radius = None if self.radius is None else self.radius[there]
            yield ExportedFrame(number, time, position, velocity, held, self.ids[there], self.mass[there], radius)
            if self._progress is not None:
                self._progress(done + 1, len(self.numbers))


def lines_of(columns: Iterable[NDArray[Any]], begin: bytes, between: bytes, missing: bytes = b"") -> bytes:
    """Columns (n,) or (n, 3) as text, a line a row; numbers have enough digits for the same bits.

    A writer of JSON is three times as fast as formatting by Python: [[1.5,2],[...]]. It writes null for a NaN.
    """
    numbers = [part for column in columns for part in np.atleast_2d(column.T).tolist()]
    rows = msgspec.json.encode(list(zip(*numbers, strict=True)))[2:-2].replace(b"null", missing)
    rows = (rows if between == b"," else rows.replace(b",", between)).replace(b"]" + between + b"[", b"\n" + begin)
    return begin + rows + b"\n" if rows else b""


def numbers_of(frames: slice | int | None, n: int) -> range:
    """The numbers of the chosen frames among n."""
    if frames is None:
        return range(n)
    if isinstance(frames, slice):
        try:
            found = range(n)[frames]
        except (TypeError, ValueError) as error:
            raise SceneError(
                f"frames must be a slice of whole numbers with a step other than 0, got {frames}"
            ) from error
        if not found:
            ends = (frames.start, frames.stop) if frames.step is None else (frames.start, frames.stop, frames.step)
            written = ":".join("" if end is None else str(end) for end in ends)
            raise SceneError(f"frames must hold one of the frames 0 to {n - 1}, got {written}")
        return found if found.step > 0 else found[::-1]
    k = whole("frames", frames)
    if not -n <= k < n:
        raise SceneError(f"frames must lie between {-n} and {n - 1}, got {k}")
    return range(k % n, k % n + 1)


def _among(ids: NDArray[np.int64], bonds: NDArray[np.int64]) -> NDArray[np.int64]:
    """The pairs of particles of which both are exported, as rows."""
    rows = np.searchsorted(ids, bonds).clip(max=len(ids) - 1)
    return np.asarray(rows[(ids[rows] == bonds).all(axis=1)])

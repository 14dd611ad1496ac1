"""The frames of a run: their times, their size, and the record of each for progress displays and functions."""

import copy
import logging
import math
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from . import checks
from .snapshot import NOTHING, Snapshot
from .validated import Positive, Validated

_LOG = logging.getLogger("swarm")
# A frame nearer to `until` than this fraction of `every` is the last one.
_SAME_TIME = 1e-9
# More frames than any run has, but finite.
_MOST = 1e300
# Bytes of a frame's observables: as numbers in a file, as Python objects in memory, and for each surface in addition.
_NUMBERS, _OBJECTS, _SURFACE = 200, 3000, 16
# Further bytes in a file: its groups and the heads of its datasets, and the checksums of a frame.
_GROUPS, _CHECKSUMS = 55_000, 112
# The frames for which a dataset of observables makes room at a time.
ROWS = 1024


@dataclass(frozen=True, eq=False)
class Frame:
    """A finished frame: the argument of `progress` and of functions in `observables`, and an entry of `Result.frames`.

    The arrays of particles are read-only copies, made when they are first read. `progress` and functions
    of `observables` read them during their call. For bodies the particles are all points, for a trajectory those
    that it keeps.

    Attributes:
        number: the number of the frame, from 0 on.
        time: its time [s].
        until: the end of the run [s].
        observables: name -> value in this frame; not available in a function of `observables`.
        written: number of frames in the trajectory.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> def mean_radius(frame):
    ...     return (frame.position**2).sum(axis=0).mean() ** 0.5
    >>> start = swarm.fill(cavity, 1000, speed=1.0, seed=1)
    >>> run = swarm.simulate(cavity, start, swarm.Impact(), until=1.0, observables={"mean_radius": mean_radius})
    >>> run.observables["mean_radius"].round(2)
    array([0.38, 0.39])
    """

    number: int
    time: float
    until: float
    observables: dict[str, Any]
    written: int = 0
    arrays: Snapshot = field(default=NOTHING, repr=False)

    @property
    def position(self) -> NDArray[np.float64]:
        """(3, N) [m]; in a periodic scene, in the cell."""
        return np.asarray(self._read("position"))

    @property
    def velocity(self) -> NDArray[np.float64]:
        """(3, N) [m/s]."""
        return np.asarray(self._read("velocity"))

    @property
    def mass(self) -> NDArray[np.float64]:
        """(N,) [kg]."""
        return np.asarray(self._read("mass"))

    @property
    def energy(self) -> NDArray[np.float64]:
        """(N,) sum of the kinetic energy and the energy in gravity [J]."""
        return np.asarray(self._read("energy"))

    @property
    def impacts(self) -> NDArray[np.int64]:
        """(N,) number of impacts of each since 0 s."""
        return np.asarray(self._read("impacts"))

    @property
    def escape_time(self) -> NDArray[np.float64]:
        """(N,) time at which each has passed an opening of a wall [s]; NaN for those inside."""
        return np.asarray(self._read("escape_time"))

    @property
    def absorbed_time(self) -> NDArray[np.float64]:
        """(N,) time at which a law of a wall has absorbed each [s]; NaN for the others."""
        return np.asarray(self._read("absorbed_time"))

    @property
    def image(self) -> NDArray[np.int64] | None:
        """(3, N) displacement of each from its place in the cell, in whole cells; None if not periodic."""
        found: NDArray[np.int64] | None = self._read("image")
        return found

    @property
    def radius(self) -> NDArray[np.float64] | None:
        """(N,) of balls [m], else None."""
        found: NDArray[np.float64] | None = self._read("radius")
        return found

    @property
    def spin(self) -> NDArray[np.float64] | None:
        """(3, N) of balls that turn [rad/s], else None."""
        found: NDArray[np.float64] | None = self._read("spin")
        return found

    @property
    def collisions(self) -> NDArray[np.int64] | None:
        """(N,) number of collisions of each ball with others since 0 s; None for points."""
        found: NDArray[np.int64] | None = self._read("collisions")
        return found

    def _read(self, name: str) -> Any:
        return self.arrays.read(name, f"frame {self.number}")

    def apart(self) -> "Frame":
        """Return a copy with its own observables, which the receiver may change."""
        return replace(self, observables=copy.deepcopy(self.observables))


@dataclass(frozen=True)
class FrameTimes(Validated):
    """0, every, 2 every, ..., until: an iterator over (number, last time, time) [s].

    Args:
        until: the end, above 0.
        every: time between frames, at most `until`; None: only the first and the last.

    Raises:
        SceneError: an argument is out of its range.

    >>> [time for _number, _before, time in FrameTimes(1.0, 0.4)]
    [0.0, 0.4, 0.8, 1.0]
    """

    until: Positive
    every: Positive | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.every is None:
            checks.assign(self, every=self.until)
        elif self.every > self.until:
            raise SceneError(f"every must be at most until = {self.until:g}, got {self.every:g}")

    @property
    def count(self) -> int:
        """The number of frames; it may exceed the largest `len`."""
        assert self.every is not None
        return 1 + max(1, math.ceil(min(self.until / self.every, _MOST) - _SAME_TIME))

    def __iter__(self) -> Iterator[tuple[int, float, float]]:
        assert self.every is not None
        before = 0.0
        for number in range(self.count - 1):
            yield number, before, number * self.every
            before = number * self.every
        yield self.count - 1, before, self.until

    def on_disk(self, surfaces: int) -> int:
        """Return the bytes of a file without its particles: groups and the observables of all frames."""
        rows = -(-self.count // ROWS) * ROWS
        return _GROUPS + _CHECKSUMS * self.count + rows * (_NUMBERS + _SURFACE * surfaces)

    def in_memory(self, surfaces: int) -> int:
        """Return the bytes of the observables of all frames in memory."""
        return self.count * (_OBJECTS + _SURFACE * surfaces)

    def require_room(
        self, first: int, target: Path | None, numbers: int, surfaces: int, packed: bool, more: int = 0
    ) -> None:
        """Raise a SceneError if the frames from `first` on do not fit on the disk or, without a file, in memory.

        Args:
            first: number of the first frame that is kept.
            target: the trajectory, or None.
            numbers: bytes of the particles in a frame.
            surfaces: the number of surfaces.
            packed: whether particles are compressed, so that their size is unknown; observables never are.
            more: bytes of further observables of a frame, which not every run has.
        """
        frames = self.count - first
        if target is None:
            size = least = frames * (_OBJECTS + _SURFACE * surfaces + more)
            room, where, mend = checks.memory(), "this machine's memory", "make every longer"
        else:
            least = frames * (_NUMBERS + _SURFACE * surfaces + more)
            size = least + frames * numbers
            least = least if packed else size
            there = target.stat().st_size if target.exists() else 0
            room, where = shutil.disk_usage(target.parent).free + there, f"what is free in {target.parent.resolve()}"
            mend = "make every longer, or make room there"
        needed = f"{frames} frames, {'at most ' * packed}{checks.in_bytes(size)}"
        if least > room:
            raise SceneError(
                f"every must leave frames that fit, got {self.every:g} s until {self.until:g} s: {needed}, and {where} "
                f"is {checks.in_bytes(room)}; {mend}"
            )
        _LOG.info("the run has %s", needed)

"""The frames of a run: their times, their size, and the record of each for progress displays."""

import copy
import logging
import math
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from . import checks
from .errors import SceneError

_LOG = logging.getLogger("swarm")
# A frame nearer to `until` than this fraction of `every` is the last one.
_SAME_TIME = 1e-9
# More frames than any run has, but finite.
_MOST = 1e300
# Bytes of a frame's observables: numbers in a file, Python objects in memory; and what each surface adds.
_NUMBERS, _OBJECTS, _SURFACE = 200, 3000, 16


@dataclass(frozen=True)
class Frame:
    """A finished frame, for progress displays."""

    number: int
    time: float
    until: float
    observables: dict[str, Any]
    written: int = 0  # number of frames in the trajectory

    def apart(self) -> "Frame":
        """A copy with its own observables, which the receiver may change."""
        return replace(self, observables=copy.deepcopy(self.observables))


@dataclass(frozen=True)
class FrameTimes:
    """0, every, 2 every, ..., until: an iterator over number, the time before, and the time [s].

    Args:
        until: the end, above 0.
        every: time between frames, at most `until`; None: only the first and the last.

    Raises:
        SceneError: an argument is out of its range.

    >>> [time for _number, _before, time in FrameTimes(1.0, 0.4)]
    [0.0, 0.4, 0.8, 1.0]
    """

    until: float
    every: float | None = None

    def __post_init__(self) -> None:
        end = checks.number("until", self.until)
        if end <= 0.0:
            raise SceneError(f"until must be after the start, 0 s, got {end:g}")
        gap = end if self.every is None else checks.positive("every", self.every)
        if gap > end:
            raise SceneError(f"every must be at most until = {end:g}, got {gap:g}")
        checks.assign(self, until=end, every=gap)

    @property
    def count(self) -> int:
        """Number of frames; it may be more than `len` can return."""
        assert self.every is not None
        return 1 + max(1, math.ceil(min(self.until / self.every, _MOST) - _SAME_TIME))

    def __iter__(self) -> Iterator[tuple[int, float, float]]:
        assert self.every is not None
        before = 0.0
        for number in range(self.count - 1):
            yield number, before, number * self.every
            before = number * self.every
        yield self.count - 1, before, self.until

    def require_room(self, first: int, target: Path | None, numbers: int, surfaces: int, packed: bool) -> None:
        """Raise a SceneError if the frames from `first` on do not fit on the disk or, without a file, in memory.

        Args:
            first: number of the first frame that is kept.
            target: the trajectory, or None.
            numbers: bytes of the particles in a frame.
            surfaces: their number.
            packed: whether these are compressed, so that their size is unknown; observables never are.
        """
        frames = self.count - first
        if target is None:
            size = least = frames * (_OBJECTS + _SURFACE * surfaces)
            room, where = checks.memory(), "this machine's memory"
        else:
            least = frames * (_NUMBERS + _SURFACE * surfaces)
            size = least + frames * numbers
            least = least if packed else size
            there = target.stat().st_size if target.exists() else 0
            room, where = shutil.disk_usage(target.parent).free + there, f"what is free in {target.parent.resolve()}"
        needed = f"{frames} frames, {'at most ' * packed}{checks.in_bytes(size)}"
        if least > room:
            raise SceneError(
                f"every must leave frames that fit, got {self.every:g} s until {self.until:g} s: {needed}, and {where} "
                f"is {checks.in_bytes(room)}; make every longer"
            )
        _LOG.info("the run has %s", needed)

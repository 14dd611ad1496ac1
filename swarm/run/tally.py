"""What each member of each surface has had of a run, counted by each thread by itself: impacts, times of contact."""

import math
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..lanes.counts import PARTS, Counts, Sums
from ..surfaces.counter import Counter
from .impacts import Impacts
from .options import Task

Wholes = NDArray[np.int64]
# The units of a time in that of the whole run, a power of two: what is added is rounded to 2^-52 of that.
_UNITS = 4096.0


class Tally:
    """The counts of the threads of a run, and of the sessions before; sums of whole numbers, so exact in any order.

    Args:
        owners: of each wall of the kernels its surface, and its number in the field or of the part, or -1: (2, walls).
        unit: of times [s], a power of two; None where none are counted.
    """

    def __init__(self, owners: Wholes, unit: float | None = None) -> None:
        self._places, self._members = _places_of(owners)
        self._walls, self._unit = owners.shape[1], unit
        self._counts: dict[int, Counts] = {}

    def size(self) -> int:
        """Bytes of the observables of a frame."""
        return 8 * self._members * (1 if self._unit is None else 2)

    def counts(self) -> Counts:
        """The counts of the thread that calls."""
        return self.of_thread(threading.get_ident())

    def of_thread(self, number: int) -> Counts:
        """The counts of a thread."""
        return self._counts.setdefault(number, self._none())

    def _none(self) -> Counts:
        whole = np.zeros((3, self._walls), np.int64)
        return Counts(whole[0], None if self._unit is None else Sums(whole[1], whole[2], self._unit))

    def rest(self, walls: Wholes, time: float) -> None:
        """Count a time that each of some particles rests on a wall [s]."""
        stays = self.counts().stays
        if stays is None or not walls.size:
            return
        one = Sums(np.zeros(1, np.int64), np.zeros(1, np.int64), stays.unit)
        one.add(0, time)
        numbers, several = np.unique(np.maximum(walls, 0), return_counts=True)
        for sums, term in ((stays.whole, one.whole), (stays.rest, one.rest)):
            sums[numbers] += term[0] * several
        _carry(stays.whole, stays.rest)

    # --- Sums of all threads -----------------------------------------------------------------------------

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What `restore` takes."""
        every = list(self._counts.values())
        empty = self._none()
        found = {"member_impacts": sum((one.impacts for one in every), empty.impacts)}
        if empty.stays is not None:
            both = [np.array((one.stays.whole, one.stays.rest)) for one in [*every, empty] if one.stays is not None]
            found["member_stays"], found["member_unit"] = np.sum(both, axis=0), np.array([self._unit])
        return found

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Go on from the arrays of a checkpoint."""
        if self._unit is not None:
            # A run that goes on may have got another end.
            self._unit = float(arrays["member_unit"][0])
        self._counts = {}
        mine = self.counts()
        mine.impacts[:] = arrays["member_impacts"]
        if mine.stays is not None:
            mine.stays.whole[:], mine.stays.rest[:] = arrays["member_stays"]
            _carry(mine.stays.whole, mine.stays.rest)

    def seen(self, is_shard: bool = False) -> dict[str, NDArray[Any]]:
        """The observables: of all members, surface by surface; of a shard whole numbers for those that are none."""
        arrays = self.arrays()
        found: dict[str, NDArray[Any]] = {"member_impacts": self._of_members(arrays["member_impacts"])}
        if self._unit is not None:
            parts = np.array([self._of_members(row) for row in arrays["member_stays"]])
            found["member_residence"] = parts if is_shard else value_of(parts, self._unit)
        return found

    def _of_members(self, of_walls: Wholes) -> Wholes:
        """Of each member; of all its walls and images together where it is one body."""
        total = np.zeros(self._members, np.int64)
        np.add.at(total, self._places, of_walls)
        return total


class Watched(NamedTuple):
    """The records of impacts: their log and their tally, None where there is none; and the counters."""

    log: Impacts | None = None
    tally: Tally | None = None
    counters: tuple[Counter, ...] = ()


def tally_of(task: Task) -> Tally | None:
    """The tally of a run, if it has one."""
    return Tally(task.scene.members(), unit_of(task)) if task.options.member_impacts else None


def unit_of(task: Task) -> float | None:
    """The unit of the times of a tally [s], or None where no contact lasts."""
    lasts = task.bodies is None and not task.scene.reacts() and task.method.may_slide()
    return 2.0 ** math.floor(math.log2(task.options.until)) / _UNITS if lasts else None


def value_of(parts: Wholes, unit: float | None) -> NDArray[np.float64]:
    """The sums that whole numbers (2, members) stand for."""
    assert unit is not None
    whole, rest = parts.copy()
    _carry(whole, rest)
    return np.asarray(unit * (whole + rest / PARTS))


def _places_of(owners: Wholes) -> tuple[Wholes, int]:
    """Of each wall the place of its member among all, surface by surface; and how many there are."""
    surface, member = owners[0], np.maximum(owners[1], 0)
    counts = np.zeros(int(surface.max()) + 1, np.int64)
    np.maximum.at(counts, surface, member + 1)
    return (np.cumsum(counts) - counts)[surface] + member, int(counts.sum())


def _carry(whole: Wholes, rest: Wholes) -> None:
    """Carry what is a unit or more."""
    more = rest // int(PARTS)
    whole += more
    rest -= more * int(PARTS)

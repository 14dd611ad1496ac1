"""Counts for each member of each surface, kept by each thread: impacts, times of contact, heat."""

import math
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..lanes.watching.counts import PARTS, Counts, Sums
from ..surfaces.counter import Counter
from .impacts import Impacts
from .options import Task

Wholes = NDArray[np.int64]
# The unit of a sum is a large value of the run over this number; each term is rounded to 2^-52 of this unit.
_UNITS = 4096.0


class Units(NamedTuple):
    """The units of the sums, powers of two; None for a sum that is not kept."""

    stays: float | None = None  # [s]
    heats: float | None = None  # [J]


# The observable of each sum.
OBSERVED = {"stays": "member_residence", "heats": "member_heat"}


class Tally:
    """The counts of the threads of a run, and of earlier sessions: sums of whole numbers, exact in any order.

    Args:
        owners: (2, walls): the surface of each wall, and its number in a field or of a part, or -1.
        units: the units of the sums.
    """

    def __init__(self, owners: Wholes, units: Units = Units()) -> None:  # noqa: B008  it cannot be changed
        self._places, self._members = _places_of(owners)
        self._walls, self._units = owners.shape[1], units
        self._counts: dict[int, Counts] = {}

    def size(self) -> int:
        """Return the size of the observables of a frame [bytes]."""
        return 8 * self._members * (2 + len(self._summed()))

    def counts(self) -> Counts:
        """Return the counts of the calling thread."""
        return self.of_thread(threading.get_ident())

    def of_thread(self, number: int) -> Counts:
        """Return the counts of a thread."""
        return self._counts.setdefault(number, self._none())

    def _summed(self) -> dict[str, float]:
        """Return name -> unit of the sums that are kept."""
        return {name: unit for name, unit in self._units._asdict().items() if unit is not None}

    def _none(self) -> Counts:
        sums = {name: Sums(*np.zeros((2, self._walls), np.int64), unit) for name, unit in self._summed().items()}
        return Counts(np.zeros(self._walls, np.int64), **sums)

    def rest(self, walls: Wholes, time: float) -> None:
        """Count a time [s] for which a particle rests on each of these walls."""
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
        """Return the arrays of a checkpoint, which `restore` takes."""
        every = [*self._counts.values(), self._none()]
        found = {"member_impacts": np.sum([one.impacts for one in every], axis=0)}
        for name, unit in self._summed().items():
            parts = [(sums.whole, sums.rest) for sums in (getattr(one, name) for one in every)]
            found[f"member_{name}"], found[f"member_{name}_unit"] = np.sum(parts, axis=0), np.array([unit])
        return found

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Set the counts to the arrays of a checkpoint."""
        self._units = Units(**{name: float(arrays[f"member_{name}_unit"][0]) for name in self._summed()})
        self._counts = {}
        mine = self.counts()
        mine.impacts[:] = arrays["member_impacts"]
        for name in self._summed():
            sums = getattr(mine, name)
            sums.whole[:], sums.rest[:] = arrays[f"member_{name}"]
            _carry(sums.whole, sums.rest)

    def seen(self, absorbed: NDArray[np.int32] | None = None, is_shard: bool = False) -> dict[str, NDArray[Any]]:
        """Return the observables of all members, surface by surface; in a shard sums are pairs of whole numbers.

        `absorbed` has the wall that has absorbed each particle, or -1.
        """
        arrays = self.arrays()
        found: dict[str, NDArray[Any]] = {"member_impacts": self._of_members(arrays["member_impacts"])}
        for name, unit in self._summed().items():
            parts = np.array([self._of_members(row) for row in arrays[f"member_{name}"]])
            found[OBSERVED[name]] = parts if is_shard else value_of(parts, unit)
        if absorbed is not None:
            on = absorbed[absorbed >= 0]
            found["member_absorbed"] = np.bincount(self._places[on], minlength=self._members)
        return found

    def _of_members(self, of_walls: Wholes) -> Wholes:
        """Return the counts of members, each summed over its walls and images."""
        total = np.zeros(self._members, np.int64)
        np.add.at(total, self._places, of_walls)
        return total


class Watched(NamedTuple):
    """The log of impacts and their tally, each None if not kept, and the counters."""

    log: Impacts | None = None
    tally: Tally | None = None
    counters: tuple[Counter, ...] = ()


UNWATCHED = Watched()


def tally_of(task: Task) -> Tally | None:
    """Return the tally of a run, or None."""
    return Tally(task.compiled.numbering.members, units_of(task)) if task.options.member_impacts else None


def units_of(task: Task) -> Units:
    """Return the units of the sums of a run."""
    laws, (time, heat) = task.compiled.laws, task.scales or scales_of(task)
    are_alone = task.bodies is None and not task.scene.reacts()
    return Units(
        time if are_alone and task.method.may_slide() else None,
        heat if are_alone and laws is not None and laws.give_heat else None,
    )


def scales_of(task: Task) -> tuple[float, float]:
    """Return the units of times and of heat of a run, which depend on its start and its hottest wall, not on its end.

    A large time is that in which a particle crosses the scene, and a large heat the energy of a particle.
    """
    v, mass, gravity = task.particles.velocity, task.particles.mass, task.scene.gravity or (0.0, 0.0, 0.0)
    size = task.scene.finite_size()
    mean = float((0.5 * mass * (v * v).sum(axis=0)).mean())
    fall = float(mass.mean()) * math.hypot(*gravity) * size
    hot = [
        float(value)
        for piece in task.scene.pieces.each
        for one in (piece, *piece.laws)
        if (value := getattr(one, "temperature", None)) is not None
    ]
    energy = max(mean, fall, *hot, 0.0) or 1.0
    return _power_of_two(size * math.sqrt(0.5 * float(mass.mean()) / energy)), _power_of_two(energy)


def _power_of_two(large: float) -> float:
    return float(2.0 ** math.floor(math.log2(large)) / _UNITS)


def value_of(parts: Wholes, unit: float | None) -> NDArray[np.float64]:
    """Return the sums [s or J] from their pairs of whole numbers (2, members)."""
    assert unit is not None
    whole, rest = parts.copy()
    _carry(whole, rest)
    return np.asarray(unit * (whole + rest / PARTS))


def _places_of(owners: Wholes) -> tuple[Wholes, int]:
    """Return for each wall the place of its member among all members, surface by surface, and the number of members."""
    surface, member = owners[0], np.maximum(owners[1], 0)
    counts = np.zeros(int(surface.max()) + 1, np.int64)
    np.maximum.at(counts, surface, member + 1)
    return (np.cumsum(counts) - counts)[surface] + member, int(counts.sum())


def _carry(whole: Wholes, rest: Wholes) -> None:
    """Carry whole units from `rest` to `whole`, in place."""
    more = rest // int(PARTS)
    whole += more
    rest -= more * int(PARTS)

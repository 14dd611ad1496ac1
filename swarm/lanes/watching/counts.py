"""Counts of impacts and contacts at walls that one thread has computed, and sums that are as exact as counts.

A run without counts has None in their place, and compiles none of this code.
"""

import math
from typing import Any

import numpy as np

from ...kernel.arrays import index
from ...kernel.jit import Array
from ...kernel.record import Record
from .log import BeforeContact

# Units of `Sums.rest` in one of `Sums.whole`.
PARTS = 2.0**40


class Sums(Record):
    """A sum for each wall in whole numbers, which has the same bits in any order; each term is rounded once.

    In floats the bits would depend on the threads of the particles, and a sum for each particle and wall would not fit
    in memory.
    """

    whole: Array  # (walls,) int64, in units
    rest: Array  # (walls,) int64, in parts of a unit, from 0 to 1
    unit: float  # a power of two: numbers divided by it keep their digits

    def add(self, wall, value):
        """Add a value to the sum of a wall."""
        k, scaled = index(int(wall)), value / self.unit
        whole = np.int64(math.floor(scaled))
        rest = self.rest[k] + np.int64((scaled - whole) * PARTS + 0.5)
        carry = np.int64(rest >= np.int64(PARTS))
        self.whole[k] += whole + carry
        self.rest[k] = rest - carry * np.int64(PARTS)


class Counts(Record):
    """For each wall of the scene the impacts that one thread has computed, and sums; None for a sum without terms."""

    impacts: Array  # (walls,) int64
    stays: Any = None  # `Sums` of the times for which particles were held there [s]
    heats: Any = None  # `Sums` of the heat that the wall gave [J]

    def keep_before(self, lanes, live):
        """Keep the state of every lane that shows whether its contact is an impact."""
        for i in range(index(live)):
            before = BeforeContact(lanes.before, i)
            before.hits, before.wall = lanes.lane(i).hits, lanes.wall[i]

    def note(self, lanes, i, impulse):
        """Do nothing: impulses are not counted."""

    def add_rows(self, method, walls, state, lanes, live):
        """Count the impacts of a pass."""
        for i in range(index(live)):
            before = BeforeContact(lanes.before, i)
            # A lane without an impact may be at no wall.
            self.impacts[index(int(max(before.wall, 0.0)))] += np.int64(lanes.lane(i).hits - before.hits)

    def add(self, wall, hits):
        """Count `hits` impacts on a wall."""
        self.impacts[index(int(wall))] += np.int64(hits)

    def hit(self, image, struck):
        """Count an impact on a wall."""
        self.add(max(struck.wall, 0.0), (struck.wall >= 0.0) & (struck.impulse > 0.0))

    def stay(self, wall, time):
        """Count a time for which a wall has held a particle [s]."""
        if self.stays is not None:
            self.stays.add(wall, time)

    def give(self, wall, heat, wait):
        """Count the heat that a wall has given [J], and the time for which a particle is to wait there [s]."""
        if self.heats is not None:
            self.heats.add(wall, heat)
        if self.stays is not None and (wait > 0.0) & (wait < math.inf):
            self.stays.add(wall, wait)

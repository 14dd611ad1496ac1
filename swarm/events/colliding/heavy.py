"""Walls with a mass among balls: the balls near them, and their next hits on undisturbed walls.

A ball far from these walls is looked at again after a time in which it surely meets none of them, whatever impacts do
to the walls within their leases. The next hit of a near ball is valid until a wall is struck. All balls are looked at
again when a lease ends.
"""

import math
from typing import Any

from ...kernel.arrays import index
from ...kernel.jit import Array, select
from ...kernel.record import Record
from ...kernel.vector import ZERO
from ..reacting.freedoms import ParticleFlight
from ..reacting.strikes import first_hit, reach_of_all
from .clock import LENGTH, moment_of
from .rows import DUE, FLOATS, LEAVES
from .window import UNKNOWN

# Entries of the counts: the balls listed, the strikes of the walls so far, and the events before the leases.
LISTED, STRIKES, SINCE, COUNTS = 0, 1, 2, 3


class Heavy(Record):
    """The walls with a mass; their numbers follow the numbers of all other walls."""

    walls: Any  # each `Reacting`
    ways: Any  # the `Freedom` of each surface with a mass
    freedoms: Any  # `Freedoms`, with times of the epoch
    clock: Array
    counts: Array  # (3,)
    near: Array  # (N,) bool, whether the next hit of a ball is valid only until a wall is struck
    listed: Array  # (N,) bool, whether the ball is in `close`
    close: Array  # (N,) int64, the balls that are near, and some that were

    def grown(self, radius):
        """The walls that the centre of a ball meets."""
        return tuple(wall.grown(radius) for wall in self.walls)

    def soon(self, now):
        """The mean time from one strike to the next.

        A ball that may meet a wall sooner is looked at again after the next strike.
        """
        return moment_of(self.clock, now) / (1.0 + self.counts[STRIKES])


def first_number(box):
    """The number of the first wall with a mass."""
    return box.walls.total()


def meet_heavy(box, flock, i, now, hit):
    """Find when a ball meets any wall, from its `Hit` on the walls without a mass."""
    heavy, row = box.heavy, FLOATS * i
    r, v = flock.at(box.pull, i, now)
    due, leaves, known = now + hit.time, flock.event[index(row + LEAVES)], hit.wall
    target = min(min(due, leaves), now + heavy.clock[LENGTH])
    # At the end of its cell the ball looks again anyway.
    if target < due:
        due, known = select(leaves <= target, math.inf, target), UNKNOWN
    flight = ParticleFlight(r, v, ZERO if box.pull is None else box.pull, now, target - now)
    walls = heavy.grown(box.kinds.radius_of(i))
    free, is_near = reach_of_all(walls, heavy.freedoms, flight), False
    if free < flight.longest:
        if free > heavy.soon(now):
            due, known = now + free, UNKNOWN
        else:
            is_near = True
            met = first_hit(walls, box.pull, heavy.freedoms, flight)
            if met.time < flight.longest:
                due, known = now + met.time, first_number(box) + met.wall
    flock.event[index(row + DUE)] = due
    flock.aim_at(i, known)
    heavy.near[index(i)] = is_near
    if is_near and not heavy.listed[index(i)]:
        heavy.listed[index(i)] = True
        heavy.close[index(int(heavy.counts[LISTED]))] = i
        heavy.counts[LISTED] += 1.0

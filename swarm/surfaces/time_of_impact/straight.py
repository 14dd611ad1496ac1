"""First hits of straight flights with a wall that has bounds of its level's second derivative, the same everywhere.

Lanes look together; a flight of its own ends its looks when it can.
"""

import math
from typing import Any

from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import Vec, absolute, dot, norm, square, total
from .course import positive, rise_time
from .march import LOOKS


class Looked(Record):
    """What looks at a flight have found of its first hit so far."""

    free: Any  # a time until which it surely meets nothing; that of the hit once there are no more looks
    goes_on: Any  # whether there is a next look
    at: Any  # its time
    # The time of the last look, that of the next one before the first, and what it has found
    before: Any
    level: Any
    half: Any


class Straight(Record):
    """A straight flight from its `start` to its end: its level's second derivative has the same bounds everywhere.

    A safe step ends where the highest parabola that the bounds allow rises through 0. Where even the lowest one does,
    the level rises all the way from the first root to there: it has no other root, and nothing is left to be proven.
    Looks then go to the root from both sides, by the cubic through the last two of them.
    """

    surface: Any
    r: Vec
    v: Vec
    start: Any
    end: Any
    least: Any
    most: Any

    def first(self):
        goes_on = (self.start <= self.end) & (square(self.v) > 0.0)
        return Looked(select(goes_on, self.start, math.inf), goes_on, self.start, self.start, 0.0, 0.0)

    def look(self, known):
        """What is known after one look more."""
        surface, t, is_first = self.surface, known.at, known.at == known.before
        p = self.r + t * self.v
        level = surface.side * surface.phi(p)
        half = 0.5 * surface.side * dot(surface.gradient(p), self.v)
        # Past the root, or past the wall by round-off or because the surface bends more than was said
        past = (level > 0.0) & (half > 0.0) & (not is_first)
        # Whether the lowest parabola rises through 0
        one_root = ((half > 0.0) | (self.least > 0.0)) & (half * half >= self.least * level)
        bend = select(one_root | past, self._bend(known, level, half, is_first), self.most)
        bottom = half + math.sqrt(positive(half * half - bend * level))
        step = select(past, level / select(past, bottom, 1.0), rise_time(level, half, bend))
        beyond = not (t + step <= self.end)
        # Where there is one root, a look at the end says whether it is before that.
        is_free = (not past) & ((beyond & (not one_root)) | (t >= self.end) | (not step < math.inf))
        # What is left of the level after the step is at most (most - least) step^2, the rise there at least this.
        way = select(is_free, 0.0, step)
        rising = half + way * select(past, -self.most, self.least)
        speed = norm(self.v)
        shortest = 2.0 * EPSILON * (total(absolute(p)) / select(speed > 0.0, speed, 1.0) + way)
        arrives = (not is_first) | (rising > 0.0) | (way == 0.0)
        arrives &= (way <= shortest) | ((self.most - self.least) * way * way <= 2.0 * shortest * rising)
        arrives &= past | (not beyond)
        free, after = select(past, known.free, t), select(past, t - way, select(beyond, self.end, t + way))
        # A level that bends more than was said has its root anywhere between.
        after = select(past & (not after > free), 0.5 * (free + t), after)
        arrives |= past & (not after > free)
        goes_on = (not is_free) & (not arrives)
        found = select(is_free, math.inf, select(arrives, after, free))
        return Looked(found, goes_on, after, t, level, half)

    def _bend(self, known, level, half, is_first):
        """Half the second derivative, by the cubic through the last look and this one; at the first the middle."""
        since = select(is_first, 1.0, known.at - known.before)
        bend = (3.0 * (known.level - level) / since + 2.0 * known.half + 4.0 * half) / since
        bend = select(is_first, 0.5 * (self.least + self.most), bend)
        return select(bend > self.least, select(bend < self.most, bend, self.most), self.least)


def first_found(flight):
    """(when a flight meets the wall, whether it does then), by its looks."""
    known = flight.first()
    for _look in range(LOOKS):
        if not known.goes_on:
            break
        known = flight.look(known)
    return known.free, not known.goes_on

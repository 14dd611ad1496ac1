"""Balls that grow while they fly, all by the same factor: Lubachevsky and Stillinger's way to a dense packing.

At a time t of the run the radius of each is R (scale + rate t). Walls are those that balls of the radius R meet, from
the start on: a centre keeps to where it may be at the end.

B. D. Lubachevsky and F. H. Stillinger, J. Stat. Phys. 60 (1990) 561.
"""

from typing import Any, NamedTuple

from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import dot, square


class GrowingSight(NamedTuple):
    """As `Sight`, of balls that grow: what b.u and |u|^2 are there is less what the distance of contact grows by."""

    closing: Any
    gap: Any
    discriminant: Any

    def meets(self):
        """Whether they will touch: slower than they grow they do, whatever their way is."""
        slow = (self.gap > 0.0) & (self.discriminant > self.closing * self.closing)
        return ((self.closing < 0.0) | slow) & (self.discriminant > 0.0)


class Growth(Record):
    """The growth of all balls."""

    scale: float  # at time 0, of the epoch
    rate: float  # [1/s]

    def at(self, now):
        """The scale at a time."""
        return self.scale + self.rate * now

    def sight(self, b, u, touching2, now):
        """The `GrowingSight` of a ball that is b away and moves by u, now."""
        scale = self.at(now)
        closing = dot(b, u) - touching2 * scale * self.rate
        gap = square(b) - touching2 * scale * scale
        faster = square(u) - touching2 * self.rate * self.rate
        # A ball sees itself too.
        return GrowingSight(closing, gap, select(square(b) > 0.0, closing * closing - faster * gap, -1.0))

    def turned(self, u, n, closing, distance2, now):
        """The relative velocity after a collision: their surfaces part as fast as they came."""
        return u - (2.0 * (closing / distance2 - self.rate / self.at(now))) * n

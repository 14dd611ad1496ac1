"""The level of a wall along a flight as far as its second derivative is known: when it rises through 0 at the soonest.

f is below c + 2 b t + a t^2 + k t^3, with a bound k of f'''/6 up to some time.
"""

import math

from ..kernel.jit import select
from ..kernel.record import Record
from .course import Majorant, rise_time


class Level(Majorant):
    """A level whose third derivative has a bound: f, f'/2, f''/2, |grad q| and m."""

    c: float
    b: float
    a2: float
    steepness: float
    magnitude: float

    def third(self, bounds, within):
        """The bound of f''' within that time."""
        moved = self.steepness + 2.0 * self.magnitude * bounds.speed * within
        return 6.0 * self.magnitude * bounds.speed * bounds.acceleration + moved * bounds.jerk

    def own_rise(self):
        """When its own parabola rises."""
        return rise_time(self.c, self.b, self.a2)

    def soonest(self, sixth, within, is_first):
        """When it rises at the soonest, if a sixth of f''' is bounded within that time.

        How deep a particle is that leaves no wall, the parabola alone knows.
        """
        return self.rises_after_leaving(sixth, within) if is_first else self.rises(sixth, within)


class Between(Record):
    """The levels of the two planes of a slab: the place between them in the direction of motion, f'/2 > 0 and f''/2."""

    place: float
    half: float
    bend: float
    radius: float

    steepness = 1.0

    def third(self, bounds, within):
        """The bound of f''' within that time."""
        return bounds.jerk

    def own_rise(self):
        """When the parabola of one of them rises."""
        # The plane ahead, unless the particle turns short of it: then the one behind
        c, b, a = self.place - self.radius, self.half, self.bend
        discriminant = b * b - a * c
        reaches = (discriminant >= 0.0) | (a > 0.0)
        discriminant = select(reaches, discriminant, b * b - a * (self.place + self.radius))
        root = _root(discriminant)
        over, under = select(reaches, -c, b + root), select(reaches, b + root, -a)
        return select(under > 0.0, select(over > 0.0, over, 0.0) / under, math.inf)

    def soonest(self, sixth, within, is_first):
        """When one of them rises at the soonest, as of a `Level`."""
        b, k = self.half, sixth * within
        c, a = self.place - self.radius, self.bend + k
        discriminant = b * b - a * c
        root = _root(discriminant)
        reaches = ((discriminant >= 0.0) | (a > 0.0)) & (b + root > 0.0)
        ahead = select(reaches, select(c < 0.0, -c, 0.0) / (b + root), math.inf)
        # The one behind: the particle moves away from it.
        c, a = -self.place - self.radius, k - self.bend
        behind = select(a > 0.0, (b + _root(b * b - a * c)) / a, math.inf)
        if is_first:
            leaving = rise_time(-2.0 * b, -0.5 * self.bend, sixth)
            behind = select(leaving > behind, leaving, behind)
        return select(behind < ahead, behind, ahead)


def _root(discriminant):
    return math.sqrt(select(discriminant > 0.0, discriminant, 0.0))

"""Constant gravity, or none: the exact free flight, and the time at which a parabola along it rises through 0."""

import math

from .jit import select
from .record import Record
from .vector import Vec, absolute, dot


class Gravity(Vec):
    """Acceleration G [m/s^2]. A scene without gravity has None, which compiles to nothing."""


class Bounds(Record):
    """Bounds of the speed, the acceleration and the jerk in the frame of a wall for some time, in any direction."""

    speed: float
    acceleration: float
    jerk: float


def as_vector(gravity):
    """Return G as an ordinary vector."""
    return Vec(gravity.x, gravity.y, gravity.z)


def displacement(gravity, v, t):
    """v t + G t^2/2"""
    if gravity is None:
        return v * t
    half = 0.5 * t
    return (v + half * gravity) * t


def accelerated(gravity, v, t):
    """v + G t"""
    return v if gravity is None else v + gravity * t


def potential(gravity, r):
    """Return the potential energy per mass, -G.r."""
    return 0.0 if gravity is None else -dot(gravity, r)


def weight(gravity, s):
    """Return the largest change of the potential energy per mass when the coordinates change by s."""
    return 0.0 if gravity is None else dot(absolute(gravity), s)


def rise_time(c, b, a):
    """Return the first t >= 0 at which c + 2 b t + a t^2 rises through 0, where c <= 0 up to round-off; else infinity.

    A cavity has a > 0, a solid a < 0, a plane a = 0. Branch-free.
    """
    return rise_time_by(c, b, a, b * b - a * c)


def rise_time_by(c, b, a, discriminant):
    """`rise_time` with a discriminant more exact than b^2 - a c, which has no digits about 1e8 sizes from a solid."""
    over, under = _outer_root(c, b, a, discriminant)
    time, misses = over / under, (under <= 0.0) | ((a < 0.0) & (discriminant < 0.0))
    return select(misses, math.inf, select(time > 0.0, time, 0.0))


class Quotient(Record):
    """A time as a quotient, infinite if the divisor is 0: the first of several is found by products alone."""

    over: float
    under: float

    def sooner(self, other):
        """Return the smaller of two."""
        return Quotient(*select(other.over * self.under < self.over * other.under, tuple(other), tuple(self)))

    def time(self):
        """Return its value."""
        is_finite = self.under > 0.0
        return select(is_finite, self.over / select(is_finite, self.under, 1.0), math.inf)


NEVER = Quotient(1.0, 0.0)


def rise_quotient(c, b, a):
    """`rise_time` as a `Quotient`."""
    discriminant = b * b - a * c
    over, under = _outer_root(c, b, a, discriminant)
    misses = (under <= 0.0) | ((a < 0.0) & (discriminant < 0.0))
    return Quotient(*select(misses, tuple(NEVER), (select(over > 0.0, over, 0.0), under)))


def rise_time_inside(c, b, a):
    """`rise_time` for a >= 0: a convex cavity, which a particle that moves never misses."""
    over, under = _outer_root(c, b, a, b * b - a * c)
    time = over / under
    return select(under <= 0.0, math.inf, select(time > 0.0, time, 0.0))


def _outer_root(c, b, a, discriminant):
    """Return the root at which c + 2 b t + a t^2 rises, as a quotient (over, under)."""
    # a > 0, c > 0 by round-off at a grazing hit: the flight touches, it does not miss.
    root = math.sqrt(select(discriminant > 0.0, discriminant, 0.0))
    approaching = b > 0.0
    # The form of the root that does not cancel: -c/(b + root) when b > 0, (root - b)/a when b <= 0.
    return select(approaching, -c, root - b), select(approaching, b + root, a)

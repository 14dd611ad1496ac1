"""The walls that hold a particle, one wall or the edge of two: their parts of its velocity, and their pressures."""

import math
from typing import Any

from ..kernel.jit import select
from ..kernel.limits import TINY
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, cross, dot, square
from .reflection import relative


class HeldVector(Record):
    """A vector as its part P that the walls allow plus multiples of their normals: P + b n + c m."""

    along: Vec
    n: Vec
    b: float
    m: Vec
    c: float


class Drift(Record):
    """The velocities of the walls that hold a particle; None if no wall of the scene moves."""

    first: Vec
    second: Vec


class Holding(Record):
    """The numbers of the walls that hold a particle."""

    def has(self: Any, wall):
        """Whether a wall is one of them."""
        found = False
        for one in self:
            found = found | (wall == one)
        return found

    def project(self: Any, walls, r):
        """Move a point within round-off of the walls onto them; return it."""
        for one in reversed(self):
            r = walls.project(one, r)
        return r

    def split(self: Any, walls, drift, r0, r1, w):
        """Return the `HeldVector` of a velocity, with the normals of a step from r0 to r1."""
        return self.parts(drift, w, *(walls.step_normal(one, r0, r1) for one in self))

    def split_at(self: Any, walls, drift, r, w):
        """Return the `HeldVector` of a velocity at a point."""
        return self.parts(drift, w, *(walls.unit_normal(one, r) for one in self))

    def along(self, walls, drift, r0, r1, w):
        """Return only the part P of `split`."""
        return self.split(walls, drift, r0, r1, w).along


class One(Holding):
    """A particle that slides along one wall."""

    first: float

    # No second wall holds it.
    second = -1.0

    def of_lane(self, first, second):
        """Return the walls that hold a lane, of this kind."""
        return One(first)

    def parts(self, drift, w, n):
        """Return the `HeldVector` of a velocity, from the normal of the wall."""
        b = _towards(drift, w, n)
        return HeldVector(w - b * n, n, b, ZERO, 0.0)

    def along(self, walls, drift, r0, r1, w):
        """Return only the part P of `split`, which needs no length of a normal."""
        g = walls.discrete_gradient(self.first, r0, r1)
        return w - (_towards(drift, w, g) / square(g)) * g

    def inward(self, n, m):
        """Return the unit vector away from the walls."""
        return -1.0 * n

    def presses(self, walls, r, v, pull):
        """Return the pressures of the walls on a particle that slides with this velocity, per mass: (first, second)."""
        return walls.outward_acceleration(self.first, r, v, pull), 0.0

    def lets_go(self, n, m):
        """Whether a wall no longer presses."""
        return n < 0.0


class Two(Holding):
    """A particle that slides along the edge of two walls."""

    first: float
    second: float

    def of_lane(self, first, second):
        """Return the walls that hold a lane, of this kind."""
        return Two(first, second)

    def parts(self, drift, w, n, m):
        """Return the `HeldVector` of a velocity, from the normals of both walls."""
        # b + cos c = w.n and cos b + c = w.m, where sin^2 = |n x m|^2
        e, cosine, wn = edge(n, m), dot(n, m), _towards(drift, w, n)
        wm = dot(relative(None if drift is None else drift.second, w), m)
        inverse = _inverse(square(e))
        b, c = (wn - cosine * wm) * inverse, (wm - cosine * wn) * inverse
        # Along the edge, if the walls are at rest
        along = (dot(w, e) * inverse) * e if drift is None else w - b * n - c * m
        return HeldVector(along, n, b, m, c)

    def inward(self, n, m):
        """Return the unit vector midway between those away from the walls."""
        k = n + m
        return k * (-1.0 / math.sqrt(square(k)))

    def presses(self, walls, r, v, pull):
        """Return the pressures of the walls on the particle, per mass: (first, second)."""
        one, other = (walls.outward_acceleration(wall, r, v, pull) for wall in self)
        n, m = (walls.unit_normal(wall, r) for wall in self)
        cosine, inverse = dot(n, m), _inverse(square(edge(n, m)))
        return (one - cosine * other) * inverse, (other - cosine * one) * inverse

    def lets_go(self, n, m):
        """Whether a wall no longer presses."""
        return (n < 0.0) | (m < 0.0)


class Three(Holding):
    """A particle in the corner of three walls."""

    first: float
    second: float
    third: float


# --- Their motion: None if no wall of the scene moves ----------------------------------------------------


def drift(moving, active, walls, r):
    """Return the `Drift` at a point."""
    if moving is None:
        return None
    return Drift(walls.velocity(active.first, r), walls.velocity(max(active.second, 0.0), r))


def mean_drift(moving, active, walls, r0, r1, h):
    """Return the mean `Drift` in a step from r0 to r1 of length h."""
    if moving is None:
        return None
    other = max(active.second, 0.0)
    return Drift(walls.mean_velocity(active.first, r0, r1, h), walls.mean_velocity(other, r0, r1, h))


def given_by_second(drift, taken):
    """Return twice the work per mass of the second wall in a step with the parts `taken` of w0."""
    # w1 - w0 = -2 (b n + c m); the work is this times the velocity of the wall.
    return 0.0 if drift is None else -4.0 * taken.c * dot(drift.second, taken.m)


# --- Parts of a velocity ---------------------------------------------------------------------------------


def _towards(drift, w, n):
    """Return the speed of a particle into the first wall, with the normal n."""
    return dot(relative(None if drift is None else drift.first, w), n)


def edge(n, m):
    """Return n x m, to round-off of its length also if the walls are nearly parallel: n x (m -+ n)."""
    return cross(n, m - select(dot(n, m) < 0.0, -1.0, 1.0) * n)


def _inverse(sine2):
    return 1.0 / select(sine2 > TINY, sine2, TINY)

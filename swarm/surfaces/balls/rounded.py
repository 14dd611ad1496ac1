"""Convex solids that balls meet: all that is within the radius of a ball from the body, with its edges round.

phi = sqrt(q) - radius is the distance; q, the inner function, is the squared distance from the body. The vector e from
its nearest point changes by no more than r does, so that 0 <= H <= I. The body is behind the plane on that point,
across e: safe steps are those to planes, which are Newton's.
"""

import math
from typing import Any

import numpy as np

from ...kernel.gravity import Gravity, as_vector, displacement
from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import Symmetric, Vec, absolute, dot, norm, square, total
from ..approach import place
from ..course import rise_time, under_way
from ..shapes.common import Distance

# The last step is shorter than this part of the radius, whose square is none, or than round-off of a place.
_CLOSE, _ROUND_OFF = 1e-8, 4.0 * 2.220446049250313e-16
# Part of a distance over which e is differenced: the cube root of the round-off.
_SPACING = 6e-6
_TINY = float(np.finfo(np.float64).tiny)


class Rounded(Distance):
    """A body grown by `radius`; it gives the fields of `Distance` and `from_body`."""

    def from_body(self, r):
        """The vector from the nearest point of the body; 0 in it."""
        raise NotImplementedError

    def inner(self, r):
        return square(self.from_body(r))

    def inner_gradient(self, r):
        return 2.0 * self.from_body(r)

    def difference(self, r0, r1):
        e0, e1 = self.from_body(r0), self.from_body(r1)
        return dot(e1 - e0, e1 + e0)

    def distance(self, r):
        return self.gap_of(self.inner(r))

    def unit_normal(self, r):
        e = self.from_body(r)
        q = square(e)
        return e * (self.side / math.sqrt(select(q > 0.0, q, 1.0)))

    def before(self, gravity, r, v):
        """When a flight comes to the plane that is as far as the radius from the one on the nearest point of the body.

        The whole body is behind that.
        """
        e = self.from_body(r)
        away = norm(e)
        n = e * (-1.0 / select(away > 0.0, away, 1.0))
        level, half = self.radius - away, 0.5 * dot(n, v)
        bend = 0.0 * half if gravity is None else 0.5 * dot(n, as_vector(gravity))
        return rise_time(level, half, bend)

    def steps(self, gravity, r, v):
        return ToBody(self, gravity, r, v)

    in_steps = True

    def safe_time(self, r, v, pull):
        time = self.before(Gravity(pull.x, pull.y, pull.z), r, v)
        return select(self.inner(r) < self.radius2, 0.0, time)

    def passed(self, r, v):
        return dot(self.from_body(r), v) >= 0.0

    def hessian(self, r):
        # By differences of e
        h = _SPACING * (norm(self.from_body(r)) + self.radius) + _TINY
        half = 0.5 / h
        x = half * (self.from_body(r + Vec(h, 0.0, 0.0)) - self.from_body(r - Vec(h, 0.0, 0.0)))
        y = half * (self.from_body(r + Vec(0.0, h, 0.0)) - self.from_body(r - Vec(0.0, h, 0.0)))
        z = half * (self.from_body(r + Vec(0.0, 0.0, h)) - self.from_body(r - Vec(0.0, 0.0, h)))
        return Symmetric(x.x, y.y, z.z, x.y, y.z, z.x)

    def hessian_bounds(self, r):
        return (0.0, 1.0, self.radius)

    def may_reach(self, low, high):
        return norm(self.from_body(0.5 * (low + high))) <= self.radius + 0.500001 * norm(high - low)


def part_within(d, way):
    """The part of a way at which it is nearest to a place, from 0 to 1."""
    length2 = square(way)
    part = dot(d, way) / select(length2 > 0.0, length2, 1.0)
    return select(part > 0.0, select(part < 1.0, part, 1.0), 0.0)


class ToBody(Record):
    """The steps of a flight to a grown body, each to a plane in front of it."""

    surface: Any
    gravity: Any
    r: Vec
    v: Vec

    # What is not found by then goes on in the next pass.
    most = 60

    def first_step(self):
        return self.next_step(0.0, math.inf)

    def next_step(self, t, last):
        p, w = place(self.gravity, self.r, self.v, t, last)
        time = self.surface.before(self.gravity, p, w)
        # The body is no farther behind the plane than the square of the way over the radius.
        way = total(absolute(displacement(self.gravity, w, select(time < math.inf, time, 0.0))))
        near = _CLOSE * self.surface.radius + _ROUND_OFF * total(absolute(p))
        goes_on = under_way(t, last)
        return select(goes_on, t + time, t), select(goes_on, select(way <= near, 0.0, math.inf), last)


class RoundBox(Rounded):
    """A box with round edges and corners."""

    center: Vec
    half: Vec
    radius: float
    radius2: float
    side: float

    def by_right_angles(self, axes):
        """The same where its own axes are these other axes of the scene, or their opposites."""
        center, half = axes @ np.array(self.center), abs(axes) @ np.array(self.half)
        return self._replace(center=Vec(*center.tolist()), half=Vec(*half.tolist()))

    def from_body(self, r):
        # No select here and below: these may be arrays.
        d, half = r - self.center, self.half
        return Vec(_beyond(d.x, half.x), _beyond(d.y, half.y), _beyond(d.z, half.z))

    def hessian(self, r):
        e = self.from_body(r)
        return Symmetric(_one_where(e.x), _one_where(e.y), _one_where(e.z), 0.0, 0.0, 0.0)


class RoundCan(Rounded):
    """A capped cylinder about the z axis with round rims."""

    center: Vec
    wide: float  # the radius of the cylinder
    half: float  # of its length
    radius: float
    radius2: float
    side: float

    def from_body(self, r):
        d = r - self.center
        across = np.sqrt(d.x * d.x + d.y * d.y)
        part = np.maximum(across - self.wide, 0.0) / np.maximum(across, _TINY)
        return Vec(part * d.x, part * d.y, _beyond(d.z, self.half))

    def hessian(self, r):
        d = r - self.center
        across = math.sqrt(d.x * d.x + d.y * d.y)
        # 1 across the rim, 1 - R/rho along it
        out = across > self.wide
        f = select(out, self.wide / select(out, across, 1.0), 1.0)
        ex, ey = -d.y / select(out, across, 1.0), d.x / select(out, across, 1.0)
        flat = select(out, 1.0, 0.0)
        up = select(abs(d.z) > self.half, 1.0, 0.0)
        return Symmetric(flat - flat * f * ex * ex, flat - flat * f * ey * ey, up, -flat * f * ex * ey, 0.0, 0.0)


class RoundCone(Rounded):
    """The solid nappe of a cone about the z axis, with a round tip."""

    center: Vec
    sine: float  # of the half angle
    cosine: float
    radius: float
    radius2: float
    side: float

    def from_body(self, r):
        d = r - self.center
        across = np.sqrt(d.x * d.x + d.y * d.y)
        # How far from the wall, and how far along it from the tip the nearest point is
        off, along = across * self.cosine - d.z * self.sine, across * self.sine + d.z * self.cosine
        foot = np.maximum(along, 0.0)
        out = 1.0 * ((off > 0.0) | (along < 0.0))
        part = out * (1.0 - foot * self.sine / np.maximum(across, _TINY))
        return Vec(part * d.x, part * d.y, out * (d.z - foot * self.cosine))

    def hessian(self, r):
        d = r - self.center
        across2 = d.x * d.x + d.y * d.y
        across = math.sqrt(across2)
        off, along = across * self.cosine - d.z * self.sine, across * self.sine + d.z * self.cosine
        safe = select(across > 0.0, across, 1.0)
        nx, ny = d.x / safe, d.y / safe
        # On the wall's normal 1, around the axis off cos/across, along the wall 0
        c, s, round_ = self.cosine, self.sine, off * self.cosine / safe
        at_tip, out = along <= 0.0, off > 0.0
        xx = select(at_tip, 1.0, c * c * nx * nx + round_ * ny * ny)
        yy = select(at_tip, 1.0, c * c * ny * ny + round_ * nx * nx)
        zz = select(at_tip, 1.0, s * s)
        xy = select(at_tip, 0.0, (c * c - round_) * nx * ny)
        yz, zx = select(at_tip, 0.0, -c * s * ny), select(at_tip, 0.0, -c * s * nx)
        k = select(out, 1.0, 0.0)
        return Symmetric(k * xx, k * yy, k * zz, k * xy, k * yz, k * zx)


def _beyond(x, half):
    """How far a coordinate is beyond the nearer of two ends, with its sign; 0 between them."""
    return x - np.minimum(np.maximum(x, -half), half)


def _one_where(part):
    return select(part != 0.0, 1.0, 0.0)

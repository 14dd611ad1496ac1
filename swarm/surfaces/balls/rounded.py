"""Convex solids that balls meet: the places within the radius of a ball from the body, with round edges.

phi, the inner function, is the distance from these. The body is behind the plane across the normal at its nearest
point: safe steps of a flight are steps to planes, which are Newton's. Deep in the body, where soft balls may be, the
distance is that to the nearest face.
"""

import math

import numpy as np

from ...kernel.gravity import Gravity, as_vector, displacement
from ...kernel.jit import select
from ...kernel.limits import PLACE, TINY
from ...kernel.vector import Vec, absolute, dot, norm, square, total
from ..curvature import SPACING, half_hessian
from ..time_of_impact.approach import Approach
from ..time_of_impact.course import rise_time
from ..time_of_impact.rising import plane_step
from .at_radius import AtRadius

# The last step is shorter than this fraction of the radius plus round-off of a place. The square of the fraction is
# below round-off.
_CLOSE = 1e-8


class Rounded(AtRadius):
    """A solid grown by the field `radius`; subclasses define `foot`."""

    side = -1.0

    def foot(self, r):
        """Return the signed distance of a point outside the body, and the unit normal of the body at its nearest point.

        In Python also for arrays of points.
        """
        raise NotImplementedError

    def phi(self, r):
        return self.foot(r)[0] - self.radius

    def gradient(self, r):
        return self.foot(r)[1]

    def before(self, gravity, r, v):
        """Return when a flight comes to the plane at the distance `radius` from the one at the foot."""
        away, n = self.foot(r)
        half = -0.5 * dot(n, v)
        bend = 0.0 * half if gravity is None else -0.5 * dot(n, as_vector(gravity))
        return rise_time(self.radius - away, half, bend)

    def moving_step(self, seen, longest):
        away, n = self.foot(seen.r)
        return plane_step(self.radius - away, -1.0 * n, seen, longest)

    def steps(self, gravity, r, v):
        return ToBody(self, gravity, r, v)

    in_steps = True

    def safe_time(self, r, v, pull):
        time = self.before(Gravity(pull.x, pull.y, pull.z), r, v)
        return select(self.phi(r) < 0.0, 0.0, time)

    def passed(self, r, v):
        return dot(self.gradient(r), v) >= 0.0

    def may_reach(self, low, high):
        return self.foot(0.5 * (low + high))[0] <= self.radius + 0.500001 * norm(high - low)

    def farthest_push(self):
        # Where its curvature is at most that of the ball, as on a sphere
        return -2.0 * self.radius

    def hessian(self, r):
        return half_hessian(self, r, SPACING * (abs(self.phi(r)) + self.radius) + TINY)

    def hessian_bounds(self, r):
        # 0 <= H <= 1/(2 d), with the distance d from the body
        away = max(self.foot(r)[0], self.radius)
        return 0.0, 1.0 / select(away > 0.0, away, 1.0), 0.5 * away


def part_within(d, way):
    """Return the part of a way, from 0 to 1, at which it is nearest to a place."""
    length2 = square(way)
    part = dot(d, way) / select(length2 > 0.0, length2, 1.0)
    return select(part > 0.0, select(part < 1.0, part, 1.0), 0.0)


def foot_at(e, depth, face):
    """Return the foot of a point, by the vector from the nearest point of the body, and inside it the nearest face.

    Args:
        e: the vector, 0 in the body.
        depth: the signed distance from the nearest face.
        face: the normal of this face.
    """
    away = np.sqrt(square(e))
    # No select here and below: the arguments may be arrays.
    inside = 1.0 * (away == 0.0)
    return away + np.minimum(depth, 0.0), e * (1.0 / np.maximum(away, TINY)) + inside * face


class ToBody(Approach):
    """The steps of a flight to a grown body, each to a plane in front of the body."""

    # The search continues in the next pass after this number of steps.
    most = 60

    def first_step(self):
        return self.next_step(0.0, math.inf)

    def step_from(self, p, w, last):
        time = self.surface.before(self.gravity, p, w)
        # The body is no farther behind the plane than the square of the way over the radius.
        way = total(absolute(displacement(self.gravity, w, select(time < math.inf, time, 0.0))))
        near = _CLOSE * self.surface.radius + PLACE * total(absolute(p))
        return time, select(way <= near, 0.0, math.inf)


class RoundBox(Rounded):
    """A box with round edges and corners."""

    center: Vec
    half: Vec
    radius: float

    def by_right_angles(self, axes):
        """Return the box with its axes along these axes of the scene, or their opposites."""
        center, half = axes @ np.array(self.center), abs(axes) @ np.array(self.half)
        return self._replace(center=Vec(*center.tolist()), half=Vec(*half.tolist()))

    def foot(self, r):
        d, h = r - self.center, self.half
        x, y, z = np.abs(d.x) - h.x, np.abs(d.y) - h.y, np.abs(d.z) - h.z
        depth = np.maximum(x, np.maximum(y, z))
        on_x = 1.0 * (x == depth)
        on_y = (1.0 - on_x) * (y == depth)
        face = Vec(np.copysign(on_x, d.x), np.copysign(on_y, d.y), np.copysign(1.0 - on_x - on_y, d.z))
        return foot_at(Vec(_beyond(x, d.x), _beyond(y, d.y), _beyond(z, d.z)), depth, face)


class RoundCan(Rounded):
    """A capped cylinder about the z axis with round rims."""

    center: Vec
    wide: float  # the radius of the cylinder
    half: float  # of its length
    radius: float

    def foot(self, r):
        d = r - self.center
        across = np.sqrt(d.x * d.x + d.y * d.y)
        part, out, up = 1.0 / np.maximum(across, TINY), across - self.wide, np.abs(d.z) - self.half
        beside, above = np.maximum(out, 0.0) * part, 1.0 * (up >= out)
        face = Vec((1.0 - above) * part * d.x, (1.0 - above) * part * d.y, np.copysign(above, d.z))
        return foot_at(Vec(beside * d.x, beside * d.y, _beyond(up, d.z)), np.maximum(out, up), face)


class RoundCone(Rounded):
    """The solid nappe of a cone about the z axis, with a round tip."""

    center: Vec
    sine: float  # of the half angle
    cosine: float
    radius: float

    def foot(self, r):
        d = r - self.center
        across = np.sqrt(d.x * d.x + d.y * d.y)
        part = 1.0 / np.maximum(across, TINY)
        # The distance from the wall, and the distance along it from the tip to the nearest point
        off, along = across * self.cosine - d.z * self.sine, across * self.sine + d.z * self.cosine
        foot = np.maximum(along, 0.0)
        out = 1.0 * ((off > 0.0) | (along < 0.0))
        beside = out * (1.0 - foot * self.sine * part)
        face = Vec(self.cosine * part * d.x, self.cosine * part * d.y, -self.sine + 0.0 * off)
        return foot_at(Vec(beside * d.x, beside * d.y, out * (d.z - foot * self.cosine)), off, face)


def _beyond(out, x):
    """Return by how much a coordinate is beyond the nearer end, with its sign, given `out`; 0 between both ends."""
    return np.copysign(np.maximum(out, 0.0), x)

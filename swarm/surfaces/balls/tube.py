"""Tube: a cylinder without ends by its distance, phi = sqrt(q) - R; q is the squared distance from the axis."""

import math

import numpy as np

from ...kernel.jit import select
from ...kernel.vector import Vec, absolute, dot, norm, square, times, total
from ..shapes.common import Distance, ExactChord
from ..time_of_impact.course import Quartic, ball_rise_time, level_and_window, rise_time, rise_time_inside
from ..time_of_impact.rising import Level


class Tube(Distance, ExactChord):
    """A cylinder along an axis of its frame, or a cylinder that balls meet: a sphere of two dimensions."""

    center: Vec
    across: Vec  # 1 along the two axes across its own, 0 along its own
    radius: float
    radius2: float
    side: float

    def by_right_angles(self, axes):
        """Return the tube with its axes along these axes of the scene, or their opposites."""
        center, across = axes @ np.array(self.center), abs(axes) @ np.array(self.across)
        return self._replace(center=Vec(*center.tolist()), across=Vec(*across.tolist()))

    def off(self, r):
        """Return the vector from the axis."""
        return times(self.across, r - self.center)

    def inner(self, r):
        return square(self.off(r))

    def inner_gradient(self, r):
        return 2.0 * self.off(r)

    def unit_normal(self, r):
        d = self.off(r)
        q = square(d)
        return d * (self.side / math.sqrt(select(q > 0.0, q, 1.0)))

    def gap_scale(self, r):
        return total(times(self.across, absolute(r)))

    def project(self, r):
        d = self.off(r)
        q = square(d)
        return r - (1.0 - self.radius / math.sqrt(select(q > 0.0, q, 1.0))) * d

    def outward_acceleration(self, r, v, pull):
        d = self.off(r)
        q = square(d)
        return self.side * (square(times(self.across, v)) + dot(d, pull)) / math.sqrt(select(q > 0.0, q, 1.0))

    leaves_once = property(lambda self: self.side > 0.0)  # type: ignore[assignment]

    def first_hit(self, r, v):
        d, u, side = self.off(r), times(self.across, v), self.side
        inside = rise_time_inside(square(d) - self.radius2, dot(d, u), square(u))
        return select(side > 0.0, inside, ball_rise_time(side, self.radius2, d, u)), True

    def course(self, r, v, pull):
        d, u, g, side = self.off(r), times(self.across, v), times(self.across, pull), self.side
        c, b, a, gg = square(d) - self.radius2, dot(d, u), square(u), square(g)
        a2 = a + dot(d, g)
        size = self.radius2 + select(c > 0.0, c, 0.0)
        level, window = level_and_window(c, self.radius2, size, a, gg)
        # Without a pull across the axis the level is a parabola.
        falls = gg > 0.0
        level, window = select(falls, level, c), select(falls, window, math.inf)
        a3, a4 = select(falls, side * dot(u, g), 0.0), select(falls, side * 0.25 * gg, 0.0)
        return Quartic(side * level, side * b, side * a2, a3, a4, window)

    def reach(self, lease):
        # The motion of the wall counts in any direction; along the axis nothing comes nearer.
        d, u, a = self.off(lease.r), times(self.across, lease.v), times(self.across, lease.a)
        clear = max(-self.side * (math.sqrt(square(d)) - self.radius), 0.0)
        return rise_time(-clear, 0.5 * (norm(u) + lease.width), 0.5 * norm(a))

    def discrete_gradient(self, r0, r1):
        # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
        return times(self.across, r0 + r1 - 2.0 * self.center)

    def push(self, r0, p, kappa):
        # r1 = r0 + p - kappa D with D = (2 d + p)/(1 + kappa) across the axis
        d = 2.0 * self.off(r0) + times(self.across, p)
        return r0 + (p - (kappa / (1.0 + kappa)) * d)

    def rise(self, r0, p, kappa):
        # As for a sphere
        d, u = self.off(r0), times(self.across, p)
        q0, dp = square(d), 2.0 * dot(d, u)
        free, fall = dp + square(u), 4.0 * q0 + dp
        w = 1.0 / (1.0 + kappa)
        risen = (free - kappa * fall) * w * w
        # q1 >= 0, even by round-off.
        return select(risen > -q0, risen, -q0), -w * (2.0 * risen + w * fall)

    def resolve(self, r, strength):
        return r - (2.0 * strength / (1.0 + 2.0 * strength)) * self.off(r)

    def chord_guess(self, r, p):
        u = times(self.across, p)
        dp = 2.0 * dot(self.off(r), u)
        return (dp + square(u)) / (4.0 * self.radius2 + dp)

    def chord_normal(self, r, p, kappa):
        n = 2.0 * self.off(r) + times(self.across, p)
        return n * (self.side / norm(n))

    # --- For walls that move other than uniformly ---

    def hessian_bounds(self, r):
        # H = 1 across the axis
        return (select(self.side > 0.0, 1.0, 0.0), 1.0, math.inf)

    def level_along(self, seen):
        d, u, side = self.off(seen.r), times(self.across, seen.v), self.side
        q, bend = square(d), square(u) + dot(d, seen.a)
        return Level(side * (q - self.radius2), side * dot(d, u), side * bend, 2.0 * math.sqrt(q), 1.0)


def tube_of(center, radius, side):
    """Return the record of a cylinder about the z axis of its frame."""
    return Tube(center, Vec(1.0, 1.0, 0.0), radius, radius * radius, side)

"""Quadratic phi = sum A x^2 + sum b x - level in a principal frame, its inner function the sum.

The ellipsoid, the cylinder, the cone and the paraboloid are such surfaces, as is any quadric, with A of either sign.
"""

import math
from typing import Any

import numpy as np

from ...common.checks import Vector
from ...kernel.jit import select
from ...kernel.limits import TINY
from ...kernel.record import Record
from ...kernel.vector import Symmetric, Vec, absolute, cross, dot, largest, norm, square, times, total, vec
from .. import contract
from ..surface import side_sign
from ..time_of_impact.course import Quartic, level_and_window, rise_time_by, rise_time_inside
from ..time_of_impact.rising import Level, passage_of

# Newton's method for the chord doubles its digits from about h|v|/size of relative error: 3 sweeps at 1e-3, 7 at 1.
_CHORD_SWEEPS = 12


class MatrixColumns(Record):
    """The columns of a matrix."""

    x: Vec
    y: Vec
    z: Vec

    def solve(self, b):
        """Return the x with (this matrix) x = b."""
        across = cross(self.y, self.z)
        inverse = 1.0 / dot(self.x, across)
        return inverse * Vec(dot(across, b), dot(cross(self.z, self.x), b), dot(cross(self.x, self.y), b))


class QuadricNumbers(contract.Smooth):
    """The numbers of a quadric; it, or its waist, may be small compared with the distance where a flight begins."""

    center: Vec
    a: Vec  # the diagonal of A in the principal frame
    b: Any  # a Vec; None in an ellipsoid
    level: float
    scale: float  # the variation of q over the surface's size
    side: float

    def by_right_angles(self, axes: Any) -> Any:
        """Return the numbers of the quadric with these axes: other axes of the scene, or their opposites."""
        b = None if self.b is None else vec((axes @ np.array(self.b)).tolist())
        center, a = axes @ np.array(self.center), abs(axes) @ np.array(self.a)
        return self._replace(center=vec(center.tolist()), a=vec(a.tolist()), b=b)

    def linear(self, u):
        """b.u"""
        # Unlike 0.0, which changes -0.0, the compiler removes its addition.
        return -0.0 if self.b is None else dot(self.b, u)

    def tilted(self, u, k):
        """u + k b"""
        return u if self.b is None else u + k * self.b

    def discriminant(self, d, v, c, b, a):
        """b^2 - a c, also from afar, where d is long."""
        # = level v.A v + (b.v)^2/4 - w.(det A) A^-1 w + A v.(b x w) with w = d x v, Lagrange's identity; the form with
        # the smaller terms is used.
        w, along = cross(d, v), 0.5 * self.linear(v)
        u, s = turning(self.a, w), times(times(self.a, v), cross(self.b, w))
        from_afar = self.level * a + along * along - total(u) + total(s)
        u = absolute(u)
        terms = abs(self.level * a) + along * along + u.x + u.y + u.z + total(absolute(s))
        return select(terms < b * b + abs(a * c), from_afar, b * b - a * c)

    def level_window(self, c, d, v, pull):
        """Return (c, window); in the window the flight changes q by as much as q varies here.

        The window is infinite where the level is a parabola.
        """
        magnitude, tilt = absolute(self.a), absolute(times(self.b, d))
        terms = form(magnitude, d, d) + tilt.x + tilt.y + tilt.z
        size = select(terms > self.scale, terms, self.scale)
        moving, falling = form(magnitude, v, v), form(magnitude, pull, pull)
        # At the apex of a cone there is no size: it is the time after which the fall is as fast as the start.
        size = select(size > 0.0, size, moving * moving / falling)
        # A cone has no size of its own to which a distance could be large.
        own = select(self.scale > 0.0, self.scale, math.inf)
        level, window = level_and_window(c, own, size, moving, falling)
        window = select(abs(window) > 0.0, window, 1.0)
        return select(falling > 0.0, level, c), select(falling > 0.0, window, math.inf)

    def unit_along(self, n):
        """The unit vector along side n. At the apex of a cone, where n is 0, the answer is 0 and not NaN."""
        n2 = square(n)
        return n * (self.side / math.sqrt(select(n2 > TINY, n2, 1.0)))

    def parabola(self, r, v):
        """(c, b, a) of phi(r + v t) = c + 2 b t + a t^2."""
        b = form(self.a, r - self.center, v) + 0.5 * self.linear(v)
        return self.phi(r), b, form(self.a, v, v)

    def _step(self, r0, p, kappa):
        """Return D(r0, r1) and r1 - r0 of the step, and the widths 1/(1 + kappa A).

        With G = grad q(r0): D = (G + A p)/(1 + kappa A) and r1 - r0 = (p - kappa G)/(1 + kappa A).
        """
        g, w = self.gradient(r0), widths(self.a, kappa)
        return times(g + times(self.a, p), w), times(p - kappa * g, w), w

    degree = 2

    def reversible(self):
        return QuadricNumbers(*self)

    def phi(self, r):
        return self.inner(r) - self.level

    def gradient(self, r):
        return self.tilted(times(2.0 * self.a, r - self.center), 1.0)

    def hessian(self, r):
        a = self.a
        return Symmetric(a.x, a.y, a.z, 0.0, 0.0, 0.0)

    def inner(self, r):
        d = r - self.center
        return form(self.a, d, d) + self.linear(d)

    def gap_of(self, q):
        return self.side * (q - self.level)

    def distance(self, r):
        g2 = square(self.gradient(r))
        return self.gap_of(self.inner(r)) / math.sqrt(select(g2 > TINY, g2, TINY))

    def unit_normal(self, r):
        return self.unit_along(self.gradient(r))

    def project(self, r):
        g = self.gradient(r)
        g2 = square(g)
        return r - (self.phi(r) / select(g2 > TINY, g2, 1.0)) * g

    def outward_acceleration(self, r, v, pull):
        # (2 v.A v + grad q.G)/|grad q|
        g = self.gradient(r)
        g2 = square(g)
        return self.side * (2.0 * form(self.a, v, v) + dot(g, pull)) / math.sqrt(select(g2 > TINY, g2, 1.0))

    def first_hit(self, r, v):
        c, b, a = self.parabola(r, v)
        d = self.discriminant(r - self.center, v, c, b, a)
        return rise_time_by(self.side * c, self.side * b, self.side * a, d), True

    def course(self, r, v, pull):
        # phi(r + v t + G t^2/2), a quartic in t
        d, side = r - self.center, self.side
        c, b, a = self.parabola(r, v)
        a2 = a + form(self.a, d, pull) + 0.5 * self.linear(pull)
        a3, a4 = form(self.a, v, pull), 0.25 * form(self.a, pull, pull)
        c, window = self.level_window(c, d, v, pull)
        # The rest of a3 where G A G is below the smallest number would be infinite after an infinite time.
        curved = side * select(window < math.inf, 1.0, 0.0)
        return Quartic(side * c, side * b, side * a2, curved * a3, curved * a4, window)

    def out_of(self, r):
        # phi over its gradient is at most the distance where phi is convex.
        convex = min(self.a.x, self.a.y, self.a.z) >= 0.0
        steepness = norm(self.gradient(r))
        out = -self.gap_of(self.inner(r)) / select(steepness > 0.0, steepness, 1.0)
        return select(convex, out, 0.0)

    def gap_slope(self, q0, q1):
        return (self.side, 0.0)

    def discrete_gradient(self, r0, r1):
        # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
        return self.tilted(times(self.a, r0 + r1 - 2.0 * self.center), 1.0)

    def step_normal(self, r0, r1):
        return self.unit_along(self.discrete_gradient(r0, r1))

    def push(self, r0, p, kappa):
        a, d, f = self.a, r0 - self.center, self.tilted(p, -kappa)
        moved = Vec(_pushed(a.x, d.x, f.x, kappa), _pushed(a.y, d.y, f.y, kappa), _pushed(a.z, d.z, f.z, kappa))
        return self.center + moved

    def resolve(self, r, strength):
        # (1 + 2 strength A) s = r - strength b
        moved = self.tilted(r - self.center, -strength)
        return self.center + times(widths(self.a, 2.0 * strength), moved)

    def rise(self, r0, p, kappa):
        n, e, w = self._step(r0, p, kappa)
        # dr1/dkappa = -D/(1 + kappa A), and grad q(r1) = D + A (r1 - r0)
        return dot(n, e), -total(times(times(n + times(self.a, e), n), w))

    def turned_push(self, r0, p, kappa, tilt):
        return r0 + self._turned_step(kappa, tilt).solve(p - kappa * _tilted(self.gradient(r0), tilt))

    def turned_rise(self, r0, p, kappa, tilt):
        # (1 + kappa Q A) (r1 - r0) = p - kappa Q G with G = grad q(r0), and D = G + A (r1 - r0)
        step, g = self._turned_step(kappa, tilt), self.gradient(r0)
        e = step.solve(p - kappa * _tilted(g, tilt))
        bent = times(self.a, e)
        n = g + bent
        # dr1/dkappa = -(1 + kappa Q A)^-1 Q D, and grad q(r1) = D + A (r1 - r0)
        return dot(n, e), -dot(n + bent, step.solve(_tilted(n, tilt)))

    def _turned_step(self, kappa, tilt):
        """Return 1 + kappa Q A of the step of a wall that turns."""
        x, y, z = kappa * self.a
        return MatrixColumns(
            Vec(1.0 + x, -x * tilt.z, x * tilt.y), Vec(y * tilt.z, 1.0 + y, -y * tilt.x),
            Vec(-z * tilt.y, z * tilt.x, 1.0 + z),
        )  # fmt: skip

    def farthest_push(self):
        # The first pole of 1/(1 + kappa A) on the side to which the surface pushes
        side, a = self.side, self.a
        steepest = max(-side * a.x, -side * a.y, -side * a.z)
        return side * select(steepest > 0.0, 1.0 / select(steepest > 0.0, steepest, 1.0), math.inf)

    chord_sweeps = _CHORD_SWEEPS

    def chord_normal(self, r, p, kappa):
        n, _moved, _widths = self._step(r, p, kappa)
        return self.unit_along(n)

    # --- Walls that move other than uniformly ---

    def level_along(self, seen):
        n, most, side = self.inner_gradient(seen.r), largest(self.a), self.side
        q, bend = self.inner(seen.r), form(self.a, seen.v, seen.v) + 0.5 * dot(n, seen.a)
        half = 0.5 * side * dot(n, seen.v)
        if not self.has_core:
            return Level(self.level_of(q), half, side * bend, norm(n), most)
        # |grad q| <= 2 sqrt(A q), and 2 sqrt(L q) <= L + q
        level = abs(self.level)
        size, q = select(level > 0.0, level, 1.0), abs(q)
        steepness = (level + select(q > level, q, level)) * math.sqrt(most / size)
        return Level(self.level_of(self.inner(seen.r)), half, side * bend, steepness, most, False)

    def passage(self, r, v, swings):
        # In lengths |rho|^2 = rho.A rho
        d, magnitude = r - self.center, absolute(self.a)
        c, b, a = form(magnitude, d, d), form(magnitude, d, v), form(magnitude, v, v)
        return passage_of(c, b, a, self.side * self.level, math.sqrt(largest(self.a)), swings)

    def hessian_bounds(self, r):
        a, side = self.a, self.side
        return max(side * a.x, side * a.y, side * a.z), largest(a), math.inf


class ConvexQuadric(QuadricNumbers):
    """A convex cavity: the level along a straight flight has no maximum."""

    leaves_once = True
    has_core = property(lambda self: self.b is None)

    def first_hit(self, r, v):
        c, b, a = self.parabola(r, v)
        return rise_time_inside(self.side * c, self.side * b, self.side * a), True


def quadric_numbers(center: Vector, curvatures: Any, linear: Any, level: float, side: str) -> QuadricNumbers:
    """Return the numbers of a quadric in its principal frame."""
    a, b = vec(map(float, curvatures)), vec(map(float, linear))
    steepest = max(map(abs, a))
    scale = abs(level) + (square(b) / (4.0 * steepest) if steepest > 0.0 else 0.0)
    sign = side_sign(side)
    kind = ConvexQuadric if min(sign * a) >= 0.0 else QuadricNumbers
    return kind(vec(center), a, b, level, scale, sign)


def _tilted(n, tilt):
    """Q n = n - tilt x n"""
    return n - cross(tilt, n)


def form(a, u, v):
    """u.A v for the diagonal a of A."""
    return dot(times(a, u), v)


def widths(a, kappa):
    """1/(1 + kappa A) by one division."""
    x, y, z = 1.0 + kappa * a.x, 1.0 + kappa * a.y, 1.0 + kappa * a.z
    inverse = 1.0 / (x * y * z)
    return Vec(y * z * inverse, x * z * inverse, x * y * inverse)


def turning(a, w):
    """Return the terms of w.(det A) A^-1 w."""
    return times(times(Vec(a.y * a.z, a.x * a.z, a.x * a.y), w), w)


def _pushed(a, d, f, kappa):
    """One component of r1 = [(1 - kappa A) r0 + p - kappa b]/(1 + kappa A)."""
    return ((1.0 - kappa * a) * d + f) / (1.0 + kappa * a)

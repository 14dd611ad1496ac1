"""Ellipsoid: phi = q - 1, without unit; inner function q = x^2/a^2 + y^2/b^2 + z^2/c^2.

It is the quadric of quadratic.py without a linear term; this file has the methods that are shorter for it.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common.checks import Vector
from ...common.validated import Lengths
from ...kernel.jit import select
from ...kernel.vector import cross, norm, times, total, vec
from .. import rotation as rotations
from ..balls.egg import EggCavity, EggSolid
from ..balls.parallel import reach_by_distance
from ..surface import Box, Surface, box_around, extents, farthest, rotated_box, side_sign
from ..time_of_impact.course import level_and_window, rise_time_inside
from .quadratic import QuadricNumbers, form, turning, widths


@dataclass(frozen=True, repr=False)
class Ellipsoid(Surface):
    """An ellipsoid with axes along its own x, y, z; its cavity or the space around the solid.

    Args:
        semi_axes: three numbers > 0 [m].
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Ellipsoid(semi_axes=(0.5, 1.0, 2.0)).phi([[0.0], [0.0], [2.0]])
    array([0.])
    """

    nouns = ("ellipsoid", "egg", "ellipse", "oval")
    semi_axes: Lengths
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True

    def numbers(self) -> "EllipsoidNumbers":
        a = vec(1.0 / (axis * axis) for axis in self.semi_axes)
        kind = EllipsoidCavity if self.side == "inside" else EllipsoidNumbers
        return kind(vec(self.own_center()), a, None, 1.0, 1.0, side_sign(self.side))

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        center, squares = vec(self.own_center()), vec(axis * axis for axis in self.semi_axes)
        egg: Any = EggSolid(center, squares, 0.0) if self.is_solid() else EggCavity(center, squares, 0.0, self._bend())
        return (rotations.rotated(self.rotation, egg),)

    def largest_ball(self) -> float:
        return math.inf if self.is_solid() else self._bend()

    def _bend(self) -> float:
        """The smallest radius of curvature."""
        return min(self.semi_axes) ** 2 / max(self.semi_axes)

    def reaching_outside(
        self, points: NDArray[np.float64], radius: NDArray[np.float64], time: float = 0.0
    ) -> NDArray[np.float64]:
        return reach_by_distance(self, points, radius, time)

    def size(self) -> float:
        return min(self.semi_axes)

    def bounds(self) -> Box:
        box = box_around(self.center, self.semi_axes, self.side)
        return rotated_box(self.rotation, box, self.center)

    def enclosed(self, across: int | None) -> float | None:
        product = math.pi * math.prod(self.semi_axes)
        if across is None:
            return 4.0 / 3.0 * product
        # A section through the centre has pi a b c over the half extent along its normal.
        half = extents(rotations.matrix(self.rotation), self.semi_axes)[across]
        return product / half if self.center[across] == 0.0 else None

    def extent(self) -> float:
        return farthest(self.center) + max(self.semi_axes)


class EllipsoidNumbers(QuadricNumbers):
    """A quadric without a linear term, of level 1."""

    def reversible(self):
        return EllipsoidNumbers(*self)

    def discriminant(self, d, v, c, b, a):
        """b^2 - a c"""
        # = v.A v - w.(det A) A^-1 w with w = d x v, Lagrange's identity; near the wall the first form is better.
        return select(c > 1.0, a - total(turning(self.a, cross(d, v))), b * b - a * c)

    def level_window(self, c, d, v, pull):
        """(c, window)"""
        # Outside, the size is the distance: the flight may begin far from a solid.
        size = 1.0 + select(c > 0.0, c, 0.0)
        return level_and_window(c, 1.0, size, form(self.a, v, v), form(self.a, pull, pull))

    def unit_normal(self, r):
        # Without the test for an apex, which was a sixth of the time of an impact
        n = times(self.a, r - self.center)
        return n * (self.side / norm(n))

    def rise(self, r0, p, kappa):
        # s = r0 + r1 = (2 r0 + p)/(1 + kappa A) and e = r1 - r0 = (p - 2 kappa A r0)/(1 + kappa A): q1 - q0 = s.A e
        a, d, w = self.a, r0 - self.center, widths(self.a, kappa)
        s, e = times(2.0 * d + p, w), times(p - times((2.0 * kappa) * a, d), w)
        # dr1/dkappa = -A s/(1 + kappa A)
        return form(a, s, e), -2.0 * form(a, d + e, times(times(a, s), w))

    def chord_improve(self, r, p, kappa):
        # With m = r0 + r1 = (2 r0 + p)/(1 + kappa A), q1 = q0 reads f(kappa) = m.A m - 2 r0.A m = 0.
        a, d, w = self.a, r - self.center, widths(self.a, kappa)
        m = times(2.0 * d + p, w)
        # -f'(kappa)/2 = sum A^2 m (m - r0)/(1 + kappa A)
        slope = total(times(times(times(times(a, a), m), m - d), w))
        return -form(a, m, m - 2.0 * d) / (2.0 * slope)

    def chord_normal(self, r, p, kappa):
        # D(r0, r1) = A m
        n = times(times(self.a, 2.0 * (r - self.center) + p), widths(self.a, kappa))
        return n * (self.side / norm(n))


class EllipsoidCavity(EllipsoidNumbers):
    """A cavity: every flight in it meets the wall."""

    def first_hit(self, r, v):
        c, b, a = self.parabola(r, v)
        return rise_time_inside(c, b, a), True

    may_be_far = False
    leaves_once = has_core = True

"""Sphere: phi = |r - c| - R, the distance; inner function q = |r - c|^2."""

import math
from dataclasses import dataclass

import numpy as np

from ...common.checks import Vector
from ...common.validated import Length
from ...kernel.jit import select
from ...kernel.vector import ZERO, Vec, absolute, dot, highest, norm, square, total, vec
from ..area_samples import AreaSample, Region, directions
from ..surface import Box, Surface, box_around, farthest, is_on_axis, side_sign
from ..time_of_impact.course import Quartic, ball_rise_time, level_and_window, rise_time, rise_time_inside
from ..time_of_impact.rising import Bounds, Level, passage_of
from .common import Distance, ExactChord

# How often the time in which a fall is bounded is tried.
_TRIALS = 3


@dataclass(frozen=True, repr=False)
class Sphere(Surface):
    """A sphere; its cavity (`side="inside"`) or the space around the solid ball (`side="outside"`).

    Args:
        radius: R > 0 [m].
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Sphere(radius=0.5).phi([[0.0], [0.3], [0.4]])
    array([0.])
    """

    nouns = ("sphere", "ball", "circle", "disc")
    radius: Length
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True

    def numbers(self) -> "SphereNumbers":
        side = side_sign(self.side)
        kind = SphereCavity if self.side == "inside" else SphereNumbers
        return kind(vec(self.center), self.radius, self.radius**2, side / self.radius, side)

    def walls(self) -> tuple["SphereNumbers"]:
        return (self.numbers(),)  # for any rotation

    def largest_ball(self) -> float:
        return math.inf if self.is_solid() else self.radius

    def size(self) -> float:
        return self.radius

    def bounds(self) -> Box:
        return box_around(self.center, (self.radius,) * 3, self.side)

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return is_on_axis(self.center, axis, center)

    def extent(self) -> float:
        return farthest(self.center) + self.radius

    def radius_of_ball(self) -> float | None:
        return self.radius

    def enclosed(self, across: int | None) -> float | None:
        if across is None:
            return 4.0 / 3.0 * math.pi * self.radius**3
        return math.pi * self.radius**2 if self.center[across] == 0.0 else None

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        if across is not None:
            return super().area_samples(bounds, across)
        center, radius = np.array(self.center)[:, None], self.radius
        return [AreaSample(4.0 * math.pi * radius**2, lambda random, n: center + radius * directions(random, n))]


def _risen(d, p):
    """Return 2 d.p, and |d + p|^2 - |d|^2."""
    dp = 2.0 * dot(d, p)
    return dp, dp + p.x * p.x + p.y * p.y + p.z * p.z


class SphereNumbers(Distance, ExactChord):
    """The numbers of a sphere; a ball may be small compared with the distance where a flight begins."""

    center: Vec
    radius: float
    radius2: float
    curvature: float  # side/R
    side: float

    degree = 2

    def polynomial(self, r):
        return self.inner(r) - self.radius2

    def reversible(self):
        return SphereNumbers(*self)

    def grown(self, radius):
        width = self.radius - self.side * radius
        return self._replace(radius=width, radius2=width * width, curvature=self.side / width)

    def inner(self, r):
        return square(r - self.center)

    def inner_gradient(self, r):
        return 2.0 * (r - self.center)

    def unit_normal(self, r):
        return (r - self.center) * self.curvature

    def gap_scale(self, r):
        # |grad g| = 1
        return total(absolute(r))

    def project(self, r):
        d = r - self.center
        # 1/(2 R^2)
        k = 0.5 * self.curvature * self.curvature
        return r - ((square(d) - self.radius2) * k) * d

    def may_reach(self, low, high):
        return square(highest(highest(low - self.center, self.center - high), ZERO)) <= self.radius2

    def outward_acceleration(self, r, v, pull):
        # |v|^2/R + n.G
        return self.curvature * (square(v) + dot(r - self.center, pull))

    def first_hit(self, r, v):
        return ball_rise_time(self.side, self.radius2, r - self.center, v), True

    def course(self, r, v, pull):
        # |r + v t + G t^2/2 - c|^2 - R^2, a quartic in t
        d, side = r - self.center, self.side
        c, b, a, gg = square(d) - self.radius2, dot(d, v), square(v), square(pull)
        a2 = a + d.x * pull.x + d.y * pull.y + d.z * pull.z
        # Outside, the size is the distance: the flight may begin far from a ball.
        size = self.radius2 + select(c > 0.0, c, 0.0)
        c, window = level_and_window(c, self.radius2, size, a, gg)
        return Quartic(side * c, side * b, side * a2, side * dot(v, pull), side * 0.25 * gg, window)

    def reach(self, lease):
        # |d + v t| = R -+ width t, where the width includes the fall up to a time
        d, side, weight = lease.r - self.center, self.side, norm(lease.a)
        c, b, a = side * (square(d) - self.radius2), side * dot(d, lease.v), square(lease.v)
        time, within = 0.0, lease.longest
        for _k in range(_TRIALS):
            width = lease.width + 0.5 * weight * within
            found = rise_time(c, b + self.radius * width, side * (a - width * width))
            time = max(time, min(found, within))
            if not time < within or weight == 0.0:
                break
            within = math.sqrt(time * within)
        return time

    def discrete_gradient(self, r0, r1):
        # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
        return r0 + r1 - 2.0 * self.center

    def push(self, r0, p, kappa):
        # r1 = [(1 - kappa) r0 + p]/(1 + kappa), relative to the centre
        w = 1.0 / (1.0 + kappa)
        u = (1.0 - kappa) * w
        return self.center + ((r0 - self.center) * u + p * w)

    def rise(self, r0, p, kappa):
        # r0 + r1 = (2 r0 + p)/(1 + kappa) and r1 - r0 = (p - 2 kappa r0)/(1 + kappa), relative to the centre, so
        # q1 - q0 = [2 r0.p + p.p - kappa (4 q0 + 2 r0.p)]/(1 + kappa)^2
        d = r0 - self.center
        q0 = square(d)
        dp, free = _risen(d, p)
        fall = 4.0 * q0 + dp
        w = 1.0 / (1.0 + kappa)
        risen = (free - kappa * fall) * w * w
        # q1 >= 0, even by round-off.
        return select(risen > -q0, risen, -q0), -w * (2.0 * risen + w * fall)

    def resolve(self, r, strength):
        w = 1.0 / (1.0 + 2.0 * strength)
        return self.center + w * (r - self.center)

    def chord_guess(self, r, p):
        # q1 = q0 is linear in kappa: kappa = (2 r0.p + p.p)/(4 q0 + 2 r0.p)
        dp, free = _risen(r - self.center, p)
        return free / (4.0 * self.radius2 + dp)

    def chord_normal(self, r, p, kappa):
        # r1 = [(1 - kappa) r0 + p]/(1 + kappa), so r0 + r1 is parallel to 2 r0 + p for any kappa.
        n = 2.0 * (r - self.center) + p
        return n * (self.side / norm(n))

    # --- Walls that move other than uniformly ---

    def hessian_bounds(self, r):
        # H = 1
        return (self.side, 1.0, math.inf)

    def level_along(self, seen):
        d, side = seen.r - self.center, self.side
        q, bend = square(d), square(seen.v) + dot(d, seen.a)
        return Level(side * (q - self.radius2), side * dot(d, seen.v), side * bend, *self._steepness(q))

    def _steepness(self, q):
        """Return |grad q|, the magnitude of H, and whether |grad q| may grow before a flight meets the wall."""
        return 2.0 * math.sqrt(q), 1.0, True

    def bounds_along(self, seen, within):
        # In a frame that moves with the centre and does not turn
        drive = seen.drive
        spin, arm = drive.angular_speed(), norm(self.center - drive.center)
        return Bounds(
            seen.fastest(within) + spin * arm,
            seen.hardest() + spin * spin * arm,
            drive.jerk + spin * spin * spin * arm,
        )


class SphereCavity(SphereNumbers):
    """A cavity: every flight in it meets the wall."""

    def first_hit(self, r, v):
        # |d + v t|^2 - R^2 = c + 2 b t + |v|^2 t^2
        d = r - self.center
        return rise_time_inside(square(d) - self.radius2, dot(d, v), square(v)), True

    def _steepness(self, q):
        # 2 R |d| <= R^2 + |d|^2: no square root
        return (self.radius2 + select(q > self.radius2, q, self.radius2)) * self.curvature, 1.0, False

    def passage(self, r, v, swings):
        d = r - self.center
        return passage_of(square(d), dot(d, v), square(v), self.radius2, 1.0, swings)

    may_be_far = False
    leaves_once = True
    has_core = proves = True


def ball(center, radius):
    """Return the numbers of a solid sphere."""
    return SphereNumbers(center, radius, radius * radius, -1.0 / radius, -1.0)


def cavity(center, radius):
    """Return the numbers of a spherical cavity."""
    return SphereCavity(center, radius, radius * radius, 1.0 / radius, 1.0)

"""The numbers of formulas that are polynomials of degree 4 at most: their flights by exact coefficients."""

import math
from typing import Any

from ...kernel.gravity import Gravity, accelerated, as_vector, displacement, rise_time_by, rise_time_inside
from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.vector import absolute, dot, norm, square, total
from ..curvature import applied
from ..time_of_impact.approach import AimedApproach, Approach, LevelBound
from ..time_of_impact.course import Quartic, first_rise, level_and_window
from ..time_of_impact.looks import FallToBox, falling
from ..time_of_impact.polynomial import ConvexFlight, PolynomialFall, PolynomialFlight
from .numbers import OwnNumbers, SmoothCavity, SmoothSolid

# The first step is at most this many sizes long, by the sum of the components of the velocity: about the longest chord.
_WINDOW = 2.8
# A root at the start is divided out of a level up to this part of the other terms, which is round-off.
_ROUND_OFF = 1e-13
# A step of Newton's method is taken where it changes the slope, and the time, by at most this part of each.
_REFINED = 1e-4
# b^2 - a c has lost digits where it is less than this part of b^2.
_CANCELS = 1.0 / 64.0


class PolynomialNumbers(OwnNumbers):
    """A polynomial phi of degree 4 at most. Subclasses are a cavity, or a solid with a box that holds it."""

    is_solid = False

    def along(self, r, v):
        """Return the coefficients of phi(r + v t) by powers of t: three, or five."""
        raise NotImplementedError

    def along_fall(self, r, v, half_pull):
        """Return the coefficients of phi(r + v t + G t^2/2) of degree 3 or 4: seven, or nine."""
        raise NotImplementedError

    def level_from(self, r, v):
        """Return (start, end, the level's coefficients from the start on) of the near part of a straight flight."""
        side = self.side
        if not self.is_solid:
            return None, None, tuple(side * one for one in self.along(r, v))
        start, end = self._in_box(r, v)
        here = select(start < math.inf, start, 0.0)
        return start, end, tuple(side * one for one in self.along(r + here * v, v))

    def refined(self, gravity, r, v, time):
        # One step of Newton's method
        t = select(time < math.inf, time, 0.0)
        place, velocity = r + displacement(gravity, v, t), accelerated(gravity, v, t)
        c, twice_b, a2 = self.along(place, velocity)[:3]
        if gravity is not None:
            a2 = a2 + 0.5 * dot(self.gradient(place), as_vector(gravity))
        change = c / select(twice_b == 0.0, 1.0, twice_b)
        small = (abs(change * a2) <= _REFINED * abs(twice_b)) & (abs(change) <= _REFINED * time)
        return time - select(small, change, 0.0)


class QuadraticCavity(PolynomialNumbers):
    """A polynomial of degree 2."""

    def first_hit(self, r, v):
        start, end, (c, twice_b, a) = self.level_from(r, v)
        b = 0.5 * twice_b
        d = b * b - a * c
        if self.is_solid:
            time = start + rise_time_by(c, b, a, d)
            return self.refined(None, r, v, select((start <= end) & (time <= end), time, math.inf)), True
        # From afar d has few digits; the level half way between both roots is -d/a.
        middle = -b / select(a < 0.0, a, 1.0)
        far = (a < 0.0) & (abs(d) < _CANCELS * b * b) & (middle < math.inf)
        there = self.side * self.phi(r + select(far, middle, 0.0) * v)
        return self.refined(None, r, v, rise_time_by(c, b, a, select(far, -a * there, d))), True

    def course(self, r, v, pull):
        # phi(r + v t + G t^2/2) with H, which is constant
        side, h = self.side, self.hessian(r)
        c, twice_b, a2 = self.along(r, v)
        _c, along_pull, pull2 = self.along(r, pull)
        most = max(abs(self.bends.least), abs(self.bends.most))
        own, falling = most * self.size * self.size, most * square(pull)
        is_curved, size = falling > 0.0, select(abs(c) > own, abs(c), own)
        size = select(size > 0.0, size, 1.0)
        level, window = level_and_window(c, own, size, most * square(v), select(is_curved, falling, 1.0))
        curved = select(is_curved, side, 0.0)
        return Quartic(
            select(is_curved, side * level, side * c),
            0.5 * side * twice_b,
            side * (a2 + 0.5 * along_pull),
            curved * dot(applied(h, v), pull),
            0.25 * curved * pull2,
            select(is_curved, window, math.inf),
        )


class QuadraticSolid(QuadraticCavity):
    """A solid with a polynomial of degree 2."""

    is_solid = True
    # Outside its box there is no wall, for any value of phi: the level along a fall is no quartic.
    is_quartic = False
    looked_at = True
    falls = FallToBox
    falling_hit = SmoothSolid.falling_hit

    def steps(self, gravity, r, v):
        return None if gravity is None else falling(self, as_vector(gravity), r, v)


class ConvexQuadraticCavity(QuadraticCavity):
    """A convex cavity: the level along a flight has no maximum, and the root of a long flight loses no digits."""

    def first_hit(self, r, v):
        c, twice_b, a = self.along(r, v)
        return rise_time_inside(self.side * c, 0.5 * self.side * twice_b, self.side * a), True


class QuarticCavity(PolynomialNumbers):
    """A polynomial of degree 3 or 4."""

    in_steps = True
    kept = 5
    aims = True
    flight = PolynomialFlight

    @outlined
    def first_hit(self, r, v):
        time, found = first_rise(self.steps(None, r, v))
        return self.refined(None, r, v, time), found

    def falling_hit(self, r, v, pull):
        gravity = Gravity(pull.x, pull.y, pull.z)
        time, found = self.hit_by_steps(gravity, r, v)
        return (self.refined(gravity, r, v, time) if self.fall_powers > 0 else time), found

    def steps(self, gravity, r, v):
        if gravity is not None:
            return AimedApproach(self, gravity, r, v) if self.fall_powers > 0 else Approach(self, gravity, r, v)
        start, end, (c, twice_b, a2, a3, a4) = self.level_from(r, v)
        speed = total(absolute(v))
        window = _WINDOW * self.size / select(speed > 0.0, speed, 1.0)
        # From the wall inwards
        rest = window * (abs(twice_b) + window * (abs(a2) + window * (abs(a3) + window * abs(a4))))
        leaves = (twice_b < 0.0) & (c >= -_ROUND_OFF * rest)
        return self.flight(
            select(leaves, twice_b, c),
            0.5 * select(leaves, a2, twice_b),
            select(leaves, a3, a2),
            select(leaves, a4, a3),
            select(leaves, 0.0, a4),
            start,
            end,
            window,
        )

    def fall(self, gravity, r, v):
        """Return the level along a fall, for a guess of the hit."""
        near = self.near(gravity, r, v)
        powers = near.c, 2.0 * near.b, near.a2, *near.higher
        rest = 0.0
        for a in reversed(powers[1:]):
            rest = near.window * (abs(a) + rest)
        # From the wall inwards
        leaves = (near.b < 0.0) & (near.c >= -_ROUND_OFF * rest)
        inward = *powers[1:], 0.0
        powers = tuple(select(leaves, b, a) for a, b in zip(powers, inward, strict=True))
        return PolynomialFall(powers, 0.5 * near.window)

    def near(self, gravity, r, v):
        pull, size = as_vector(gravity), self.size
        level = tuple(self.side * one for one in self.along_fall(r, v, 0.5 * pull))
        window = 2.0 * math.sqrt(size * size / (square(v) + size * norm(pull)))
        # The level that remains may be as much as a rounding of the place changes it.
        nearly = EPSILON * self.gap_scale(r)
        return LevelBound(level[0], 0.5 * level[1], level[2], level[3:], window, nearly, True)


class ConvexQuarticCavity(QuarticCavity):
    """A cavity that is convex at the sampled points."""

    flight = ConvexFlight


class QuarticSolid(QuarticCavity):
    """A solid with a polynomial of degree 3 or 4."""

    is_solid = True
    kept = 7
    aims = False

    def near(self, gravity, r, v):
        # Outside its box there is no wall, for any value of phi: a fall reaches each face that it is beyond.
        level = QuarticCavity.near(self, gravity, r, v)
        face, beyond = self.last_face(r, v, as_vector(gravity))
        return level._replace(
            c=select(beyond, face.c, level.c), b=select(beyond, face.b, level.b), a2=select(beyond, face.a2, level.a2),
            higher=tuple(select(beyond, 0.0, one) for one in level.higher),
            window=select(beyond, math.inf, level.window), meets=not beyond,
        )  # fmt: skip


def base_of(along: Any, is_solid: bool, is_convex: bool) -> Any:
    """Return the class of numbers of a formula with these coefficients along a flight, None if it is no polynomial."""
    if along is None:
        cavity, solid = SmoothCavity, SmoothSolid
    elif along.degree <= 2:
        cavity, solid = ConvexQuadraticCavity if is_convex else QuadraticCavity, QuadraticSolid
    else:
        cavity, solid = ConvexQuarticCavity if is_convex else QuarticCavity, QuarticSolid
    return solid if is_solid else cavity

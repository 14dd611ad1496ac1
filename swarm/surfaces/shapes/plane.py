"""Plane: phi = n.(r) - offset, the signed distance; inner function q = n.r."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...common.checks import Vector
from ...common.validated import Number
from ...kernel.jit import select
from ...kernel.vector import Vec, dot, vec
from ..rotation import Direction, turned
from ..surface import UNBOUNDED, Box, HalfSpace, Surface, is_along
from ..time_of_impact.course import rise_time
from ..time_of_impact.rising import CORE, Level, Passage
from .common import ExactChord


@dataclass(frozen=True, repr=False)
class Plane(Surface):
    """A plane wall; admissible is normal.r <= offset, with the normal scaled to unit length.

    Args:
        normal: three numbers, not all 0; it points out of the admissible half-space.
        offset: distance of the plane from the origin along the normal [m].

    Raises:
        SceneError: an argument is out of its range.

    >>> Plane(normal=(0, 0, -2), offset=0.0).phi([[0.0], [0.0], [0.25]])
    array([-0.25])
    """

    nouns = ("plane", "plane", "line", "line")
    normal: Direction
    offset: Number = 0.0

    is_convex = True

    def numbers(self) -> "PlaneNumbers":
        return PlaneNumbers(vec(turned(self.rotation, self.normal)), self.offset)

    def walls(self) -> tuple["PlaneNumbers"]:
        return (self.numbers(),)

    def size(self) -> float:
        return math.inf

    def bounds(self) -> Box:
        # Half-spaces bound a volume only together: scene.py does that.
        return UNBOUNDED

    def half_spaces(self) -> list[HalfSpace]:
        return [(turned(self.rotation, self.normal), self.offset)]

    def beyond(self) -> str:
        return "beyond"

    def admissible(self, phi: float) -> str:
        here = f", and normal.r = {phi + self.offset:.6g} m there is more than {self.offset:.6g} m"
        return "admissible is normal.r <= offset" + (here if self.motion is None else "")

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return is_along(turned(self.rotation, self.normal), axis)

    def extent(self) -> float:
        return abs(self.offset)


class Flat(ExactChord):
    """A plane or a part of it, with the fields of `PlaneNumbers`: the methods that do not depend on its edges."""

    if TYPE_CHECKING:
        normal: Any
        offset: Any

    side = 1.0

    def phi(self, r):
        return self.inner(r) - self.offset

    def gradient(self, r):
        return self.normal

    unit_normal = gradient

    def inner(self, r):
        return dot(self.normal, r)

    def gap_of(self, q):
        return q - self.offset

    def gap_slope(self, q0, q1):
        return (1.0, 0.0)

    def project(self, r):
        return r - (self.inner(r) - self.offset) * self.normal

    def outward_acceleration(self, r, v, pull):
        return dot(self.normal, pull)

    flat = True

    def flat_normal(self):
        return self.normal

    def level_along(self, seen):
        n = self.normal
        return Level(dot(n, seen.r) - self.offset, 0.5 * dot(n, seen.v), 0.5 * dot(n, seen.a), 1.0, 0.0)

    def discrete_gradient(self, r0, r1):
        return self.normal

    gap_gradient = step_normal = discrete_gradient

    def push(self, r0, p, kappa):
        return r0 + (p - kappa * self.normal)

    def rise(self, r0, p, kappa):
        return (dot(self.normal, p) - kappa, -1.0)

    def resolve(self, r, strength):
        return r - strength * self.normal

    def farthest_push(self):
        return math.inf

    def chord_guess(self, r, p):
        return dot(self.normal, p)

    def chord_normal(self, r, p, kappa):
        return self.normal


class PlaneNumbers(Flat):
    """The numbers of a plane."""

    normal: Vec
    offset: float

    leaves_once = has_core = True
    degree = 1

    def passage(self, r, v, swings):
        place, u, (depth, speed) = dot(self.normal, r), dot(self.normal, v), swings.along(self.normal)
        c = (place - self.offset) + depth + (1.0 - CORE) * (abs(place) + abs(self.offset))
        moves = abs(u) > 0.0
        inverse = select(moves, 1.0 / select(moves, u, 1.0), 0.0)
        # A flight along the plane is at it for ever, or never.
        enters, leaves = select(u < 0.0, -c * inverse, -math.inf), select(u > 0.0, -c * inverse, math.inf)
        enters = select(moves | (c < 0.0), enters, math.inf)
        hits = select(u > 0.0, (self.offset - place) * inverse, math.inf)
        # A particle faster than the wall approaches it all the time, or leaves it.
        return Passage(enters, leaves, hits, CORE * abs(u) > speed)

    def reversible(self):
        return self if type(self) is PlaneNumbers else None

    def grown(self, radius):
        return self._replace(offset=self.offset - radius)

    def first_hit(self, r, v):
        approach = dot(self.normal, v)
        time = (self.offset - self.inner(r)) / approach
        return select(approach > 0.0, select(time > 0.0, time, 0.0), math.inf), True

    def falling_hit(self, r, v, pull):
        c = self.inner(r) - self.offset
        return rise_time(c, 0.5 * dot(self.normal, v), 0.5 * dot(self.normal, pull)), True

    def safe_time(self, r, v, pull):
        time, _found = self.falling_hit(r, v, pull)
        return select(self.inner(r) > self.offset, 0.0, time)

    def out_of(self, r):
        return -self.gap_of(self.inner(r))

    def reach(self, lease):
        n = self.normal
        rise = 0.5 * (dot(n, lease.v) + lease.width_along(n))
        return rise_time(dot(n, lease.r) - self.offset, rise, 0.5 * dot(n, lease.a))

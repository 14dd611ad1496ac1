"""Slab: phi = |n.(r - c)| - h, the distance; inner function q = (n.(r - c))^2: the sphere of one dimension."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.checks import Vector
from ...common.validated import Length
from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import Vec, dot, vec
from ..rotation import Direction, turned
from ..surface import TILT, Box, HalfSpace, Surface, box_around, farthest, is_along, side_sign
from ..time_of_impact.course import rise_time
from ..time_of_impact.rising import CORE, Between, Level, Passage, level_step
from .common import Distance, ExactChord


@dataclass(frozen=True, repr=False)
class Slab(Surface):
    """Two parallel walls; the space between them or, `side="outside"`, the space around a plate.

    Args:
        normal: three numbers, not all 0; across the walls.
        half_width: h > 0 [m], from the middle to each wall.
        center: three numbers [m], a point of the middle.
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Slab(normal=(0, 0, 1), half_width=0.25).phi([[7.0], [0.0], [-0.5]])
    array([0.25])
    """

    nouns = ("pair of planes", "slab", "strip", "bar")
    normal: Direction
    half_width: Length
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True

    def numbers(self) -> "SlabNumbers":
        return slab_numbers(turned(self.rotation, self.normal), self.half_width, self.center, side_sign(self.side))

    def walls(self) -> tuple["SlabNumbers"]:
        return (self.numbers(),)

    def size(self) -> float:
        return self.half_width

    def bounds(self) -> Box:
        # A plate reaches h along its normal, and infinitely far along any other direction.
        nx, ny, nz = turned(self.rotation, self.normal)
        tilts = math.hypot(ny, nz), math.hypot(nz, nx), math.hypot(nx, ny)
        hx, hy, hz = (self.half_width if tilt <= TILT else math.inf for tilt in tilts)
        return box_around(self.center, (hx, hy, hz), self.side)

    def half_spaces(self) -> list[HalfSpace]:
        if self.is_solid():
            return []
        x, y, z = turned(self.rotation, self.normal)
        middle = x * self.center[0] + y * self.center[1] + z * self.center[2]
        return [((x, y, z), self.half_width + middle), ((-x, -y, -z), self.half_width - middle)]

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return is_along(turned(self.rotation, self.normal), axis)

    def extent(self) -> float:
        return farthest(self.center) + self.half_width


# --- The normal: along an axis it costs no multiplication ------------------------------------------------

# So each axis is a class of its own: with a vector for every normal an impact in a box takes half as long again, and a
# third longer in a fall that loses energy.


class Along(Record):
    """An axis of the scene as a unit vector; its class says which axis."""

    length: float  # 1

    axis = 0

    def part(self, r):
        """The component of a vector along the axis."""
        return r[self.axis]

    def scaled(self, k):
        """The axis times a number."""
        return Vec(*(k if i == self.axis else 0.0 for i in range(3)))


class AlongX(Along):
    """The x axis."""


class AlongY(Along):
    """The y axis."""

    axis = 1


class AlongZ(Along):
    """The z axis."""

    axis = 2


AXES: tuple[Any, ...] = (AlongX, AlongY, AlongZ)
Normal = Vec | AlongX | AlongY | AlongZ


def normal_of(vector: Sequence[float]) -> Any:
    """Return the normal of `SlabNumbers` from a unit vector: its opposite is as good along an axis."""
    for axis, others in zip(AXES, ((1, 2), (2, 0), (0, 1)), strict=True):
        if not any(vector[k] for k in others):
            return axis(1.0)
    return vec(vector)


# --- The numbers -----------------------------------------------------------------------------------------


class SlabNumbers(Distance, ExactChord):
    """The numbers of a slab."""

    normal: Normal
    offset: float  # n.c
    radius: float  # the half width
    radius2: float
    side: float

    degree = 2

    def polynomial(self, r):
        return self.inner(r) - self.radius2

    def along(self, a):
        """n.a"""
        return dot(self.normal, a) if isinstance(self.normal, Vec) else self.normal.part(a)

    def scaled(self, k):
        """k n"""
        return k * self.normal if isinstance(self.normal, Vec) else self.normal.scaled(k)

    def off(self, r):
        """The signed distance from the middle."""
        return self.along(r) - self.offset

    def gradient(self, r):
        return self.scaled(np.copysign(1.0, self.off(r)))

    def inner(self, r):
        d = self.off(r)
        return d * d

    def inner_gradient(self, r):
        return self.scaled(2.0 * self.off(r))

    def unit_normal(self, r):
        return self.scaled(math.copysign(1.0, self.side * self.off(r)))

    def project(self, r):
        d = self.off(r)
        return r - self.scaled(d - math.copysign(self.radius, d))

    def outward_acceleration(self, r, v, pull):
        return dot(self.unit_normal(r), pull)

    flat = True

    def flat_normal(self):
        return self.scaled(1.0)

    leaves_once = property(lambda self: self.side > 0.0)  # type: ignore[assignment]

    def first_hit(self, r, v):
        d, u = self.off(r), self.along(v)
        # Between the walls the wall ahead; outside of them the wall on the side where the flight comes from
        time = (self.side * math.copysign(self.radius, u) - d) / u
        meets = select(self.side > 0.0, abs(u), -d * u) > 0.0
        return select(meets, select(time > 0.0, time, 0.0), math.inf), True

    def falling_hit(self, r, v, pull):
        near, _found = self.entry(pull, r, v)
        d = self.off(r)
        sign = math.copysign(0.5, d)
        b, a = sign * self.along(v), sign * self.along(pull)
        # Between the walls the far one too
        far = rise_time(-abs(d) - self.radius, -b, -a)
        return select((self.side > 0.0) & (far < near), far, near), True

    def entry(self, gravity, r, v):
        if gravity is None:
            return self.first_hit(r, v)
        # The wall on the side where a fall begins, which for a plate is the only one: a plane
        d = self.off(r)
        sign = math.copysign(0.5, d)
        b, a = sign * self.along(v), sign * self.along(gravity)
        return rise_time(self.side * (abs(d) - self.radius), self.side * b, self.side * a), True

    def safe_time(self, r, v, pull):
        time, _found = self.falling_hit(r, v, pull)
        return select(self.distance(r) > 0.0, 0.0, time)

    def reach(self, lease):
        x, u, a = self.off(lease.r), self.along(lease.v), 0.5 * self.along(lease.a)
        width = lease.width if lease.axis is None else lease.width * abs(self.along(lease.axis))
        # To the wall on either side; of a plate the particle is on one side.
        up = rise_time(self.side * (x - self.radius), 0.5 * (self.side * u + width), self.side * a)
        down = rise_time(self.side * (-x - self.radius), 0.5 * (-self.side * u + width), -self.side * a)
        outside = select(x > 0.0, up, down)
        return select(self.side > 0.0, min(up, down), outside)

    def discrete_gradient(self, r0, r1):
        # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
        return self.scaled(self.off(r0) + self.off(r1))

    def gap_gradient(self, r0, r1):
        # (|s1| - |s0|)/(s1 - s0) = (s0 + s1)/(|s0| + |s1|), which is 1 or -1 exactly on one side of the middle
        s0, s1 = self.off(r0), self.off(r1)
        both = abs(s0) + abs(s1)
        return self.scaled(self.side * (s0 + s1) / select(both > 0.0, both, 1.0))

    def step_normal(self, r0, r1):
        return self.unit_normal(r0)

    def push(self, r0, p, kappa):
        # r1 = r0 + p - kappa (s0 + s1) n
        k = kappa * (2.0 * self.off(r0) + self.along(p)) / (1.0 + kappa)
        return r0 + (p - self.scaled(k))

    def rise(self, r0, p, kappa):
        # q1 - q0 = (s0 + s1)(s1 - s0), and ds1/dkappa = -(s0 + s1)/(1 + kappa)
        d, u = self.off(r0), self.along(p)
        w = 1.0 / (1.0 + kappa)
        both, change = (2.0 * d + u) * w, (u - 2.0 * kappa * d) * w
        risen = both * change
        # q1 >= 0, even by round-off.
        return select(risen > -d * d, risen, -d * d), -2.0 * (d + change) * both * w

    def resolve(self, r, strength):
        return r - self.scaled(2.0 * strength / (1.0 + 2.0 * strength) * self.off(r))

    def chord_guess(self, r, p):
        # q1 = q0 with s0 + s1 = (2 s0 + p)/(1 + kappa) and s1 - s0 = (p - 2 kappa s0)/(1 + kappa)
        return 0.5 * self.along(p) / self.off(r)

    def chord_normal(self, r, p, kappa):
        d = 2.0 * self.off(r) + self.along(p)
        return self.scaled(math.copysign(1.0, self.side * d))

    # --- Walls that move other than uniformly ---

    def hessian_bounds(self, r):
        # H = n n^T
        return (select(self.side > 0.0, 1.0, 0.0), 1.0, math.inf)

    @property
    def has_levels(self):
        # Between its planes; a solid has one plane.
        return self.side > 0.0

    def level_along(self, seen):
        # The levels of both planes: a bound of the third derivative of the square would be ten times as wide.
        half = 0.5 * self.along(seen.v)
        x, bend = self.off(seen.r), 0.5 * self.along(seen.a)
        # Without a speed the nearer plane is the one behind, which the particle leaves.
        sign = math.copysign(1.0, select(half == 0.0, -x, half))
        return Between(sign * x, abs(half), sign * bend, self.radius)

    has_core = proves = True

    def passage(self, r, v, swings):
        x, u = self.off(r), self.along(v)
        moves, (depth, speed) = abs(u) > 0.0, swings.along(self.scaled(1.0))
        inverse = select(moves, 1.0 / select(moves, u, 1.0), 0.0)
        middle, width = -x * inverse, CORE * self.radius - depth
        inverse = abs(inverse)
        half, hits = select(width > 0.0, width, 0.0) * inverse, middle + self.radius * inverse
        # Outwards from beyond the mean wall the hit is some time later, if at all: a guess.
        hits = select(moves, select(hits > 0.0, hits, hits + depth * inverse), math.inf)
        # A particle faster than the wall approaches one plane all the time, and recedes from the second.
        return Passage(middle - half, middle + half, hits, CORE * abs(u) > speed)

    def moving_step(self, seen, longest):
        x, side = self.off(seen.r), self.side
        sign = select(x > 0.0, 1.0, -1.0)
        x, half, bend = sign * x, 0.5 * sign * self.along(seen.v), 0.5 * sign * self.along(seen.a)
        near = Level(side * (x - self.radius), side * half, side * bend, 1.0, 0.0)
        near = level_step(self, seen, near, longest)
        far = level_step(self, seen, Level(-x - self.radius, -half, -bend, 1.0, 0.0), longest)
        return near._replace(time=select((side > 0.0) & (far.time < near.time), far.time, near.time))


def slab_numbers(normal: Vector, half: float, center: Vector, side: float) -> SlabNumbers:
    """Return the numbers of a slab across the unit vector `normal`, as seen in the scene."""
    made = SlabNumbers(normal_of(normal), 0.0, half, half * half, side)
    return made._replace(offset=float(made.along(vec(center))))

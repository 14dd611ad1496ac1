"""Capsule: phi = sqrt(q) - R, the distance; q, the inner function, is the squared distance to a segment along z."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...checks import Vector, at_least, length
from ...kernel.jit import inlined, select
from .. import base, smooth
from ..course import ball_rise_time
from .revolved import Revolved


@dataclass(frozen=True, repr=False)
class Capsule(Revolved):
    """All points within `radius` of a segment: a cylinder with half spheres as its ends.

    Args:
        radius: R [m].
        length: of the segment [m], from the middle of one half sphere to the other's, 0 or more.
        axis: along the segment before it is rotated; three numbers, not all 0.
        center: the middle of the segment, three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Capsule(radius=0.5, length=1.0).phi([[0.0], [0.0], [1.0]])
    array([0.])
    """

    radius: float
    length: float
    axis: Vector = (0.0, 0.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "radius", length("radius", self.radius))
        object.__setattr__(self, "length", at_least("length", self.length, 0.0))

    def numbers(self) -> "CapsuleNumbers":
        return CapsuleNumbers(*self.own_center(), self.radius, 0.5 * self.length, base.side_sign(self.side))

    def size(self) -> float:
        return self.radius

    def bounds(self) -> base.Box:
        rx, ry, rz = (self.radius + 0.5 * self.length * abs(part) for part in self.direction())
        return base.box_around(self.center, (rx, ry, rz), self.side)

    def extent(self) -> float:
        return base.farthest(self.center) + self.radius + 0.5 * self.length


class CapsuleNumbers(NamedTuple):
    """What kernels know of a capsule."""

    cx: float
    cy: float
    cz: float
    radius: float
    half: float  # of the length
    side: float


@inlined
def _from_segment(surface, x, y, z):
    """The way from the nearest point of the segment."""
    dz = z - surface.cz
    return x - surface.cx, y - surface.cy, dz - np.minimum(np.maximum(dz, -surface.half), surface.half)


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(CapsuleNumbers)
def _(surface, x, y, z):
    return np.sqrt(base.inner(surface, x, y, z)) - surface.radius


@base.gradient.register(CapsuleNumbers)
def _(surface, x, y, z):
    # On the segment, where the distance has no gradient, the answer is 0.
    dx, dy, dz = _from_segment(surface, x, y, z)
    inverse = 1.0 / np.maximum(np.sqrt(base.inner(surface, x, y, z)), np.finfo(np.float64).tiny)
    return inverse * dx, inverse * dy, inverse * dz


@base.inner.register(CapsuleNumbers)
def _(surface, x, y, z):
    dx, dy, dz = _from_segment(surface, x, y, z)
    return dx * dx + dy * dy + dz * dz


@smooth.slope.register(CapsuleNumbers)
def _(surface, x, y, z):
    dx, dy, dz = _from_segment(surface, x, y, z)
    return 2.0 * dx, 2.0 * dy, 2.0 * dz


@smooth.hessian.register(CapsuleNumbers)
def _(surface, x, y, z):
    return 1.0, 1.0, select(abs(z - surface.cz) > surface.half, 1.0, 0.0), 0.0, 0.0, 0.0


@smooth.difference.register(CapsuleNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    w0, w1 = _from_segment(surface, x0, y0, z0)[2], _from_segment(surface, x1, y1, z1)[2]
    # Beyond the same end w1 - w0 = z1 - z0, without the rounding of either.
    rise = select(w0 * w1 > 0.0, z1 - z0, w1 - w0)
    across = (x1 - x0) * (x0 + x1 - 2.0 * surface.cx) + (y1 - y0) * (y0 + y1 - 2.0 * surface.cy)
    return across + rise * (w0 + w1)


@base.gap_of.register(CapsuleNumbers)
def _(surface, q):
    return surface.side * (np.sqrt(q) - surface.radius)


@base.level_of.register(CapsuleNumbers)
def _(surface, q):
    return surface.side * (q - surface.radius * surface.radius)


@base.gap_slope.register(CapsuleNumbers)
def _(surface, q0, q1):
    root1 = np.sqrt(q1)
    slope = 1.0 / (np.sqrt(q0) + root1)
    return surface.side * slope, -0.5 * surface.side * slope * slope / root1


# --- Flight ----------------------------------------------------------------------------------------------


@base.first_hit.register(CapsuleNumbers)
def _(surface, x, y, z, vx, vy, vz):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    side, half, radius2 = surface.side, surface.half, surface.radius * surface.radius
    tube = ball_rise_time(side, radius2, dx, dy, 0.0, vx, vy, 0.0)
    # Where the flight meets the tube without ends decides: there, or at the sphere of that end. A flight towards a
    # solid that is inside that tube already is before its end.
    within = dx * dx + dy * dy < radius2
    height = dz + select((side < 0.0) & within, 0.0, vz * tube)
    wz = dz - select(height > 0.0, half, -half)
    cap = ball_rise_time(side, radius2, dx, dy, wz, vx, vy, vz)
    return select(abs(height) > half, cap, tube), True


@smooth.bend.register(CapsuleNumbers)
def _(surface, x, y, z):
    # 0 <= H <= I everywhere; the distance only bounds the speed of a fall.
    return select(surface.side > 0.0, 1.0, 0.0), 1.0, surface.radius


@smooth.clearance.register(CapsuleNumbers)
def _(surface, x, y, z):
    return -base.gap_of(surface, base.inner(surface, x, y, z))


# --- Contact ---------------------------------------------------------------------------------------------


@base.farthest_push.register(CapsuleNumbers)
def _(surface):
    # Where I + kappa H has its pole: nowhere for a cavity, across the segment for a solid.
    return select(surface.side > 0.0, math.inf, -1.0)

"""Slab: phi = |n.(r - c)| - h, the distance; inner function q = (n.(r - c))^2: the sphere of one dimension."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...checks import Vector, length
from ...kernel.jit import inlined, select
from .. import base
from ..course import rise_time
from ..rotation import turned, unit
from .normal import Normal, along, normal_of, times

# A normal as near as this to an axis is that axis, but for the round-off of a rotation.
_TILT = 1e-15


@dataclass(frozen=True, repr=False)
class Slab(base.Surface):
    """Two parallel walls; the space between them or, `side="outside"`, the space around the plate they are.

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

    normal: Vector
    half_width: float
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "normal", unit("normal", self.normal))
        object.__setattr__(self, "half_width", length("half_width", self.half_width))

    def numbers(self) -> "SlabNumbers":
        return slab_numbers(turned(self.rotation, self.normal), self.half_width, self.center, base.side_sign(self.side))

    def walls(self) -> tuple["SlabNumbers"]:
        return (self.numbers(),)

    def size(self) -> float:
        return self.half_width

    def bounds(self) -> base.Box:
        # Along its normal it reaches h, along any other direction to infinity.
        nx, ny, nz = turned(self.rotation, self.normal)
        tilts = math.hypot(ny, nz), math.hypot(nz, nx), math.hypot(nx, ny)
        hx, hy, hz = (self.half_width if tilt <= _TILT else math.inf for tilt in tilts)
        return base.box_around(self.center, (hx, hy, hz), self.side)

    def half_spaces(self) -> list[base.HalfSpace]:
        if self.is_solid():
            return []
        x, y, z = turned(self.rotation, self.normal)
        middle = x * self.center[0] + y * self.center[1] + z * self.center[2]
        return [((x, y, z), self.half_width + middle), ((-x, -y, -z), self.half_width - middle)]

    def extent(self) -> float:
        return base.farthest(self.center) + self.half_width


class SlabNumbers(NamedTuple):
    """What kernels know of a slab."""

    normal: Normal
    offset: float  # n.c
    half: float
    half2: float
    side: float


def slab_numbers(normal: Vector, half: float, center: Vector, side: float) -> SlabNumbers:
    """The numbers of a slab across the unit vector `normal`, as the scene sees it."""
    across = normal_of(normal)
    return SlabNumbers(across, float(along(across, *center)), half, half * half, side)


@inlined
def _off(surface, x, y, z):
    """The signed distance from the middle."""
    return along(surface.normal, x, y, z) - surface.offset


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(SlabNumbers)
def _(surface, x, y, z):
    return np.abs(_off(surface, x, y, z)) - surface.half


@base.gradient.register(SlabNumbers)
def _(surface, x, y, z):
    sign = np.copysign(1.0, _off(surface, x, y, z))
    return times(surface.normal, sign)


# --- Flight ----------------------------------------------------------------------------------------------


@base.first_hit.register(SlabNumbers)
def _(surface, x, y, z, vx, vy, vz):
    d, v = _off(surface, x, y, z), along(surface.normal, vx, vy, vz)
    # Between the walls the one ahead, outside of them the one on the side where the flight comes from
    time = (surface.side * math.copysign(surface.half, v) - d) / v
    meets = select(surface.side > 0.0, abs(v), -d * v) > 0.0
    return select(meets, select(time > 0.0, time, 0.0), math.inf), True


@base.falling_hit.register(SlabNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    d, sign = _off(surface, x, y, z), math.copysign(0.5, _off(surface, x, y, z))
    b, a = sign * along(surface.normal, vx, vy, vz), sign * along(surface.normal, gx, gy, gz)
    # The near wall and, between them, the far one: each is a plane.
    near = rise_time(surface.side * (abs(d) - surface.half), surface.side * b, surface.side * a)
    far = rise_time(-abs(d) - surface.half, -b, -a)
    return select((surface.side > 0.0) & (far < near), far, near), True


@base.safe_time.register(SlabNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    time, _found = base.falling_hit(surface, x, y, z, vx, vy, vz, gx, gy, gz)
    outside = surface.side * (abs(_off(surface, x, y, z)) - surface.half) > 0.0
    return select(outside, 0.0, time)


@base.flat.register(SlabNumbers)
def _(surface):
    return True


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(SlabNumbers)
def _(surface, x, y, z):
    k = math.copysign(1.0, surface.side * _off(surface, x, y, z))
    return times(surface.normal, k)


@base.chord_guess.register(SlabNumbers)
def _(surface, x, y, z, px, py, pz):
    # q1 = q0 with s0 + s1 = (2 s0 + p)/(1 + kappa) and s1 - s0 = (p - 2 kappa s0)/(1 + kappa)
    return 0.5 * along(surface.normal, px, py, pz) / _off(surface, x, y, z)


@base.chord_improve.register(SlabNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    return 0.0


@base.chord_sweeps.register(SlabNumbers)
def _(surface):
    return 0


@base.chord_normal.register(SlabNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    d = 2.0 * _off(surface, x, y, z) + along(surface.normal, px, py, pz)
    k = math.copysign(1.0, surface.side * d)
    return times(surface.normal, k)


@base.inner.register(SlabNumbers)
def _(surface, x, y, z):
    d = _off(surface, x, y, z)
    return d * d


@base.gap_of.register(SlabNumbers)
def _(surface, q):
    return surface.side * (math.sqrt(q) - surface.half)


@base.level_of.register(SlabNumbers)
def _(surface, q):
    return surface.side * (q - surface.half2)


@base.distance.register(SlabNumbers)
def _(surface, x, y, z):
    return surface.side * (abs(_off(surface, x, y, z)) - surface.half)


@base.gap_slope.register(SlabNumbers)
def _(surface, q0, q1):
    # (sqrt(q1) - sqrt(q0))/(q1 - q0) = 1/(sqrt(q0) + sqrt(q1))
    root1 = math.sqrt(q1)
    slope = 1.0 / (math.sqrt(q0) + root1)
    return surface.side * slope, -0.5 * surface.side * slope * slope / root1


@base.inner_gradient.register(SlabNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
    k = _off(surface, x0, y0, z0) + _off(surface, x1, y1, z1)
    return times(surface.normal, k)


@base.push.register(SlabNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    # r1 = r0 + p - kappa (s0 + s1) n
    k = kappa * (2.0 * _off(surface, x0, y0, z0) + along(surface.normal, px, py, pz)) / (1.0 + kappa)
    kx, ky, kz = times(surface.normal, k)
    return x0 + (px - kx), y0 + (py - ky), z0 + (pz - kz)


@base.resolve.register(SlabNumbers)
def _(surface, x, y, z, strength):
    k = 2.0 * strength / (1.0 + 2.0 * strength) * _off(surface, x, y, z)
    kx, ky, kz = times(surface.normal, k)
    return x - kx, y - ky, z - kz


@base.rise.register(SlabNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    # q1 - q0 = (s0 + s1)(s1 - s0), and ds1/dkappa = -(s0 + s1)/(1 + kappa)
    d, p = _off(surface, x0, y0, z0), along(surface.normal, px, py, pz)
    w = 1.0 / (1.0 + kappa)
    both, change = (2.0 * d + p) * w, (p - 2.0 * kappa * d) * w
    risen = both * change
    # q1 >= 0, even by round-off.
    return select(risen > -d * d, risen, -d * d), -2.0 * (d + change) * both * w


@base.farthest_push.register(SlabNumbers)
def _(surface):
    return select(surface.side > 0.0, math.inf, -1.0)


@base.settle.register(SlabNumbers)
def _(surface, x, y, z):
    d = _off(surface, x, y, z)
    fx, fy, fz = times(surface.normal, d - math.copysign(surface.half, d))
    return x - fx, y - fy, z - fz

"""Plane: phi = n.(r) - offset, the signed distance; inner function q = n.r."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ...checks import Vector, number
from ...kernel.jit import select
from .. import base
from ..course import rise_time
from ..rotation import turned, unit


@dataclass(frozen=True, repr=False)
class Plane(base.Surface):
    """A plane wall; admissible is normal.r <= offset, with the normal scaled to unit length.

    Args:
        normal: three numbers, not all 0; it points out of the admissible half-space.
        offset: distance of the plane from the origin along the normal [m].

    Raises:
        SceneError: an argument is out of its range.

    >>> Plane(normal=(0, 0, -2), offset=0.0).phi([[0.0], [0.0], [0.25]])
    array([-0.25])
    """

    normal: Vector
    offset: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "normal", unit("normal", self.normal))
        object.__setattr__(self, "offset", number("offset", self.offset))

    def numbers(self) -> "PlaneNumbers":
        return PlaneNumbers(*turned(self.rotation, self.normal), self.offset)

    def walls(self) -> tuple["PlaneNumbers"]:
        return (self.numbers(),)

    def size(self) -> float:
        return math.inf

    def bounds(self) -> base.Box:
        # Half-spaces bound only together: scene.py does that.
        return base.UNBOUNDED

    def half_spaces(self) -> list[base.HalfSpace]:
        return [(turned(self.rotation, self.normal), self.offset)]

    def extent(self) -> float:
        return abs(self.offset)


class PlaneNumbers(NamedTuple):
    """What kernels know of a plane."""

    nx: float
    ny: float
    nz: float
    offset: float


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(PlaneNumbers)
def _(surface, x, y, z):
    return base.inner(surface, x, y, z) - surface.offset


@base.gradient.register(PlaneNumbers)
def _(surface, x, y, z):
    return surface.nx, surface.ny, surface.nz


# --- Flight ----------------------------------------------------------------------------------------------


@base.first_hit.register(PlaneNumbers)
def _(surface, x, y, z, vx, vy, vz):
    approach = base.inner(surface, vx, vy, vz)
    distance = surface.offset - base.inner(surface, x, y, z)
    time = distance / approach
    return select(approach > 0.0, select(time > 0.0, time, 0.0), math.inf), True


@base.falling_hit.register(PlaneNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    c = base.inner(surface, x, y, z) - surface.offset
    return rise_time(c, 0.5 * base.inner(surface, vx, vy, vz), 0.5 * base.inner(surface, gx, gy, gz)), True


@base.safe_time.register(PlaneNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    time, _found = base.falling_hit(surface, x, y, z, vx, vy, vz, gx, gy, gz)
    return select(base.inner(surface, x, y, z) > surface.offset, 0.0, time)


# --- Contact ---------------------------------------------------------------------------------------------


@base.flat.register(PlaneNumbers)
def _(surface):
    return True


@base.unit_normal.register(PlaneNumbers)
def _(surface, x, y, z):
    return surface.nx, surface.ny, surface.nz


@base.chord_guess.register(PlaneNumbers)
def _(surface, x, y, z, px, py, pz):
    return base.inner(surface, px, py, pz)


@base.chord_improve.register(PlaneNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    return 0.0


@base.chord_sweeps.register(PlaneNumbers)
def _(surface):
    return 0


@base.chord_normal.register(PlaneNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    return surface.nx, surface.ny, surface.nz


@base.inner.register(PlaneNumbers)
def _(surface, x, y, z):
    return surface.nx * x + surface.ny * y + surface.nz * z


@base.gap_of.register(PlaneNumbers)
def _(surface, q):
    return q - surface.offset


@base.level_of.register(PlaneNumbers)
def _(surface, q):
    return q - surface.offset


@base.distance.register(PlaneNumbers)
def _(surface, x, y, z):
    return base.gap_of(surface, base.inner(surface, x, y, z))


@base.gap_slope.register(PlaneNumbers)
def _(surface, q0, q1):
    return 1.0, 0.0


@base.inner_gradient.register(PlaneNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    return surface.nx, surface.ny, surface.nz


@base.push.register(PlaneNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    return x0 + (px - kappa * surface.nx), y0 + (py - kappa * surface.ny), z0 + (pz - kappa * surface.nz)


@base.resolve.register(PlaneNumbers)
def _(surface, x, y, z, strength):
    return x - strength * surface.nx, y - strength * surface.ny, z - strength * surface.nz


@base.rise.register(PlaneNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    return base.inner(surface, px, py, pz) - kappa, -1.0


@base.farthest_push.register(PlaneNumbers)
def _(surface):
    return math.inf


@base.settle.register(PlaneNumbers)
def _(surface, x, y, z):
    g = base.inner(surface, x, y, z) - surface.offset
    return x - g * surface.nx, y - g * surface.ny, z - g * surface.nz

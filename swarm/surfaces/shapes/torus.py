"""Torus: phi = sqrt(q) - a, the distance; inner function q = (rho - R)^2 + z^2, not a quadric."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...checks import Vector, length
from ...errors import SceneError
from ...kernel.jit import inlined, select
from .. import base, smooth


@dataclass(frozen=True, repr=False)
class Torus(base.Surface):
    """A ring torus about its own z axis; the cavity in the tube or the space around the solid.

    Args:
        major_radius: R [m], from the axis to the middle of the tube.
        minor_radius: a [m], of the tube, 0 < a < R.
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Torus(major_radius=1.0, minor_radius=0.25).phi([[1.25], [0.0], [0.0]])
    array([0.])
    """

    major_radius: float
    minor_radius: float
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "major_radius", length("major_radius", self.major_radius))
        object.__setattr__(self, "minor_radius", length("minor_radius", self.minor_radius))
        if self.minor_radius >= self.major_radius:
            raise SceneError(
                f"minor_radius must be below major_radius = {self.major_radius:g}, got {self.minor_radius:g}"
            )

    def numbers(self) -> "TorusNumbers":
        return TorusNumbers(*self.own_center(), self.major_radius, self.minor_radius, base.side_sign(self.side))

    def size(self) -> float:
        return self.minor_radius

    def bounds(self) -> base.Box:
        wide = self.major_radius + self.minor_radius
        box = base.box_around(self.center, (wide, wide, self.minor_radius), self.side)
        return base.rotated_box(self.rotation, box, self.center)

    def extent(self) -> float:
        return base.farthest(self.center) + self.major_radius + self.minor_radius


class TorusNumbers(NamedTuple):
    """What kernels know of a torus."""

    cx: float
    cy: float
    cz: float
    major: float
    minor: float
    side: float


@inlined
def _from_axis(surface, x, y):
    """rho, never 0: on the axis the direction to the tube is not defined."""
    dx, dy = x - surface.cx, y - surface.cy
    return np.maximum(np.sqrt(dx * dx + dy * dy), np.finfo(np.float64).tiny)


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(TorusNumbers)
def _(surface, x, y, z):
    return np.sqrt(base.inner(surface, x, y, z)) - surface.minor


@base.gradient.register(TorusNumbers)
def _(surface, x, y, z):
    # In the middle of the tube, where the distance has no gradient, the answer is 0.
    gx, gy, gz = smooth.slope(surface, x, y, z)
    half = 0.5 / np.maximum(np.sqrt(base.inner(surface, x, y, z)), np.finfo(np.float64).tiny)
    return half * gx, half * gy, half * gz


@base.inner.register(TorusNumbers)
def _(surface, x, y, z):
    across, dz = _from_axis(surface, x, y) - surface.major, z - surface.cz
    return across * across + dz * dz


@smooth.slope.register(TorusNumbers)
def _(surface, x, y, z):
    f = 2.0 - 2.0 * surface.major / _from_axis(surface, x, y)
    return f * (x - surface.cx), f * (y - surface.cy), 2.0 * (z - surface.cz)


@smooth.hessian.register(TorusNumbers)
def _(surface, x, y, z):
    # 1 across the tube, 1 - R/rho along it: I - (R/rho) e e^T
    rho = _from_axis(surface, x, y)
    ex, ey, f = -(y - surface.cy) / rho, (x - surface.cx) / rho, surface.major / rho
    return 1.0 - f * ex * ex, 1.0 - f * ey * ey, 1.0, -f * ex * ey, 0.0, 0.0


@smooth.difference.register(TorusNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    rho0, rho1 = _from_axis(surface, x0, y0), _from_axis(surface, x1, y1)
    across = (x1 - x0) * (x0 + x1 - 2.0 * surface.cx) + (y1 - y0) * (y0 + y1 - 2.0 * surface.cy)
    along = (z1 - z0) * (z0 + z1 - 2.0 * surface.cz)
    return across * (1.0 - 2.0 * surface.major / (rho0 + rho1)) + along


@base.gap_of.register(TorusNumbers)
def _(surface, q):
    return surface.side * (np.sqrt(q) - surface.minor)


@base.level_of.register(TorusNumbers)
def _(surface, q):
    return surface.side * (q - surface.minor * surface.minor)


@base.gap_slope.register(TorusNumbers)
def _(surface, q0, q1):
    root1 = np.sqrt(q1)
    slope = 1.0 / (np.sqrt(q0) + root1)
    return surface.side * slope, -0.5 * surface.side * slope * slope / root1


# --- Flight ----------------------------------------------------------------------------------------------


@smooth.bend.register(TorusNumbers)
def _(surface, x, y, z):
    # Half way to the axis at most, where 1 - R/rho is largest.
    rho = _from_axis(surface, x, y)
    along = 2.0 * surface.major / rho
    return select(surface.side > 0.0, 1.0, along - 1.0), 1.0 + along, 0.5 * rho


@smooth.clearance.register(TorusNumbers)
def _(surface, x, y, z):
    return -base.gap_of(surface, base.inner(surface, x, y, z))


@smooth.passed.register(TorusNumbers)
def _(surface, x, y, z, vx, vy, vz):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    wide = surface.major + surface.minor
    away = dx * vx + dy * vy + dz * vz >= 0.0
    return (surface.side < 0.0) & away & (dx * dx + dy * dy + dz * dz > wide * wide)


# --- Contact ---------------------------------------------------------------------------------------------


@base.farthest_push.register(TorusNumbers)
def _(surface):
    # Where I + kappa H has its first pole: along the inner equator of a cavity, across the tube of a solid.
    return select(surface.side > 0.0, surface.major / surface.minor - 1.0, -1.0)

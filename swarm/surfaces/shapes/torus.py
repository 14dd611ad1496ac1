"""Torus: phi = sqrt(q) - a, the distance; inner function q = (rho - R)^2 + z^2, not a quadric."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...checks import Vector, length
from ...errors import SceneError
from ...kernel.jit import inlined, select
from ...kernel.vector import Symmetric, Vec, dot, square, vec
from .. import contract
from ..rotation import turned
from ..surface import Box, Surface, box_around, farthest, is_along, is_on_axis, rotated_box, side_sign
from .common import root_gap


@dataclass(frozen=True, repr=False)
class Torus(Surface):
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
        minor, side = self.minor_radius, side_sign(self.side)
        return TorusNumbers(vec(self.own_center()), self.major_radius, minor, minor * minor, side)

    def size(self) -> float:
        return self.minor_radius

    def bounds(self) -> Box:
        wide = self.major_radius + self.minor_radius
        box = box_around(self.center, (wide, wide, self.minor_radius), self.side)
        return rotated_box(self.rotation, box, self.center)

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return is_along(turned(self.rotation, (0.0, 0.0, 1.0)), axis) and is_on_axis(self.center, axis, center)

    def extent(self) -> float:
        return farthest(self.center) + self.major_radius + self.minor_radius


@root_gap
class TorusNumbers(NamedTuple):
    """What kernels know of a torus."""

    center: Vec
    major: float
    radius: float  # of the tube
    radius2: float
    side: float


@inlined
def _from_axis(surface, r):
    """rho, never 0: on the axis the direction to the tube is not defined."""
    d = r - surface.center
    return np.maximum(np.sqrt(d.x * d.x + d.y * d.y), np.finfo(np.float64).tiny)


# --- The level set ---------------------------------------------------------------------------------------


@contract.inner.register(TorusNumbers)
def _(surface, r):
    across, dz = _from_axis(surface, r) - surface.major, r.z - surface.center.z
    return across * across + dz * dz


@contract.slope.register(TorusNumbers)
def _(surface, r):
    d, f = r - surface.center, 2.0 - 2.0 * surface.major / _from_axis(surface, r)
    return Vec(f * d.x, f * d.y, 2.0 * d.z)


@contract.hessian.register(TorusNumbers)
def _(surface, r):
    # 1 across the tube, 1 - R/rho along it: I - (R/rho) e e^T
    d, rho = r - surface.center, _from_axis(surface, r)
    ex, ey, f = -d.y / rho, d.x / rho, surface.major / rho
    return Symmetric(1.0 - f * ex * ex, 1.0 - f * ey * ey, 1.0, -f * ex * ey, 0.0, 0.0)


@contract.difference.register(TorusNumbers)
def _(surface, r0, r1):
    rho0, rho1 = _from_axis(surface, r0), _from_axis(surface, r1)
    d, both = r1 - r0, r0 + r1 - 2.0 * surface.center
    across = d.x * both.x + d.y * both.y
    return across * (1.0 - 2.0 * surface.major / (rho0 + rho1)) + d.z * both.z


# --- Flight ----------------------------------------------------------------------------------------------


@contract.bend.register(TorusNumbers)
def _(surface, r):
    # Half way to the axis at most, where 1 - R/rho is largest.
    rho = _from_axis(surface, r)
    along = 2.0 * surface.major / rho
    return select(surface.side > 0.0, 1.0, along - 1.0), 1.0 + along, 0.5 * rho


@contract.passed.register(TorusNumbers)
def _(surface, r, v):
    d, wide = r - surface.center, surface.major + surface.radius
    return (surface.side < 0.0) & (dot(d, v) >= 0.0) & (square(d) > wide * wide)


# --- Contact ---------------------------------------------------------------------------------------------


@contract.farthest_push.register(TorusNumbers)
def _(surface):
    # Where I + kappa H has its first pole: along the inner equator of a cavity, across the tube of a solid.
    return select(surface.side > 0.0, surface.major / surface.radius - 1.0, -1.0)

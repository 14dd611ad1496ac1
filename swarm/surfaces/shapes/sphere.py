"""Sphere: phi = |r - c| - R, the distance; inner function q = |r - c|^2."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...checks import Vector, length
from ...kernel.jit import inlined, select
from .. import base
from ..course import ball_rise_time, level_and_window, rise_time_inside


@dataclass(frozen=True, repr=False)
class Sphere(base.Surface):
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

    radius: float
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "radius", length("radius", self.radius))

    def numbers(self) -> "SphereNumbers":
        side = base.side_sign(self.side)
        kind = SphereNumbers if self.side == "inside" else SphereFromAfar
        return kind(*self.center, self.radius, self.radius**2, side / self.radius, side)

    def walls(self) -> tuple["SphereNumbers"]:
        return (self.numbers(),)  # whatever its rotation

    def size(self) -> float:
        return self.radius

    def bounds(self) -> base.Box:
        return base.box_around(self.center, (self.radius,) * 3, self.side)

    def extent(self) -> float:
        return base.farthest(self.center) + self.radius


class SphereNumbers(NamedTuple):
    """What kernels know of a sphere."""

    cx: float
    cy: float
    cz: float
    radius: float
    radius2: float
    curvature: float  # side/R
    side: float


class SphereFromAfar(SphereNumbers):
    """A ball: it may be small compared with the way to it."""


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(SphereNumbers)
def _(surface, x, y, z):
    return np.sqrt(base.inner(surface, x, y, z)) - surface.radius


@base.gradient.register(SphereNumbers)
def _(surface, x, y, z):
    # At the centre, where |r - c| has no gradient, the answer is 0.
    inverse = 1.0 / np.maximum(np.sqrt(base.inner(surface, x, y, z)), np.finfo(np.float64).tiny)
    return (x - surface.cx) * inverse, (y - surface.cy) * inverse, (z - surface.cz) * inverse


# --- Flight ----------------------------------------------------------------------------------------------


@inlined
def _level(surface, dx, dy, dz, vx, vy, vz):
    """(c, b) of |d + v t|^2 - R^2 = c + 2 b t + |v|^2 t^2."""
    return dx * dx + dy * dy + dz * dz - surface.radius2, dx * vx + dy * vy + dz * vz


@base.first_hit.register(SphereNumbers)
def _(surface, x, y, z, vx, vy, vz):
    c, b = _level(surface, x - surface.cx, y - surface.cy, z - surface.cz, vx, vy, vz)
    return rise_time_inside(c, b, vx * vx + vy * vy + vz * vz), True


@base.first_hit.register(SphereFromAfar)
def _(surface, x, y, z, vx, vy, vz):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    return ball_rise_time(surface.side, surface.radius2, dx, dy, dz, vx, vy, vz), True


@base.course.register(SphereNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    c, b = _level(surface, dx, dy, dz, vx, vy, vz)
    a = vx * vx + vy * vy + vz * vz
    gg = gx * gx + gy * gy + gz * gz
    # |r + v t + G t^2/2 - c|^2 - R^2, a quartic in t
    a2 = a + dx * gx + dy * gy + dz * gz
    a3 = vx * gx + vy * gy + vz * gz
    # By the distance where that is more than the radius: a ball is looked for from afar.
    size = surface.radius2 + select(c > 0.0, c, 0.0)
    c, window = level_and_window(c, surface.radius2, size, a, gg)
    side = surface.side
    return side * c, side * b, side * a2, side * a3, side * 0.25 * gg, window


@base.is_quartic.register(SphereNumbers)
def _(surface):
    return True


@base.may_be_far.register(SphereNumbers)
def _(surface):
    return False


@base.may_be_far.register(SphereFromAfar)
def _(surface):
    return True


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(SphereNumbers)
def _(surface, x, y, z):
    k = surface.curvature
    return (x - surface.cx) * k, (y - surface.cy) * k, (z - surface.cz) * k


@base.chord_guess.register(SphereNumbers)
def _(surface, x, y, z, px, py, pz):
    # q1 = q0 is linear in kappa: kappa = (2 r0.p + p.p)/(4 q0 + 2 r0.p)
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    rp = 2.0 * (dx * px + dy * py + dz * pz)
    return (rp + px * px + py * py + pz * pz) / (4.0 * surface.radius2 + rp)


@base.chord_improve.register(SphereNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    return 0.0


@base.chord_sweeps.register(SphereNumbers)
def _(surface):
    return 0


@base.chord_normal.register(SphereNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    # r1 = [(1 - kappa) r0 + p]/(1 + kappa), so r0 + r1 is parallel to 2 r0 + p whatever kappa is.
    nx = 2.0 * (x - surface.cx) + px
    ny = 2.0 * (y - surface.cy) + py
    nz = 2.0 * (z - surface.cz) + pz
    k = surface.side / math.sqrt(nx * nx + ny * ny + nz * nz)
    return nx * k, ny * k, nz * k


@base.inner.register(SphereNumbers)
def _(surface, x, y, z):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    return dx * dx + dy * dy + dz * dz


@base.gap_of.register(SphereNumbers)
def _(surface, q):
    return surface.side * (math.sqrt(q) - surface.radius)


@base.level_of.register(SphereNumbers)
def _(surface, q):
    return surface.side * (q - surface.radius2)


@base.distance.register(SphereNumbers)
def _(surface, x, y, z):
    return base.gap_of(surface, base.inner(surface, x, y, z))


@base.gap_scale.register(SphereNumbers)
def _(surface, x, y, z):
    # |grad g| = 1
    return abs(x) + abs(y) + abs(z)


@base.gap_slope.register(SphereNumbers)
def _(surface, q0, q1):
    # (sqrt(q1) - sqrt(q0))/(q1 - q0) = 1/(sqrt(q0) + sqrt(q1))
    root1 = math.sqrt(q1)
    slope = 1.0 / (math.sqrt(q0) + root1)
    return surface.side * slope, -0.5 * surface.side * slope * slope / root1


@base.inner_gradient.register(SphereNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
    return x0 + x1 - 2.0 * surface.cx, y0 + y1 - 2.0 * surface.cy, z0 + z1 - 2.0 * surface.cz


@base.push.register(SphereNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    # r1 = [(1 - kappa) r0 + p]/(1 + kappa), relative to the centre
    w = 1.0 / (1.0 + kappa)
    u = (1.0 - kappa) * w
    return (
        surface.cx + ((x0 - surface.cx) * u + px * w),
        surface.cy + ((y0 - surface.cy) * u + py * w),
        surface.cz + ((z0 - surface.cz) * u + pz * w),
    )


@base.resolve.register(SphereNumbers)
def _(surface, x, y, z, strength):
    w = 1.0 / (1.0 + 2.0 * strength)
    return surface.cx + w * (x - surface.cx), surface.cy + w * (y - surface.cy), surface.cz + w * (z - surface.cz)


@base.rise.register(SphereNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    # r0 + r1 = (2 r0 + p)/(1 + kappa) and r1 - r0 = (p - 2 kappa r0)/(1 + kappa), relative to the centre, so
    # q1 - q0 = [2 r0.p + p.p - kappa (4 q0 + 2 r0.p)]/(1 + kappa)^2
    dx, dy, dz = x0 - surface.cx, y0 - surface.cy, z0 - surface.cz
    q0 = dx * dx + dy * dy + dz * dz
    rp = 2.0 * (dx * px + dy * py + dz * pz)
    fall = 4.0 * q0 + rp
    w = 1.0 / (1.0 + kappa)
    risen = (rp + px * px + py * py + pz * pz - kappa * fall) * w * w
    # q1 >= 0, even by round-off.
    return select(risen > -q0, risen, -q0), -w * (2.0 * risen + w * fall)


@base.farthest_push.register(SphereNumbers)
def _(surface):
    return select(surface.side > 0.0, math.inf, -1.0)


@base.settle.register(SphereNumbers)
def _(surface, x, y, z):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    # 1/(2 R^2)
    k = 0.5 * surface.curvature * surface.curvature
    f = (dx * dx + dy * dy + dz * dz - surface.radius2) * k
    return x - f * dx, y - f * dy, z - f * dz

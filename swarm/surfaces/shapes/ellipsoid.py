"""Ellipsoid: phi = q - 1, without unit; inner function q = x^2/a^2 + y^2/b^2 + z^2/c^2."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ...checks import Vector, length, vector
from ...kernel.jit import inlined, select
from .. import base
from ..course import level_and_window, rise_time_by, rise_time_inside

# Newton's method for the chord doubles its digits from about h|v|/size of relative error: 3 sweeps at 1e-3, 7 at 1.
_CHORD_SWEEPS = 12


@dataclass(frozen=True, repr=False)
class Ellipsoid(base.Surface):
    """An ellipsoid with axes along its own x, y, z; its cavity or the space around the solid.

    Args:
        semi_axes: three numbers > 0 [m].
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Ellipsoid(semi_axes=(0.5, 1.0, 2.0)).phi([[0.0], [0.0], [2.0]])
    array([0.])
    """

    semi_axes: Vector
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        axes = vector("semi_axes", self.semi_axes)
        for i, axis in enumerate(axes):
            length(f"semi_axes[{i}]", axis)
        object.__setattr__(self, "semi_axes", axes)

    def numbers(self) -> "EllipsoidNumbers":
        a, b, c = (1.0 / (axis * axis) for axis in self.semi_axes)
        kind = EllipsoidNumbers if self.side == "inside" else EllipsoidFromAfar
        return kind(*self.own_center(), a, b, c, base.side_sign(self.side))

    def size(self) -> float:
        return min(self.semi_axes)

    def bounds(self) -> base.Box:
        box = base.box_around(self.center, self.semi_axes, self.side)
        return base.rotated_box(self.rotation, box, self.center)

    def extent(self) -> float:
        return base.farthest(self.center) + max(self.semi_axes)


class EllipsoidNumbers(NamedTuple):
    """What kernels know of an ellipsoid; (ax, ay, az) is the diagonal of A in q = (r-c).A(r-c)."""

    cx: float
    cy: float
    cz: float
    ax: float
    ay: float
    az: float
    side: float


class EllipsoidFromAfar(EllipsoidNumbers):
    """A solid: it may be small or thin compared with the way to it."""


@inlined
def _dot(surface, x, y, z, u, v, w):
    """(x, y, z).A(u, v, w)"""
    return surface.ax * x * u + surface.ay * y * v + surface.az * z * w


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(EllipsoidNumbers)
def _(surface, x, y, z):
    return base.inner(surface, x, y, z) - 1.0


@base.gradient.register(EllipsoidNumbers)
def _(surface, x, y, z):
    return (
        2.0 * surface.ax * (x - surface.cx),
        2.0 * surface.ay * (y - surface.cy),
        2.0 * surface.az * (z - surface.cz),
    )


# --- Flight ----------------------------------------------------------------------------------------------


@inlined
def _parabola(surface, dx, dy, dz, vx, vy, vz):
    """(c, b, a) of q(d + v t) - 1 = c + 2 b t + a t^2."""
    c = _dot(surface, dx, dy, dz, dx, dy, dz) - 1.0
    return c, _dot(surface, dx, dy, dz, vx, vy, vz), _dot(surface, vx, vy, vz, vx, vy, vz)


@base.first_hit.register(EllipsoidNumbers)
def _(surface, x, y, z, vx, vy, vz):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    c, b, a = _parabola(surface, dx, dy, dz, vx, vy, vz)
    return rise_time_inside(c, b, a), True


@base.first_hit.register(EllipsoidFromAfar)
def _(surface, x, y, z, vx, vy, vz):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    c, b, a = _parabola(surface, dx, dy, dz, vx, vy, vz)
    # b^2 - a c = v.A v - w.(det A) A^-1 w with w = d x v, Lagrange's identity; near the wall the first form is better.
    wx, wy, wz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
    ww = surface.ay * surface.az * wx * wx + surface.ax * surface.az * wy * wy + surface.ax * surface.ay * wz * wz
    discriminant = select(c > 1.0, a - ww, b * b - a * c)
    return rise_time_by(surface.side * c, surface.side * b, surface.side * a, discriminant), True


@base.course.register(EllipsoidNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    c, b, a = _parabola(surface, dx, dy, dz, vx, vy, vz)
    gg = _dot(surface, gx, gy, gz, gx, gy, gz)
    # q(r + v t + G t^2/2) - 1, a quartic in t
    a2 = a + _dot(surface, dx, dy, dz, gx, gy, gz)
    a3 = _dot(surface, vx, vy, vz, gx, gy, gz)
    # By the distance where that is more than the axes: a solid is looked for from afar.
    size = 1.0 + select(c > 0.0, c, 0.0)
    c, window = level_and_window(c, 1.0, size, a, gg)
    side = surface.side
    return side * c, side * b, side * a2, side * a3, side * 0.25 * gg, window


@base.is_quartic.register(EllipsoidNumbers)
def _(surface):
    return True


@base.may_be_far.register(EllipsoidNumbers)
def _(surface):
    return False


@base.may_be_far.register(EllipsoidFromAfar)
def _(surface):
    return True


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(EllipsoidNumbers)
def _(surface, x, y, z):
    nx = surface.ax * (x - surface.cx)
    ny = surface.ay * (y - surface.cy)
    nz = surface.az * (z - surface.cz)
    k = surface.side / math.sqrt(nx * nx + ny * ny + nz * nz)
    return nx * k, ny * k, nz * k


@base.chord_guess.register(EllipsoidNumbers)
def _(surface, x, y, z, px, py, pz):
    return -base.chord_improve(surface, x, y, z, px, py, pz, 0.0)


@base.chord_improve.register(EllipsoidNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    # With m = r0 + r1 = (2 r0 + p)/(1 + kappa A), q1 = q0 reads f(kappa) = m.A m - 2 r0.A m = 0.
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    wx, wy, wz = _widths(surface, kappa)
    mx, my, mz = (2.0 * dx + px) * wx, (2.0 * dy + py) * wy, (2.0 * dz + pz) * wz
    f = _dot(surface, mx, my, mz, mx - 2.0 * dx, my - 2.0 * dy, mz - 2.0 * dz)
    # -f'(kappa)/2 = sum A^2 m (m - r0)/(1 + kappa A)
    fx = surface.ax * surface.ax * mx * (mx - dx) * wx
    fy = surface.ay * surface.ay * my * (my - dy) * wy
    fz = surface.az * surface.az * mz * (mz - dz) * wz
    return -f / (2.0 * (fx + fy + fz))


@inlined
def _widths(surface, kappa):
    """1/(1 + kappa A) by one division."""
    wx, wy, wz = 1.0 + kappa * surface.ax, 1.0 + kappa * surface.ay, 1.0 + kappa * surface.az
    inverse = 1.0 / (wx * wy * wz)
    return wy * wz * inverse, wx * wz * inverse, wx * wy * inverse


@base.chord_sweeps.register(EllipsoidNumbers)
def _(surface):
    return _CHORD_SWEEPS


@base.chord_normal.register(EllipsoidNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    wx, wy, wz = _widths(surface, kappa)
    nx = surface.ax * (2.0 * dx + px) * wx
    ny = surface.ay * (2.0 * dy + py) * wy
    nz = surface.az * (2.0 * dz + pz) * wz
    k = surface.side / math.sqrt(nx * nx + ny * ny + nz * nz)
    return nx * k, ny * k, nz * k


@base.inner.register(EllipsoidNumbers)
def _(surface, x, y, z):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    return surface.ax * dx * dx + surface.ay * dy * dy + surface.az * dz * dz


@base.gap_of.register(EllipsoidNumbers)
def _(surface, q):
    return surface.side * (q - 1.0)


@base.level_of.register(EllipsoidNumbers)
def _(surface, q):
    return surface.side * (q - 1.0)


@base.gap_slope.register(EllipsoidNumbers)
def _(surface, q0, q1):
    return surface.side, 0.0


@base.inner_gradient.register(EllipsoidNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
    return (
        surface.ax * (x0 + x1 - 2.0 * surface.cx),
        surface.ay * (y0 + y1 - 2.0 * surface.cy),
        surface.az * (z0 + z1 - 2.0 * surface.cz),
    )


@inlined
def _pushed(a, d, p, kappa):
    """One component of r1 = [(1 - kappa A) r0 + p]/(1 + kappa A)."""
    return ((1.0 - kappa * a) * d + p) / (1.0 + kappa * a)


@base.push.register(EllipsoidNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    return (
        surface.cx + _pushed(surface.ax, x0 - surface.cx, px, kappa),
        surface.cy + _pushed(surface.ay, y0 - surface.cy, py, kappa),
        surface.cz + _pushed(surface.az, z0 - surface.cz, pz, kappa),
    )


@base.resolve.register(EllipsoidNumbers)
def _(surface, x, y, z, strength):
    wx, wy, wz = _widths(surface, 2.0 * strength)
    return surface.cx + wx * (x - surface.cx), surface.cy + wy * (y - surface.cy), surface.cz + wz * (z - surface.cz)


@base.rise.register(EllipsoidNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    # s = r0 + r1 = (2 r0 + p)/(1 + kappa A) and e = r1 - r0 = (p - 2 kappa A r0)/(1 + kappa A): q1 - q0 = s.A e
    dx, dy, dz = x0 - surface.cx, y0 - surface.cy, z0 - surface.cz
    wx, wy, wz = _widths(surface, kappa)
    sx, sy, sz = (2.0 * dx + px) * wx, (2.0 * dy + py) * wy, (2.0 * dz + pz) * wz
    ex = (px - 2.0 * kappa * surface.ax * dx) * wx
    ey = (py - 2.0 * kappa * surface.ay * dy) * wy
    ez = (pz - 2.0 * kappa * surface.az * dz) * wz
    # dr1/dkappa = -A s/(1 + kappa A)
    x, y, z = surface.ax * sx * wx, surface.ay * sy * wy, surface.az * sz * wz
    return _dot(surface, sx, sy, sz, ex, ey, ez), -2.0 * _dot(surface, dx + ex, dy + ey, dz + ez, x, y, z)


@base.farthest_push.register(EllipsoidNumbers)
def _(surface):
    return select(surface.side > 0.0, math.inf, -1.0 / max(surface.ax, surface.ay, surface.az))


@base.settle.register(EllipsoidNumbers)
def _(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    f = base.phi(surface, x, y, z) / (gx * gx + gy * gy + gz * gz)
    return x - f * gx, y - f * gy, z - f * gz

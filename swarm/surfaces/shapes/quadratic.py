"""Quadratic phi = sum A x^2 + sum b x - level in a principal frame, its inner function the sum.

The cylinder, the cone and the paraboloid are such surfaces, and so is any quadric, with A of either sign.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ...checks import Vector
from ...kernel.jit import inlined, select
from .. import base
from ..course import level_and_window, rise_time, rise_time_by

# Newton's method for the chord doubles its digits from about h|v|/size of relative error: 3 sweeps at 1e-3, 7 at 1.
_CHORD_SWEEPS = 12
_TINY = float(np.finfo(np.float64).tiny)


class QuadricNumbers(NamedTuple):
    """What kernels know of a quadric; (ax, ay, az) is the diagonal of A in its principal frame."""

    cx: float
    cy: float
    cz: float
    ax: float
    ay: float
    az: float
    bx: float
    by: float
    bz: float
    level: float
    scale: float  # by how much q varies over the surface's size
    side: float


class QuadricFromAfar(QuadricNumbers):
    """One that is no convex cavity: it, or its waist, may be small compared with the way to it."""


def quadric_numbers(center: Vector, curvatures: Any, linear: Any, level: float, side: str) -> QuadricNumbers:
    """The numbers of a quadric in its principal frame."""
    (ax, ay, az), (bx, by, bz) = map(float, curvatures), map(float, linear)
    steepest = max(abs(ax), abs(ay), abs(az))
    scale = abs(level) + ((bx * bx + by * by + bz * bz) / (4.0 * steepest) if steepest > 0.0 else 0.0)
    sign = base.side_sign(side)
    kind = QuadricNumbers if min(sign * ax, sign * ay, sign * az) >= 0.0 else QuadricFromAfar
    return kind(*center, ax, ay, az, bx, by, bz, level, scale, sign)


@inlined
def _from_center(surface, x, y, z):
    return x - surface.cx, y - surface.cy, z - surface.cz


@inlined
def _dot(surface, x, y, z, u, v, w):
    """(x, y, z).A(u, v, w)"""
    return surface.ax * x * u + surface.ay * y * v + surface.az * z * w


@inlined
def _linear(surface, x, y, z):
    """b.(x, y, z)"""
    return surface.bx * x + surface.by * y + surface.bz * z


@inlined
def _slope(surface, dx, dy, dz):
    """grad q = 2 A d + b"""
    return (
        2.0 * surface.ax * dx + surface.bx,
        2.0 * surface.ay * dy + surface.by,
        2.0 * surface.az * dz + surface.bz,
    )


@inlined
def _unit(surface, nx, ny, nz):
    """The unit vector along side n. At the apex of a cone, where n is 0, the answer is 0 and not NaN."""
    n2 = nx * nx + ny * ny + nz * nz
    k = surface.side / math.sqrt(select(n2 > _TINY, n2, 1.0))
    return nx * k, ny * k, nz * k


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(QuadricNumbers)
def _(surface, x, y, z):
    return base.inner(surface, x, y, z) - surface.level


@base.gradient.register(QuadricNumbers)
def _(surface, x, y, z):
    dx, dy, dz = _from_center(surface, x, y, z)
    return _slope(surface, dx, dy, dz)


# --- Flight ----------------------------------------------------------------------------------------------


@base.first_hit.register(QuadricNumbers)
def _(surface, x, y, z, vx, vy, vz):
    dx, dy, dz = _from_center(surface, x, y, z)
    c = _dot(surface, dx, dy, dz, dx, dy, dz) + _linear(surface, dx, dy, dz) - surface.level
    b = _dot(surface, dx, dy, dz, vx, vy, vz) + 0.5 * _linear(surface, vx, vy, vz)
    a = _dot(surface, vx, vy, vz, vx, vy, vz)
    return rise_time(surface.side * c, surface.side * b, surface.side * a), True


@base.first_hit.register(QuadricFromAfar)
def _(surface, x, y, z, vx, vy, vz):
    dx, dy, dz = _from_center(surface, x, y, z)
    c = _dot(surface, dx, dy, dz, dx, dy, dz) + _linear(surface, dx, dy, dz) - surface.level
    along = 0.5 * _linear(surface, vx, vy, vz)
    b = _dot(surface, dx, dy, dz, vx, vy, vz) + along
    a = _dot(surface, vx, vy, vz, vx, vy, vz)
    # b^2 - a c = level v.A v + (b.v)^2/4 - w.(det A) A^-1 w + A v.(b x w) with w = d x v, Lagrange's identity. Of both
    # forms the one with the smaller terms.
    wx, wy, wz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
    u = surface.ay * surface.az * wx * wx, surface.ax * surface.az * wy * wy, surface.ax * surface.ay * wz * wz
    s = (
        surface.ax * vx * (surface.by * wz - surface.bz * wy),
        surface.ay * vy * (surface.bz * wx - surface.bx * wz),
        surface.az * vz * (surface.bx * wy - surface.by * wx),
    )
    from_afar = surface.level * a + along * along - (u[0] + u[1] + u[2]) + (s[0] + s[1] + s[2])
    terms = abs(surface.level * a) + along * along + abs(u[0]) + abs(u[1]) + abs(u[2])
    terms += abs(s[0]) + abs(s[1]) + abs(s[2])
    discriminant = select(terms < b * b + abs(a * c), from_afar, b * b - a * c)
    return rise_time_by(surface.side * c, surface.side * b, surface.side * a, discriminant), True


@base.course.register(QuadricNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    dx, dy, dz = _from_center(surface, x, y, z)
    c = _dot(surface, dx, dy, dz, dx, dy, dz) + _linear(surface, dx, dy, dz) - surface.level
    b = _dot(surface, dx, dy, dz, vx, vy, vz) + 0.5 * _linear(surface, vx, vy, vz)
    a2 = _dot(surface, vx, vy, vz, vx, vy, vz) + _dot(surface, dx, dy, dz, gx, gy, gz)
    a2 += 0.5 * _linear(surface, gx, gy, gz)
    # q(r + v t + G t^2/2) - level, a quartic in t
    a3, a4 = _dot(surface, vx, vy, vz, gx, gy, gz), 0.25 * _dot(surface, gx, gy, gz, gx, gy, gz)
    c, window = _window(surface, c, dx, dy, dz, vx, vy, vz, gx, gy, gz)
    # What is left of a3 where G A G is below the smallest number would be infinite after an infinite time.
    curved = surface.side * select(window < math.inf, 1.0, 0.0)
    return surface.side * c, surface.side * b, surface.side * a2, curved * a3, curved * a4, window


@inlined
def _window(surface, c, dx, dy, dz, vx, vy, vz, gx, gy, gz):
    """(c, window) by the time in which the flight changes q by as much as it varies here.

    The window is infinite where the level is a parabola.
    """
    terms = _size(surface, dx, dy, dz) + abs(surface.bx * dx) + abs(surface.by * dy) + abs(surface.bz * dz)
    size = select(terms > surface.scale, terms, surface.scale)
    moving, falling = _size(surface, vx, vy, vz), _size(surface, gx, gy, gz)
    # At the apex of a cone there is no size: the time after which the fall is as fast as the start.
    size = select(size > 0.0, size, moving * moving / falling)
    # A cone has no size of its own to be far from.
    own = select(surface.scale > 0.0, surface.scale, math.inf)
    level, window = level_and_window(c, own, size, moving, falling)
    window = select(abs(window) > 0.0, window, 1.0)
    return select(falling > 0.0, level, c), select(falling > 0.0, window, math.inf)


@inlined
def _size(surface, x, y, z):
    """(x, y, z).|A|(x, y, z)"""
    return abs(surface.ax) * x * x + abs(surface.ay) * y * y + abs(surface.az) * z * z


@base.is_quartic.register(QuadricNumbers)
def _(surface):
    return True


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(QuadricNumbers)
def _(surface, x, y, z):
    nx, ny, nz = base.gradient(surface, x, y, z)
    return _unit(surface, nx, ny, nz)


@inlined
def _step(surface, x0, y0, z0, px, py, pz, kappa):
    """D(r0, r1) and r1 - r0 of the step, and the widths 1/(1 + kappa A).

    With G = grad q(r0): D = (G + A p)/(1 + kappa A) and r1 - r0 = (p - kappa G)/(1 + kappa A).
    """
    dx, dy, dz = _from_center(surface, x0, y0, z0)
    gx, gy, gz = _slope(surface, dx, dy, dz)
    wx, wy, wz = _widths(surface, kappa)
    return (
        (gx + surface.ax * px) * wx,
        (gy + surface.ay * py) * wy,
        (gz + surface.az * pz) * wz,
        (px - kappa * gx) * wx,
        (py - kappa * gy) * wy,
        (pz - kappa * gz) * wz,
        wx,
        wy,
        wz,
    )


@inlined
def _widths(surface, kappa):
    """1/(1 + kappa A) by one division."""
    wx, wy, wz = 1.0 + kappa * surface.ax, 1.0 + kappa * surface.ay, 1.0 + kappa * surface.az
    inverse = 1.0 / (wx * wy * wz)
    return wy * wz * inverse, wx * wz * inverse, wx * wy * inverse


@base.chord_guess.register(QuadricNumbers)
def _(surface, x, y, z, px, py, pz):
    return -base.chord_improve(surface, x, y, z, px, py, pz, 0.0)


@base.chord_improve.register(QuadricNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    # q1 = q0
    risen, steepness = base.rise(surface, x, y, z, px, py, pz, kappa)
    return risen / steepness


@base.chord_sweeps.register(QuadricNumbers)
def _(surface):
    return _CHORD_SWEEPS


@base.chord_normal.register(QuadricNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    nx, ny, nz, _ex, _ey, _ez, _wx, _wy, _wz = _step(surface, x, y, z, px, py, pz, kappa)
    return _unit(surface, nx, ny, nz)


@base.inner.register(QuadricNumbers)
def _(surface, x, y, z):
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    curved = surface.ax * dx * dx + surface.ay * dy * dy + surface.az * dz * dz
    return curved + (surface.bx * dx + surface.by * dy + surface.bz * dz)


@base.gap_of.register(QuadricNumbers)
def _(surface, q):
    return surface.side * (q - surface.level)


@base.level_of.register(QuadricNumbers)
def _(surface, q):
    return surface.side * (q - surface.level)


@base.distance.register(QuadricNumbers)
def _(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    g2 = gx * gx + gy * gy + gz * gz
    return base.gap_of(surface, base.inner(surface, x, y, z)) / math.sqrt(select(g2 > _TINY, g2, _TINY))


@base.gap_slope.register(QuadricNumbers)
def _(surface, q0, q1):
    return surface.side, 0.0


@base.inner_gradient.register(QuadricNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    # q is quadratic, so its gradient at the midpoint is a discrete gradient, exactly.
    return (
        surface.ax * (x0 + x1 - 2.0 * surface.cx) + surface.bx,
        surface.ay * (y0 + y1 - 2.0 * surface.cy) + surface.by,
        surface.az * (z0 + z1 - 2.0 * surface.cz) + surface.bz,
    )


@inlined
def _pushed(a, b, d, p, kappa):
    """One component of r1 = [(1 - kappa A) r0 + p - kappa b]/(1 + kappa A)."""
    return ((1.0 - kappa * a) * d + (p - kappa * b)) / (1.0 + kappa * a)


@base.push.register(QuadricNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    return (
        surface.cx + _pushed(surface.ax, surface.bx, x0 - surface.cx, px, kappa),
        surface.cy + _pushed(surface.ay, surface.by, y0 - surface.cy, py, kappa),
        surface.cz + _pushed(surface.az, surface.bz, z0 - surface.cz, pz, kappa),
    )


@base.resolve.register(QuadricNumbers)
def _(surface, x, y, z, strength):
    # (1 + 2 strength A) s = r - strength b
    dx, dy, dz = _from_center(surface, x, y, z)
    wx, wy, wz = _widths(surface, 2.0 * strength)
    return (
        surface.cx + wx * (dx - strength * surface.bx),
        surface.cy + wy * (dy - strength * surface.by),
        surface.cz + wz * (dz - strength * surface.bz),
    )


@base.rise.register(QuadricNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    ux, uy, uz, ex, ey, ez, wx, wy, wz = _step(surface, x0, y0, z0, px, py, pz, kappa)
    # dr1/dkappa = -D/(1 + kappa A), and grad q(r1) = D + A (r1 - r0)
    fx = (ux + surface.ax * ex) * ux * wx
    fy = (uy + surface.ay * ey) * uy * wy
    fz = (uz + surface.az * ez) * uz * wz
    return ux * ex + uy * ey + uz * ez, -(fx + fy + fz)


@base.farthest_push.register(QuadricNumbers)
def _(surface):
    # The first pole of 1/(1 + kappa A) on the side to which the surface pushes
    side = surface.side
    steepest = max(-side * surface.ax, -side * surface.ay, -side * surface.az)
    return side * select(steepest > 0.0, 1.0 / select(steepest > 0.0, steepest, 1.0), math.inf)


@base.settle.register(QuadricNumbers)
def _(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    g2 = gx * gx + gy * gy + gz * gz
    f = base.phi(surface, x, y, z) / select(g2 > _TINY, g2, 1.0)
    return x - f * gx, y - f * gy, z - f * gz

"""What kernels do with a surface of one's own, whose code the subclasses of its numbers know."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...checks import Vector
from ...kernel.jit import inlined, outlined, select
from .. import base, smooth
from ..course import rise_time

_EPSILON = 2.220446049250313e-16
# Safe steps of one march; what is not found by then goes on in the next pass.
_MARCH = 200
# Points this close, relative to the size, are joined by Gauss's rule, whose error is the 7th power; its outer node.
_SHORT = 1e-2
_NODE = 0.5 * math.sqrt(0.6)

Six = tuple[float, float, float, float, float, float]


class Bend(NamedTuple):
    """Bounds of side H, H = grad grad phi/2: of its eigenvalues, and of its entries (xx, yy, zz, xy, yz, zx)."""

    least: float
    most: float
    low: Six
    high: Six

    @classmethod
    def of_magnitude(cls, curvature: float) -> "Bend":
        """|w.H w| <= curvature/2 for every unit vector w."""
        k = 0.5 * curvature
        return cls(-k, k, (-k, -k, -k, 0.0, 0.0, 0.0), (k, k, k, 0.0, 0.0, 0.0))

    @classmethod
    def of_entries(cls, low: Any, high: Any) -> "Bend":
        """From bounds of the entries in each of many cells, (6, cells)."""
        matrix = [0, 3, 5, 3, 1, 4, 5, 4, 2]
        middle, radius = (part[matrix].T.reshape(-1, 3, 3) for part in (0.5 * (low + high), 0.5 * (high - low)))
        # |lambda(A + E) - lambda(A)| <= |E|, the largest sum of a row; and the round-off of lambda(A)
        values = np.linalg.eigvalsh(middle)
        room = radius.sum(axis=2).max(axis=1) + 64.0 * _EPSILON * np.abs(values).max(axis=1)
        return cls(
            float((values[:, 0] - room).min()),
            float((values[:, 2] + room).max()),
            tuple(low.min(axis=1).tolist()),
            tuple(high.max(axis=1).tolist()),
        )


class OwnNumbers(NamedTuple):
    """What kernels know of a surface of one's own; its subclasses know phi. The box is relative to the centre."""

    cx: float
    cy: float
    cz: float
    side: float
    step: float  # of the differences that stand for second derivatives
    size: float
    bend: Bend
    low: Vector
    high: Vector
    # 1 where there is surely no wall outside the box, and how far outside of it the bend is known
    closed: float
    margin: float
    parameters: Any


# --- The level set ---------------------------------------------------------------------------------------


@smooth.hessian.register(OwnNumbers)
def _(surface, x, y, z):
    h = surface.step
    ax, ay, az = base.gradient(surface, x + h, y, z)
    bx, by, bz = base.gradient(surface, x - h, y, z)
    cx, cy, cz = base.gradient(surface, x, y + h, z)
    dx, dy, dz = base.gradient(surface, x, y - h, z)
    ex, ey, ez = base.gradient(surface, x, y, z + h)
    fx, fy, fz = base.gradient(surface, x, y, z - h)
    # H = grad grad q/2, made symmetric
    f = 0.25 / h
    return (
        f * (ax - bx),
        f * (cy - dy),
        f * (ez - fz),
        0.5 * f * (ay - by + cx - dx),
        0.5 * f * (cz - dz + ey - fy),
        0.5 * f * (ex - fx + az - bz),
    )


@smooth.difference.register(OwnNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    if max(abs(dx), abs(dy), abs(dz)) > _SHORT * surface.size:
        return base.phi(surface, x1, y1, z1) - base.phi(surface, x0, y0, z0)
    # Of close points the difference of phi has few digits: the integral of grad phi.d, by Gauss's rule of three points
    mx, my, mz = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1)
    ex, ey, ez = _NODE * dx, _NODE * dy, _NODE * dz
    ax, ay, az = base.gradient(surface, mx - ex, my - ey, mz - ez)
    bx, by, bz = base.gradient(surface, mx, my, mz)
    cx, cy, cz = base.gradient(surface, mx + ex, my + ey, mz + ez)
    return (
        (5.0 * (ax + cx) + 8.0 * bx) * dx + (5.0 * (ay + cy) + 8.0 * by) * dy + (5.0 * (az + cz) + 8.0 * bz) * dz
    ) / 18.0


# --- Flight ----------------------------------------------------------------------------------------------


@inlined
def _outside(surface, x, y, z):
    """The distance outside the box, by its largest component; below 0 inside."""
    dx, dy, dz = x - surface.cx, y - surface.cy, z - surface.cz
    across = max(surface.low[0] - dx, dx - surface.high[0])
    across = max(across, surface.low[1] - dy, dy - surface.high[1])
    return max(across, surface.low[2] - dz, dz - surface.high[2])


@smooth.bend.register(OwnNumbers)
def _(surface, x, y, z):
    # Around a solid the bend is known up to the margin; half way there `clearance` takes over.
    magnitude = max(abs(surface.bend.least), abs(surface.bend.most))
    if surface.closed == 0.0:
        return surface.bend.most, magnitude, surface.size
    out = _outside(surface, x, y, z)
    return (
        surface.bend.most,
        magnitude,
        select(out > 0.5 * surface.margin, out, min(surface.margin - out, surface.size)),
    )


@smooth.clearance.register(OwnNumbers)
def _(surface, x, y, z):
    return select(surface.closed > 0.0, max(_outside(surface, x, y, z), 0.0), 0.0)


@inlined
def _quadratic(vx, vy, vz, entries, least_xy, least_yz, least_zx):
    """v.H v with the entries of H, those off the diagonal chosen by the sign of their factor."""
    xy, yz, zx = 2.0 * vx * vy, 2.0 * vy * vz, 2.0 * vz * vx
    sum = entries[0] * vx * vx + entries[1] * vy * vy + entries[2] * vz * vz
    sum += select(xy > 0.0, entries[3], least_xy) * xy
    return sum + select(yz > 0.0, entries[4], least_yz) * yz + select(zx > 0.0, entries[5], least_zx) * zx


@inlined
def _slab(low, high, x, v):
    """When a flight is between two planes: (from, until)."""
    if v == 0.0:
        within = low <= x <= high
        return select(within, -math.inf, math.inf), select(within, math.inf, -math.inf)
    a, b = (low - x) / v, (high - x) / v
    return min(a, b), max(a, b)


@inlined
def _in_box(surface, x, y, z, vx, vy, vz):
    """When a straight flight is in the box of a solid: (from, until), the first after the second if never."""
    a, b = _slab(surface.low[0], surface.high[0], x - surface.cx, vx)
    c, d = _slab(surface.low[1], surface.high[1], y - surface.cy, vy)
    e, f = _slab(surface.low[2], surface.high[2], z - surface.cz, vz)
    return max(a, c, e, 0.0), min(b, d, f)


@base.first_hit.register(OwnNumbers)
def _(surface, x, y, z, vx, vy, vz):
    return _straight(surface, x, y, z, vx, vy, vz)


@outlined
def _straight(surface, x, y, z, vx, vy, vz):
    """Safe steps to the first root along a straight flight, whose second derivative has the same bounds everywhere."""
    t, end = 0.0, math.inf
    speed2 = vx * vx + vy * vy + vz * vz
    if speed2 == 0.0:
        return math.inf, True
    if surface.closed > 0.0:
        t, end = _in_box(surface, x, y, z, vx, vy, vz)
        if not t <= end:
            return math.inf, True
    bend = surface.bend
    # least <= v.side H v <= most
    most = _quadratic(vx, vy, vz, bend.high, bend.low[3], bend.low[4], bend.low[5])
    least = _quadratic(vx, vy, vz, bend.low, bend.high[3], bend.high[4], bend.high[5])
    most, least = min(most, bend.most * speed2), max(least, bend.least * speed2)
    resolved = 2.0 * _EPSILON / math.sqrt(speed2)
    before = t
    for i in range(_MARCH):
        px, py, pz = x + t * vx, y + t * vy, z + t * vz
        level = surface.side * base.phi(surface, px, py, pz)
        sx, sy, sz = base.gradient(surface, px, py, pz)
        half = 0.5 * surface.side * (sx * vx + sy * vy + sz * vz)
        if level > 0.0 and half > 0.0 and i > 0:
            # Past the wall by round-off, or because the surface bends more than was said.
            return smooth._bisected(surface, x, y, z, vx, vy, vz, 0.0, 0.0, 0.0, before, t), True
        step = rise_time(level, half, most)
        if not t + step <= end or not step < math.inf:
            return math.inf, True
        before, t = t, t + step
        # What is left of the level after the step is at most (most - least) step^2, the rise there at least this.
        rising = half + least * step
        shortest = resolved * (abs(px) + abs(py) + abs(pz) + math.sqrt(speed2) * step)
        if (i > 0 or rising > 0.0 or step == 0.0) and (
            step <= shortest or (most - least) * step * step <= 2.0 * shortest * rising
        ):
            return t, True
    return t, False


# --- Contact ---------------------------------------------------------------------------------------------


@base.farthest_push.register(OwnNumbers)
def _(surface):
    # 1 + kappa H has its first pole at the least eigenvalue of side H.
    return surface.side * select(surface.bend.least < 0.0, -1.0 / surface.bend.least, math.inf)

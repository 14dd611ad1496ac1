"""Matrices of second derivatives, and the curvature of a surface without a Hessian by central differences."""

import math

from ..kernel.jit import select
from ..kernel.limits import TINY
from ..kernel.vector import Symmetric, Vec, dot, square
from ..state import Floats

# The length of a difference as a part of a length of the surface, the cube root of round-off: the truncation error
# of the difference and the round-off of its terms are alike.
SPACING = 6e-6
# The entries of a `Symmetric` in the order of the rows of the matrix.
_ROWS = [0, 3, 5, 3, 1, 4, 5, 4, 2]


def matrices_of(entries: Floats) -> Floats:
    """The symmetric matrices (n, 3, 3) with these entries (6, n), in the order of `Symmetric`."""
    return entries[_ROWS].T.reshape(-1, 3, 3)


def inverse(a):
    """The inverse of a symmetric matrix."""
    x, y, z = a.yy * a.zz - a.yz * a.yz, a.xx * a.zz - a.zx * a.zx, a.xx * a.yy - a.xy * a.xy
    xy, yz, zx = a.yz * a.zx - a.xy * a.zz, a.xy * a.zx - a.yz * a.xx, a.xy * a.yz - a.zx * a.yy
    whole = a.xx * x + a.xy * xy + a.zx * zx
    f = 1.0 / select(abs(whole) > TINY, whole, 1.0)
    return Symmetric(f * x, f * y, f * z, f * xy, f * yz, f * zx)


def applied(a, v):
    """A symmetric matrix times a vector."""
    return Vec(
        a.xx * v.x + a.xy * v.y + a.zx * v.z, a.xy * v.x + a.yy * v.y + a.yz * v.z, a.zx * v.x + a.yz * v.y + a.zz * v.z
    )


def half_hessian(wall, r, h, sign=1.0):
    """Return sign grad grad phi/2, by central differences with the spacing h."""
    f = 0.25 * sign / h
    x, y = _turn(wall, r, Vec(h, 0.0, 0.0), f), _turn(wall, r, Vec(0.0, h, 0.0), f)
    z = _turn(wall, r, Vec(0.0, 0.0, h), f)
    return Symmetric(x.x, y.y, z.z, x.y, y.z, x.z)


def _turn(wall, r, step, f):
    return f * (wall.gradient(r + step) - wall.gradient(r - step))


def outward_acceleration(wall, r, v, pull):
    """The second derivative of the distance outside of a wall along a free flight [m/s^2]."""
    speed2 = square(v)
    # A part of the scale of places at which the normal of the wall turns little on the way.
    step = SPACING * wall.gap_scale(r)
    time = step / math.sqrt(select(speed2 > 0.0, speed2, 1.0))
    turned = wall.unit_normal(r + time * v) - wall.unit_normal(r - time * v)
    return dot(turned, v) / (2.0 * select(time > 0.0, time, 1.0)) + dot(wall.unit_normal(r), pull)

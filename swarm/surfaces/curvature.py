"""How a surface without a Hessian bends, by central differences of its gradient or of its normal."""

import math

from ..kernel.jit import select
from ..kernel.vector import Symmetric, Vec, dot, square

# The part of a length for a difference, the cube root of round-off: the error of the difference and that of its
# terms are alike.
SPACING = 6e-6


def half_hessian(wall, r, h, sign=1.0):
    """sign grad grad phi/2, by differences over h to both sides."""
    f = 0.25 * sign / h
    x, y = _turn(wall, r, Vec(h, 0.0, 0.0), f), _turn(wall, r, Vec(0.0, h, 0.0), f)
    z = _turn(wall, r, Vec(0.0, 0.0, h), f)
    return Symmetric(x.x, y.y, z.z, x.y, y.z, x.z)


def _turn(wall, r, step, f):
    return f * (wall.gradient(r + step) - wall.gradient(r - step))


def outward_acceleration(wall, r, v, pull):
    """The second derivative of the distance outside of a wall along a free flight [m/s^2]."""
    speed2 = square(v)
    # So much of the scale of places of the wall that its normal turns little on the way.
    step = SPACING * wall.gap_scale(r)
    time = step / math.sqrt(select(speed2 > 0.0, speed2, 1.0))
    turned = wall.unit_normal(r + time * v) - wall.unit_normal(r - time * v)
    return dot(turned, v) / (2.0 * select(time > 0.0, time, 1.0)) + dot(wall.unit_normal(r), pull)

"""How a surface without a Hessian bends along a flight, by central differences of its normal."""

import math

from ..kernel.jit import select
from ..kernel.vector import dot, square

# The cube root of round-off: where the error of the difference and that of its terms are alike.
_SPACING = 6e-6


def outward_acceleration(wall, r, v, pull):
    """The second derivative of the distance outside of a wall along a free flight [m/s^2]."""
    speed2 = square(v)
    # So much of the scale of places of the wall that its normal turns little on the way.
    step = _SPACING * wall.gap_scale(r)
    time = step / math.sqrt(select(speed2 > 0.0, speed2, 1.0))
    turned = wall.unit_normal(r + time * v) - wall.unit_normal(r - time * v)
    return dot(turned, v) / (2.0 * select(time > 0.0, time, 1.0)) + dot(wall.unit_normal(r), pull)

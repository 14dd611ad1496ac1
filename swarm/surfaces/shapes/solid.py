"""A solid body with edges: what its parts have in common; phi is the largest of the parts' phi, and inner function.

A part is a wall whose admissible side is outside of it. The body is hit when the flight is inside of all parts.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...kernel.gravity import Gravity, Nothing, accelerated, displacement
from ...kernel.jit import by_type, inlined, outlined
from .. import base, smooth
from ..chain import Chain
from ..flights import hit
from ..rotation import Rotated
from .plane import PlaneNumbers

_EPSILON = 2.220446049250313e-16
# Round-off of a part's level, in units of the last place of its largest terms.
_ULPS = 32.0
# Times that a flight may find a part still to be entered, or entered again, before it goes on in the next pass.
_ENTRIES = 50
# Part of the coordinates over which the gradient is differenced: the cube root of the round-off.
_SPACING = 6e-6


class SolidNumbers(NamedTuple):
    """What kernels know of a body: its parts, and a length that bounds the round-off of their coordinates."""

    parts: Any  # Chain or None
    side: float
    extent: float


def body(parts: Sequence[Any], extent: float = 0.0) -> SolidNumbers:
    """The intersection of parts, each the numbers of a wall that is admissible outside of the part.

    Args:
        parts: numbers of walls with side -1, or of planes, whose part is where normal.r > offset.
        extent: distance from the origin within which the parts' centres lie [m], where that is far.
    """
    chain = None
    for part in reversed(parts):
        chain = Chain(part, chain)
    return SolidNumbers(chain, -1.0, float(extent))


@by_type
def _sign(part):
    """The sign with which phi of a part rises out of it."""
    return 1.0


@_sign.register(PlaneNumbers)
def _(part):
    return -1.0


@_sign.register(Rotated)
def _(part):
    return _sign(part.body)


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(SolidNumbers)
def _(surface, x, y, z):
    return _largest(surface.parts, x, y, z)[0]


@base.gradient.register(SolidNumbers)
def _(surface, x, y, z):
    _phi, gx, gy, gz = _largest(surface.parts, x, y, z)
    return gx, gy, gz


@by_type
def _largest(parts, x, y, z):
    """The largest phi of the parts, and its gradient."""
    raise NotImplementedError


@_largest.register(Chain)
def _(parts, x, y, z):
    sign = _sign(parts.first)
    here, other = sign * base.phi(parts.first, x, y, z), _largest(parts.rest, x, y, z)
    gx, gy, gz = base.gradient(parts.first, x, y, z)
    # No select: these may be arrays.
    use = 1.0 * (here >= other[0])
    return (
        np.maximum(here, other[0]),
        use * sign * gx + (1.0 - use) * other[1],
        use * sign * gy + (1.0 - use) * other[2],
        use * sign * gz + (1.0 - use) * other[3],
    )


@_largest.register(Nothing)
def _(parts, x, y, z):
    return -math.inf, 0.0, 0.0, 0.0


@smooth.hessian.register(SolidNumbers)
def _(surface, x, y, z):
    h = _SPACING * (abs(x) + abs(y) + abs(z) + surface.extent) + np.finfo(np.float64).tiny
    return _bend_of_largest(surface.parts, x, y, z, h)[1:]


@by_type
def _bend_of_largest(parts, x, y, z, h):
    """The largest phi of the parts, and half its second derivatives (xx, yy, zz, xy, yz, zx), by differences."""
    raise NotImplementedError


@_bend_of_largest.register(Chain)
def _(parts, x, y, z, h):
    other = _bend_of_largest(parts.rest, x, y, z, h)
    sign = _sign(parts.first)
    here = sign * base.phi(parts.first, x, y, z)
    if here < other[0]:
        return other
    f = 0.25 * sign / h
    ax, ay, az = base.gradient(parts.first, x + h, y, z)
    bx, by, bz = base.gradient(parts.first, x - h, y, z)
    xx, xy, zx = f * (ax - bx), f * (ay - by), f * (az - bz)
    ax, ay, az = base.gradient(parts.first, x, y + h, z)
    bx, by, bz = base.gradient(parts.first, x, y - h, z)
    yy, yz = f * (ay - by), f * (az - bz)
    ax, ay, az = base.gradient(parts.first, x, y, z + h)
    bx, by, bz = base.gradient(parts.first, x, y, z - h)
    return here, xx, yy, f * (az - bz), xy, yz, zx


@_bend_of_largest.register(Nothing)
def _(parts, x, y, z, h):
    return -math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


# --- Flight ----------------------------------------------------------------------------------------------


@base.first_hit.register(SolidNumbers)
def _(surface, x, y, z, vx, vy, vz):
    return _entry(surface, None, x, y, z, vx, vy, vz)


@base.falling_hit.register(SolidNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    return _entry(surface, Gravity(gx, gy, gz), x, y, z, vx, vy, vz)


@outlined
def _entry(surface, gravity, x, y, z, vx, vy, vz):
    """When the flight is inside of all parts for the first time: (time, whether it is then)."""
    t = 0.0
    for _i in range(_ENTRIES):
        dx, dy, dz = displacement(gravity, vx, vy, vz, t)
        px, py, pz = x + dx, y + dy, z + dz
        wx, wy, wz = accelerated(gravity, vx, vy, vz, t)
        # Until the last of the parts is entered the flight is outside of that one; by then it may have left another.
        wait, found = _last_entry(surface.parts, gravity, surface.extent, px, py, pz, wx, wy, wz)
        if not found or not wait < math.inf:
            return t + wait, found
        sx, sy, sz = displacement(gravity, wx, wy, wz, wait)
        # The place is known to round-off of its own coordinates and of those the flight comes from.
        coordinates = abs(px) + abs(py) + abs(pz) + abs(x) + abs(y) + abs(z)
        if abs(sx) + abs(sy) + abs(sz) <= 4.0 * _EPSILON * (coordinates + surface.extent):
            return t + wait, True
        t += wait
    return t, False


@by_type
def _last_entry(parts, gravity, extent, x, y, z, vx, vy, vz):
    """When the last of the parts is entered that the particle is not inside of: (time, whether it is then)."""
    raise NotImplementedError


@_last_entry.register(Chain)
def _(parts, gravity, extent, x, y, z, vx, vy, vz):
    time, found = _last_entry(parts.rest, gravity, extent, x, y, z, vx, vy, vz)
    # On the face of a part, which is left or entered now, the sign of the approach decides.
    if _depth(parts.first, x, y, z) > _noise(parts.first, extent, x, y, z):
        return time, found
    here, found_here = hit(gravity, parts.first, x, y, z, vx, vy, vz)
    if here > time:
        return here, found_here
    return time, found


@_last_entry.register(Nothing)
def _(parts, gravity, extent, x, y, z, vx, vy, vz):
    return 0.0, True


@inlined
def _depth(part, x, y, z):
    """The gap of a part: above 0 inside of it."""
    return base.gap_of(part, base.inner(part, x, y, z))


@inlined
def _noise(part, extent, x, y, z):
    """The round-off of that gap."""
    gx, gy, gz = base.gradient(part, x, y, z)
    terms = base.gap_scale(part, x, y, z) + extent * (abs(gx) + abs(gy) + abs(gz)) + abs(base.gap_of(part, 0.0))
    return _ULPS * _EPSILON * terms


@base.safe_time.register(SolidNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    return _longest_safe_time(surface.parts, x, y, z, vx, vy, vz, gx, gy, gz)


@by_type
def _longest_safe_time(parts, x, y, z, vx, vy, vz, gx, gy, gz):
    """Outside of one part is outside of the body."""
    raise NotImplementedError


@_longest_safe_time.register(Chain)
def _(parts, x, y, z, vx, vy, vz, gx, gy, gz):
    here = base.safe_time(parts.first, x, y, z, vx, vy, vz, gx, gy, gz)
    return max(here, _longest_safe_time(parts.rest, x, y, z, vx, vy, vz, gx, gy, gz))


@_longest_safe_time.register(Nothing)
def _(parts, x, y, z, vx, vy, vz, gx, gy, gz):
    return 0.0


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(SolidNumbers)
def _(surface, x, y, z):
    _depth, nx, ny, nz = _outermost(surface.parts, x, y, z)
    return nx, ny, nz


@by_type
def _outermost(parts, x, y, z):
    """The distance into the part that the point is least deep in, and that part's normal."""
    raise NotImplementedError


@_outermost.register(Chain)
def _(parts, x, y, z):
    other = _outermost(parts.rest, x, y, z)
    depth = base.distance(parts.first, x, y, z)
    if depth > other[0]:
        return other
    nx, ny, nz = base.unit_normal(parts.first, x, y, z)
    return depth, nx, ny, nz


@_outermost.register(Nothing)
def _(parts, x, y, z):
    return math.inf, 0.0, 0.0, 0.0


@base.farthest_push.register(SolidNumbers)
def _(surface):
    # phi is about the distance, whose faces are flat or wide: no pole within a push.
    return -math.inf

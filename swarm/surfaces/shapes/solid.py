"""A solid body with edges: what its parts have in common; phi is the largest of the parts' phi, and inner function.

A part is a wall whose admissible side is outside of it. The body is hit when the flight is inside of all parts.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...kernel.gravity import Gravity, Nothing, accelerated, displacement
from ...kernel.jit import by_type, inlined, outlined
from ...kernel.vector import ZERO, Symmetric, Vec, absolute, total
from .. import contract
from ..flights import hit
from ..fold import Chain
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


_sign.register(PlaneNumbers, lambda part: -1.0)
_sign.register(Rotated, lambda part: _sign(part.body))


# --- The level set ---------------------------------------------------------------------------------------

contract.phi.register(SolidNumbers, lambda surface, r: _largest(surface.parts, r)[0])
contract.gradient.register(SolidNumbers, lambda surface, r: _largest(surface.parts, r)[1])


@by_type
def _largest(parts, r):
    """The largest phi of the parts, and its gradient."""
    raise NotImplementedError


@_largest.register(Chain)
def _(parts, r):
    sign = _sign(parts.first)
    here, (other, gradient) = sign * contract.phi(parts.first, r), _largest(parts.rest, r)
    # No select: these may be arrays.
    use = 1.0 * (here >= other)
    return np.maximum(here, other), (use * sign) * contract.gradient(parts.first, r) + (1.0 - use) * gradient


_largest.register(Nothing, lambda parts, r: (-math.inf, ZERO))


@contract.hessian.register(SolidNumbers)
def _(surface, r):
    h = _SPACING * (total(absolute(r)) + surface.extent) + np.finfo(np.float64).tiny
    return _bend_of_largest(surface.parts, r, h)[1]


@by_type
def _bend_of_largest(parts, r, h):
    """The largest phi of the parts, and half its second derivatives, by differences."""
    raise NotImplementedError


@_bend_of_largest.register(Chain)
def _(parts, r, h):
    other = _bend_of_largest(parts.rest, r, h)
    sign = _sign(parts.first)
    here = sign * contract.phi(parts.first, r)
    if here < other[0]:
        return other
    f = 0.25 * sign / h
    x, y = _turn(parts.first, r, Vec(h, 0.0, 0.0), f), _turn(parts.first, r, Vec(0.0, h, 0.0), f)
    z = _turn(parts.first, r, Vec(0.0, 0.0, h), f)
    return here, Symmetric(x.x, y.y, z.z, x.y, y.z, x.z)


@inlined
def _turn(part, r, step, f):
    return f * (contract.gradient(part, r + step) - contract.gradient(part, r - step))


_bend_of_largest.register(Nothing, lambda parts, r, h: (-math.inf, Symmetric(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))


# --- Flight ----------------------------------------------------------------------------------------------

contract.first_hit.register(SolidNumbers, lambda surface, r, v: _entry(surface, None, r, v))


@contract.falling_hit.register(SolidNumbers)
def _(surface, r, v, pull):
    return _entry(surface, Gravity(pull.x, pull.y, pull.z), r, v)


@outlined
def _entry(surface, gravity, r, v):
    """When the flight is inside of all parts for the first time: (time, whether it is then)."""
    t = 0.0
    for _i in range(_ENTRIES):
        p, w = r + displacement(gravity, v, t), accelerated(gravity, v, t)
        # Until the last of the parts is entered the flight is outside of that one; by then it may have left another.
        wait, found = _last_entry(surface.parts, gravity, surface.extent, p, w)
        if not found or not wait < math.inf:
            return t + wait, found
        moved = total(absolute(displacement(gravity, w, wait)))
        # The place is known to round-off of its own coordinates and of those the flight comes from.
        coordinates = total(absolute(p)) + abs(r.x) + abs(r.y) + abs(r.z)
        if moved <= 4.0 * _EPSILON * (coordinates + surface.extent):
            return t + wait, True
        t += wait
    return t, False


@by_type
def _last_entry(parts, gravity, extent, r, v):
    """When the last of the parts is entered that the particle is not inside of: (time, whether it is then)."""
    raise NotImplementedError


@_last_entry.register(Chain)
def _(parts, gravity, extent, r, v):
    time, found = _last_entry(parts.rest, gravity, extent, r, v)
    # On the face of a part, which is left or entered now, the sign of the approach decides.
    depth = contract.gap_of(parts.first, contract.inner(parts.first, r))
    if depth > noise(parts.first, extent, r):
        return time, found
    here, found_here = hit(gravity, parts.first, r, v)
    if here > time:
        return here, found_here
    return time, found


_last_entry.register(Nothing, lambda parts, gravity, extent, r, v: (0.0, True))


@inlined
def noise(part, extent, r):
    """The round-off of the gap of a part."""
    gradient = total(absolute(contract.gradient(part, r)))
    terms = contract.gap_scale(part, r) + extent * gradient + abs(contract.gap_of(part, 0.0))
    return _ULPS * _EPSILON * terms


contract.safe_time.register(SolidNumbers, lambda surface, r, v, pull: _longest_safe_time(surface.parts, r, v, pull))


@by_type
def _longest_safe_time(parts, r, v, pull):
    """Outside of one part is outside of the body."""
    raise NotImplementedError


@_longest_safe_time.register(Chain)
def _(parts, r, v, pull):
    return max(contract.safe_time(parts.first, r, v, pull), _longest_safe_time(parts.rest, r, v, pull))


_longest_safe_time.register(Nothing, lambda parts, r, v, pull: 0.0)


# --- Contact ---------------------------------------------------------------------------------------------

contract.unit_normal.register(SolidNumbers, lambda surface, r: _outermost(surface.parts, r)[1])


@by_type
def _outermost(parts, r):
    """The distance into the part that the point is least deep in, and that part's normal."""
    raise NotImplementedError


@_outermost.register(Chain)
def _(parts, r):
    other = _outermost(parts.rest, r)
    depth = contract.distance(parts.first, r)
    if depth > other[0]:
        return other
    return depth, contract.unit_normal(parts.first, r)


_outermost.register(Nothing, lambda parts, r: (math.inf, ZERO))
# phi is about the distance, whose faces are flat or wide: no pole within a push.
contract.farthest_push.register(SolidNumbers, lambda surface: -math.inf)

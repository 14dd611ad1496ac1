"""A cell that repeats without end: when a flight leaves it, and the way back into it.

Every wall that reaches beyond a face, or close to one, is there a second time, shifted by the period: so the walls of a
particle in the cell, and a little outside of it, are all in the chain. A flight ends a little beyond the face at the
latest, so that no round-off decides whether it has left.
"""

import math
from typing import Any, NamedTuple

from ..kernel.gravity import Gravity
from ..kernel.jit import by_type, inlined, outlined, select
from ..kernel.vector import ZERO, Vec
from .course import rise_time
from .flights import Hit

# What leaves goes so far beyond the face, in lengths of the cell; a step that ends within twice that has left well.
_BEYOND = 5e-10
# Halvings of the part of a step after which it leaves.
_HALVINGS = 60


class Period(NamedTuple):
    """The cell: its length along each axis [m], None where it does not repeat.

    `fall` is the potential energy per mass of one image along each axis, None where gravity pulls along none of them.
    """

    x: Any
    y: Any
    z: Any
    fall: Any


class Return(NamedTuple):
    """A position in the cell, and by how many images along each axis it has come back."""

    r: Vec
    images: Vec


# --- Along one axis --------------------------------------------------------------------------------------


@by_type
def _image_of(length, x):
    """How many lengths to the cell a coordinate is that is at most one length beyond it."""
    return 0.0


@_image_of.register(float)
def _(length, x):
    # Below 0 by so little that the other face is what it rounds to: there it is on this one.
    return select(x >= length, 1.0, select((x < 0.0) & (x + length < length), -1.0, 0.0))


@by_type
def _inside(length, x):
    """The coordinate of the same place in the cell."""
    return x


@_inside.register(float)
def _(length, x):
    # The first difference is exact.
    back = x - _image_of(length, x) * length
    return select(back < 0.0, 0.0, back)


@by_type
def _time_to_leave(length, x, v, pull):
    """When a coordinate is a little beyond the faces."""
    return math.inf


@_time_to_leave.register(float)
def _(length, x, v, pull):
    return _time_beyond(pull, length, x, v)


@by_type
def _time_beyond(pull, length, x, v):
    """The same without gravity."""
    edge = select(v > 0.0, length + _BEYOND * length, -_BEYOND * length)
    return select(v != 0.0, (edge - x) / v, math.inf)


@_time_beyond.register(float)
def _(pull, length, x, v):
    beyond = _BEYOND * length
    up = rise_time(x - length - beyond, 0.5 * v, 0.5 * pull)
    down = rise_time(-x - beyond, -0.5 * v, -0.5 * pull)
    return select(up < down, up, down)


@by_type
def _along_x(gravity):
    """Gravity along an axis, None where there is none at all."""
    return


@by_type
def _along_y(gravity):
    return


@by_type
def _along_z(gravity):
    return


_along_x.register(Gravity, lambda gravity: gravity.x)
_along_y.register(Gravity, lambda gravity: gravity.y)
_along_z.register(Gravity, lambda gravity: gravity.z)


@by_type
def _is_beyond(length, x):
    """Whether a coordinate is farther outside than what leaves goes."""
    return False


@_is_beyond.register(float)
def _(length, x):
    beyond = 2.0 * _BEYOND * length
    return (x > length + beyond) | (x < -beyond)


@by_type
def _excess(length, x):
    """By how much a coordinate is beyond the place where a step that leaves is to end; below 0 within."""
    return -math.inf


@_excess.register(float)
def _(length, x):
    return abs(x - 0.5 * length) - (0.5 + _BEYOND) * length


# --- Of a particle ---------------------------------------------------------------------------------------


@by_type
def into(period, r):
    """The `Return` of a position into the cell."""
    return Return(r, ZERO)


@into.register(Period)
def _(period, r):
    images = Vec(_image_of(period.x, r.x), _image_of(period.y, r.y), _image_of(period.z, r.z))
    return Return(Vec(_inside(period.x, r.x), _inside(period.y, r.y), _inside(period.z, r.z)), images)


@by_type
def has_left(period, r):
    """Whether a position is outside the cell."""
    return False


@has_left.register(Period)
def _(period, r):
    back = into(period, r).r
    return (back.x != r.x) | (back.y != r.y) | (back.z != r.z)


@by_type
def is_beyond(period, r):
    """Whether a position is farther outside than walls are known."""
    return False


@is_beyond.register(Period)
def _(period, r):
    return _is_beyond(period.x, r.x) | _is_beyond(period.y, r.y) | _is_beyond(period.z, r.z)


@by_type
def cut(period, gravity, r, v, hit):
    """The `Hit` of a flight, or that it leaves the cell before."""
    return hit


@cut.register(Period)
def _(period, gravity, r, v, hit):
    x, y = _time_to_leave(period.x, r.x, v.x, _along_x(gravity)), _time_to_leave(period.y, r.y, v.y, _along_y(gravity))
    z = _time_to_leave(period.z, r.z, v.z, _along_z(gravity))
    first = select(x < y, x, y)
    first = select(first < z, first, z)
    leaves = first < hit.time
    return Hit(select(leaves, first, hit.time), select(leaves, -1.0, hit.wall))


@by_type
def part_until(period, step):
    """The part of a step after which it leaves; `step` is the polynomial r0 + s (a + s (b + s c)) as (r0, a, b, c)."""
    return math.inf


@part_until.register(Period)
def _(period, step):
    return _part_until(period, step)


@outlined
def _part_until(period, step):
    low, high = 0.0, 1.0
    for _k in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _is_out(period, step, middle):
            high = middle
        else:
            low = middle
    return high


@inlined
def _is_out(period, step, s):
    r0, a, b, c = step
    r = r0 + s * (a + s * (b + s * c))
    return (_excess(period.x, r.x) > 0.0) | (_excess(period.y, r.y) > 0.0) | (_excess(period.z, r.z) > 0.0)

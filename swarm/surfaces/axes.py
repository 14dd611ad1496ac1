"""One axis of a cell that repeats: where a coordinate is in it, and when it leaves it.

A length is a float, `Free` where all walls are the same along the axis, or None where the cell does not repeat.
"""

import math
from typing import NamedTuple

import numpy as np

from ..kernel.gravity import Gravity, Nothing
from ..kernel.jit import by_type, inlined, outlined, select
from .course import rise_time

# What leaves goes so far beyond the face, in lengths of the cell; a step that ends within twice that has left well.
_BEYOND = 5e-10
# A flight that goes on over cells ends after so many, whose number is a float with digits to spare for the position.
CELLS = 2.0**40
# Of a length of the cell, the part by which a flight may end later for the sake of its time.
_LATER = 1e-4


class Free(NamedTuple):
    """The length of the cell along an axis along which all walls are the same: its faces end no flight."""

    length: float


# --- Where it is -----------------------------------------------------------------------------------------


@by_type
def length_of(length):
    """The length of the cell along an axis, 0 where it does not repeat."""
    return length


length_of.register(Free, lambda length: length.length)
length_of.register(Nothing, lambda length: 0.0)


@by_type
def image_of(length, x):
    """How many lengths to the cell a coordinate is."""
    # Below 0 by so little that the other face is what it rounds to: there it is on this one.
    n = select(x >= length_of(length), 1.0, select((x < 0.0) & (x + length_of(length) < length_of(length)), -1.0, 0.0))
    if -length_of(length) < x < 2.0 * length_of(length):
        return n
    return _whole_lengths(length_of(length), x)


image_of.register(Nothing, lambda length, x: 0.0)


@outlined
def _whole_lengths(length, x):
    n = np.floor(x / length)
    # The quotient is rounded.
    back = x - n * length
    n = n + select(back >= length, 1.0, select(back < 0.0, -1.0, 0.0))
    # And so is the product, where there are many.
    return n + select(x - n * length >= length, 1.0, 0.0)


@by_type
def inside(length, x, n):
    """The coordinate of the same place in the cell, which is so many lengths away."""
    # One length beyond the face the difference is exact.
    back = x - n * length_of(length)
    return select(back < 0.0, 0.0, back)


inside.register(Nothing, lambda length, x, n: x)


@by_type
def is_out(length, x):
    """Whether a coordinate is outside the cell."""
    return (x >= length_of(length)) | (x < 0.0)


is_out.register(Nothing, lambda length, x: False)


@by_type
def is_free(length):
    """Whether all walls are the same along an axis: a constant for the compiler."""
    return False


is_free.register(Free, lambda length: True)


@by_type
def is_beyond_face(length, x):
    """Whether a coordinate is farther outside than what leaves goes."""
    return False


@is_beyond_face.register(float)
def _(length, x):
    beyond = 2.0 * _BEYOND * length
    return (x > length + beyond) | (x < -beyond)


@by_type
def excess(length, x):
    """By how much a coordinate is beyond the place where a step that leaves is to end; below 0 within."""
    return -math.inf


@excess.register(float)
def _(length, x):
    return abs(x - 0.5 * length) - (0.5 + _BEYOND) * length


# --- When it leaves --------------------------------------------------------------------------------------


@by_type
def time_to_leave(length, x, v, pull):
    """When a coordinate is a little beyond the faces."""
    return math.inf


@time_to_leave.register(float)
def _(length, x, v, pull):
    return _time_beyond(pull, length, x, v)


time_to_leave.register(Free, lambda length, x, v, pull: time_far(length, x, v, pull))


@by_type
def _time_beyond(pull, length, x, v):
    """The same without gravity."""
    edge = select(v > 0.0, length + _BEYOND * length, -_BEYOND * length)
    # Divisions are what a pass takes here: one an axis, which gaps ask for again.
    return select(v != 0.0, (edge - x) * (1.0 / v), math.inf)


@_time_beyond.register(float)
def _(pull, length, x, v):
    beyond = _BEYOND * length
    up = rise_time(x - length - beyond, 0.5 * v, 0.5 * pull)
    down = rise_time(-x - beyond, -0.5 * v, -0.5 * pull)
    return select(up < down, up, down)


@by_type
def time_out(pull, ends, x, v):
    """When a coordinate that is between two ends leaves them, without gravity."""
    low, high = ends
    edge = select(v > 0.0, high, low)
    return select(v != 0.0, (edge - x) * (1.0 / v), math.inf)


@time_out.register(float)
def _(pull, ends, x, v):
    low, high = ends
    up, down = rise_time(x - high, 0.5 * v, 0.5 * pull), rise_time(low - x, -0.5 * v, -0.5 * pull)
    return select(up < down, up, down)


@by_type
def time_far(length, x, v, pull):
    """When a coordinate is as many cells away as a flight may go."""
    far = CELLS * length_of(length)
    return time_out(pull, (-far, far), x, v)


time_far.register(Nothing, lambda length, x, v, pull: math.inf)


@by_type
def room_along(length):
    """How much farther along an axis a flight may end for the sake of its time."""
    return math.inf


room_along.register(float, lambda length: _LATER * length)


@by_type
def fastest(pull, v, t):
    """A speed that is not exceeded within a time t."""
    return abs(v)


fastest.register(float, lambda pull, v, t: abs(v) + abs(pull) * t)


@by_type
def along_x(gravity):
    """Gravity along x, None where there is none at all."""
    return


@by_type
def along_y(gravity):
    """The same along y."""
    return


@by_type
def along_z(gravity):
    """The same along z."""
    return


along_x.register(Gravity, lambda gravity: gravity.x)
along_y.register(Gravity, lambda gravity: gravity.y)
along_z.register(Gravity, lambda gravity: gravity.z)


@inlined
def least(x, y, z):
    """The least of three."""
    first = select(x < y, x, y)
    return select(first < z, first, z)


@inlined
def most(x, y, z):
    """The greatest of three."""
    first = select(x > y, x, y)
    return select(first > z, first, z)

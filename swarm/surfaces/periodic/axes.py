"""One axis of a periodic cell: the place of a coordinate in it, and when the coordinate leaves it.

A length is a float, `Free` if all walls are the same along the axis, or None along an axis without a period.
"""

import math

import numpy as np

from ...kernel.jit import outlined, select
from ...kernel.record import Record
from ..time_of_impact.course import rise_time

# A flight that leaves ends this far beyond the face, in lengths of the cell; a step may end at most twice as far.
_BEYOND = 5e-10
# A flight over cells ends after this number; their number is a float with digits to spare for the position.
CELLS = 2.0**40
# A flight may end later by this part of a length of the cell, so that the rest of the frame is exact.
_LATER = 1e-4


class Free(Record):
    """The length of the cell along an axis along which all walls are the same: its faces end no flight."""

    length: float


# --- The place in the cell -------------------------------------------------------------------------------


def length_of(length):
    """Return the length of the cell along an axis, 0 without a period."""
    return 0.0 if length is None else length.length if isinstance(length, Free) else length


def image_of(length, x):
    """Return the number of lengths from a coordinate to the cell."""
    if length is None:
        return 0.0
    length = length_of(length)
    # If a coordinate just below 0 rounds to the upper face, it is on the lower one.
    n = select(x >= length, 1.0, select((x < 0.0) & (x + length < length), -1.0, 0.0))
    if -length < x < 2.0 * length:
        return n
    return _whole_lengths(length, x)


@outlined
def _whole_lengths(length, x):
    n = np.floor(x / length)
    # The quotient is rounded.
    back = x - n * length
    n = n + select(back >= length, 1.0, select(back < 0.0, -1.0, 0.0))
    # And so is the product, if the number is large.
    return n + select(x - n * length >= length, 1.0, 0.0)


def inside(length, x, n):
    """Return the coordinate of the same place in the cell, `n` lengths away."""
    if length is None:
        return x
    # One length beyond the face the difference is exact.
    back = x - n * length_of(length)
    return select(back < 0.0, 0.0, back)


def is_out(length, x):
    """Whether a coordinate is outside the cell."""
    return False if length is None else (x >= length_of(length)) | (x < 0.0)


def is_free(length):
    """Whether all walls are the same along an axis: a constant for the compiler."""
    return isinstance(length, Free)


def has_faces(length):
    """Whether the faces of the cell across an axis end flights: a constant for the compiler."""
    return not (length is None or isinstance(length, Free))


def is_beyond_face(length, x):
    """Whether a coordinate is farther outside than the end of a flight that leaves."""
    if not has_faces(length):
        return False
    beyond = 2.0 * _BEYOND * length
    return (x > length + beyond) | (x < -beyond)


def excess(length, x):
    """Return by how much a coordinate is beyond the place where a step that leaves is to end; below 0 within."""
    return abs(x - 0.5 * length) - (0.5 + _BEYOND) * length if has_faces(length) else -math.inf


# --- The time at which it leaves -------------------------------------------------------------------------


def time_to_leave(length, x, v, pull):
    """Return when a coordinate is a little beyond the faces."""
    if not has_faces(length):
        return time_far(length, x, v, pull)
    if pull is None:
        edge = select(v > 0.0, length + _BEYOND * length, -_BEYOND * length)
        # Divisions dominate the time of a pass: one for each axis, which gaps use again.
        return select(v != 0.0, (edge - x) * (1.0 / v), math.inf)
    beyond = _BEYOND * length
    up = rise_time(x - length - beyond, 0.5 * v, 0.5 * pull)
    down = rise_time(-x - beyond, -0.5 * v, -0.5 * pull)
    return select(up < down, up, down)


def time_out(pull, ends, x, v):
    """Return when a coordinate between two ends leaves them."""
    low, high = ends
    if pull is None:
        edge = select(v > 0.0, high, low)
        return select(v != 0.0, (edge - x) * (1.0 / v), math.inf)
    up, down = rise_time(x - high, 0.5 * v, 0.5 * pull), rise_time(low - x, -0.5 * v, -0.5 * pull)
    return select(up < down, up, down)


def time_far(length, x, v, pull):
    """Return when a coordinate is as many cells away as a flight may go."""
    if length is None:
        return math.inf
    far = CELLS * length_of(length)
    return time_out(pull, (-far, far), x, v)


def room_along(length):
    """Return the distance by which a flight may end farther along an axis to make its time exact."""
    return _LATER * length if has_faces(length) else math.inf


def fastest(pull, v, t):
    """Return a speed that is not exceeded within a time t."""
    return abs(v) if pull is None else abs(v) + abs(pull) * t


def pulls(gravity):
    """Return gravity along each axis; three times None without gravity."""
    return (None, None, None) if gravity is None else (gravity.x, gravity.y, gravity.z)


def least(x, y, z):
    """Return the least of three."""
    first = select(x < y, x, y)
    return select(first < z, first, z)


def most(x, y, z):
    """Return the greatest of three."""
    first = select(x > y, x, y)
    return select(first > z, first, z)

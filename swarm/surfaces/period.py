"""A cell that repeats without end: when a flight leaves it, and the way back into it.

Every wall that reaches beyond a face, or close to one, is there a second time, shifted by the period: so the walls of a
particle in the cell, and a little outside of it, are all in the chain. A flight ends a little beyond the face at the
latest, so that no round-off decides whether it has left; where no wall that has images is in the way it goes on over
any number of cells, which are counted at its end.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..kernel.gravity import Gravity, Nothing
from ..kernel.jit import by_type, inlined, outlined, select
from ..kernel.vector import ZERO, Vec
from .course import rise_time
from .flights import Hit

# What leaves goes so far beyond the face, in lengths of the cell; a step that ends within twice that has left well.
_BEYOND = 5e-10
# A flight that goes on over cells ends after so many, whose number is a float with digits to spare for the position.
_CELLS = 2.0**40
# Of a length of the cell, the part within which a flight begins at a face: as far beyond the other walls are known.
_AT_FACE = 5e-4
# Of a length of the cell, the part by which a flight may end later for the sake of its time.
_LATER = 1e-4
_EPSILON = 2.220446049250313e-16
# Halvings of the part of a step after which it leaves.
_HALVINGS = 60


class Free(NamedTuple):
    """The length of the cell along an axis along which all walls are the same: its faces end no flight."""

    length: float


class Gap(NamedTuple):
    """The coordinates along an axis between which no wall is that has images; it may go on beyond the upper face."""

    low: float
    high: float


class Beside(NamedTuple):
    """The coordinates below and above which no wall is that has images, along an axis that does not repeat."""

    low: float
    high: float


class Gaps(NamedTuple):
    """The gap along each axis, None where there is none; and whether there are walls without images, None for no."""

    x: Any
    y: Any
    z: Any
    walls: Any


class Period(NamedTuple):
    """The cell: its length along each axis [m], None where it does not repeat.

    `fall` is the potential energy per mass of one image along each axis, None where gravity pulls along none of them;
    `gaps` are those in which flights go on over all faces, or None where walls are known in the cell alone.
    """

    x: Any
    y: Any
    z: Any
    fall: Any
    gaps: Any = None


class Return(NamedTuple):
    """A position in the cell, and by how many images along each axis it has come back."""

    r: Vec
    images: Vec


# --- Along one axis --------------------------------------------------------------------------------------


@by_type
def length_of(length):
    """The length of the cell along an axis, 0 where it does not repeat."""
    return length


length_of.register(Free, lambda length: length.length)
length_of.register(Nothing, lambda length: 0.0)


@by_type
def _image_of(length, x):
    """How many lengths to the cell a coordinate is."""
    # Below 0 by so little that the other face is what it rounds to: there it is on this one.
    n = select(x >= length_of(length), 1.0, select((x < 0.0) & (x + length_of(length) < length_of(length)), -1.0, 0.0))
    if -length_of(length) < x < 2.0 * length_of(length):
        return n
    return _whole_lengths(length_of(length), x)


_image_of.register(Nothing, lambda length, x: 0.0)


@outlined
def _whole_lengths(length, x):
    n = np.floor(x / length)
    # The quotient is rounded.
    back = x - n * length
    n = n + select(back >= length, 1.0, select(back < 0.0, -1.0, 0.0))
    # And so is the product, where there are many.
    return n + select(x - n * length >= length, 1.0, 0.0)


@by_type
def _inside(length, x, n):
    """The coordinate of the same place in the cell, which is so many lengths away."""
    # One length beyond the face the difference is exact.
    back = x - n * length_of(length)
    return select(back < 0.0, 0.0, back)


_inside.register(Nothing, lambda length, x, n: x)


@by_type
def _is_out(length, x):
    """Whether a coordinate is outside the cell."""
    return (x >= length_of(length)) | (x < 0.0)


_is_out.register(Nothing, lambda length, x: False)


@by_type
def _is_free(length):
    """Whether all walls are the same along an axis: a constant for the compiler."""
    return False


_is_free.register(Free, lambda length: True)


@by_type
def _time_to_leave(length, x, v, pull):
    """When a coordinate is a little beyond the faces."""
    return math.inf


@_time_to_leave.register(float)
def _(length, x, v, pull):
    return _time_beyond(pull, length, x, v)


_time_to_leave.register(Free, lambda length, x, v, pull: _time_far(length, x, v, pull))


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
def _time_in(gap, length, x, v, pull):
    """How long a coordinate stays in a gap; 0 where it is not in it."""
    return 0.0


@_time_in.register(Gap)
def _(gap, length, x, v, pull):
    x = x + select(x < gap.low, length_of(length), 0.0)
    return select((x > gap.low) & (x < gap.high), _time_out(pull, gap, x, v), 0.0)


@_time_in.register(Beside)
def _(gap, length, x, v, pull):
    below, above = x < gap.low, x > gap.high
    # Below is what is above of -x.
    far, towards = select(below, x - gap.low, gap.high - x), select(below, v, -v)
    return select(below | above, _time_to_reach(pull, far, towards, below), 0.0)


@by_type
def _time_to_reach(pull, far, v, below):
    """When a coordinate so far below 0 reaches it, without gravity."""
    return select(v > 0.0, -far * (1.0 / v), math.inf)


@_time_to_reach.register(float)
def _(pull, far, v, below):
    return rise_time(far, 0.5 * v, select(below, 0.5 * pull, -0.5 * pull))


@by_type
def _time_out(pull, gap, x, v):
    """When a coordinate that is in a gap leaves it, without gravity."""
    edge = select(v > 0.0, gap.high, gap.low)
    return select(v != 0.0, (edge - x) * (1.0 / v), math.inf)


@_time_out.register(float)
def _(pull, gap, x, v):
    up, down = rise_time(x - gap.high, 0.5 * v, 0.5 * pull), rise_time(gap.low - x, -0.5 * v, -0.5 * pull)
    return select(up < down, up, down)


@by_type
def _time_far(length, x, v, pull):
    """When a coordinate is as many cells away as a flight may go."""
    far = _CELLS * length_of(length)
    return _time_out(pull, Gap(-far, far), x, v)


_time_far.register(Nothing, lambda length, x, v, pull: math.inf)


@by_type
def _is_short(length, v, pull, t, late):
    """Whether it makes no odds that a flight over a time t ends later by so little."""
    return True


@_is_short.register(float)
def _(length, v, pull, t, late):
    return _fastest(pull, v, t) * late <= _LATER * length


@by_type
def _fastest(pull, v, t):
    """A speed that is not exceeded within a time t."""
    return abs(v)


_fastest.register(float, lambda pull, v, t: abs(v) + abs(pull) * t)


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
    n = Vec(_image_of(period.x, r.x), _image_of(period.y, r.y), _image_of(period.z, r.z))
    return Return(Vec(_inside(period.x, r.x, n.x), _inside(period.y, r.y, n.y), _inside(period.z, r.z, n.z)), n)


@by_type
def has_left(period, r):
    """Whether a position is outside the cell."""
    return False


@has_left.register(Period)
def _(period, r):
    return _is_out(period.x, r.x) | _is_out(period.y, r.y) | _is_out(period.z, r.z)


@by_type
def keeps_walls(period, r):
    """Whether the walls at a position outside the cell are those of its place in the cell, not images of others."""
    x = _is_free(period.x) | (not _is_out(period.x, r.x))
    y = _is_free(period.y) | (not _is_out(period.y, r.y))
    z = _is_free(period.z) | (not _is_out(period.z, r.z))
    # The first is a constant, without which this would cost 13 ns a face.
    return (_is_free(period.x) | _is_free(period.y) | _is_free(period.z)) & x & y & z


@by_type
def is_beyond(period, r):
    """Whether a position is farther outside than walls are known."""
    return False


@is_beyond.register(Period)
def _(period, r):
    return _is_beyond(period.x, r.x) | _is_beyond(period.y, r.y) | _is_beyond(period.z, r.z)


@by_type
def cut(period, gravity, motion, left, hit):
    """The `Hit` of a flight (r, v), or that it leaves the cell before; `left` is the time until the frame ends."""
    return hit


@cut.register(Period)
def _(period, gravity, motion, left, hit):
    r, v = motion
    x, y = _time_to_leave(period.x, r.x, v.x, _along_x(gravity)), _time_to_leave(period.y, r.y, v.y, _along_y(gravity))
    z = _time_to_leave(period.z, r.z, v.z, _along_z(gravity))
    late = _EPSILON * left
    first, hit = _over_faces(period.gaps, period, gravity, motion, (_least(x, y, z), hit, 2.0 * late))
    # What is left of the frame is rounded at each face, the same way each time: 0.1 m after 1e8 faces. So the flight
    # ends a little later, after a time that leaves exactly what it is rounded to.
    exact = left - (left - (first + late))
    short = _is_short(period.x, v.x, _along_x(gravity), first, late)
    short &= _is_short(period.y, v.y, _along_y(gravity), first, late)
    short &= _is_short(period.z, v.z, _along_z(gravity), first, late)
    time = select(short, exact, first)
    leaves = time < hit.time
    return Hit(select(leaves, time, hit.time), select(leaves, -1.0, hit.wall))


@by_type
def on_time(period, gravity, motion, left, time, room):
    """When a flight (r, v) among bodies ends that is free until `time`, and may go on by `room` along each axis.

    Where nothing repeats that is then.
    """
    return time


@on_time.register(Period)
def _(period, gravity, motion, left, time, room):
    _r, v = motion
    # As in `cut`: cells of a grid are as many as faces.
    late = _EPSILON * left
    exact = left - (left - (time + late))
    short = 2.0 * _fastest(_along_x(gravity), v.x, time) * late <= room.x
    short &= 2.0 * _fastest(_along_y(gravity), v.y, time) * late <= room.y
    short &= 2.0 * _fastest(_along_z(gravity), v.z, time) * late <= room.z
    return _longer(period.gaps, period, gravity, motion, (select(short, exact, time), 2.0 * late))


@by_type
def _longer(gaps, period, gravity, motion, ends):
    """The first of `ends`, or when the gap ends in which it flies, less the second."""
    time, _late = ends
    return time


@_longer.register(Gaps)
def _(gaps, period, gravity, motion, ends):
    time, late = ends
    longest = _time_in_gaps(gaps, period, gravity, motion) - late
    return select(longest > time, longest, time)


@inlined
def _time_in_gaps(gaps, period, gravity, motion):
    """How long a flight stays in a gap."""
    r, v = motion
    x = _time_in(gaps.x, period.x, r.x, v.x, _along_x(gravity))
    y = _time_in(gaps.y, period.y, r.y, v.y, _along_y(gravity))
    z = _time_in(gaps.z, period.z, r.z, v.z, _along_z(gravity))
    longest = select(x > y, x, y)
    return select(longest > z, longest, z)


@inlined
def _least(x, y, z):
    first = select(x < y, x, y)
    return select(first < z, first, z)


@by_type
def _over_faces(gaps, period, gravity, motion, ends):
    """When a flight leaves the cell, or the gap in which it goes on over faces; and its hit.

    `ends` are the first of these, the hit, and by how much the flight may end later.
    """
    first, hit, _late = ends
    return first, hit


@_over_faces.register(Gaps)
def _(gaps, period, gravity, motion, ends):
    leaves, hit, late = ends
    longest = _time_in_gaps(gaps, period, gravity, motion) - late
    longest = select(_is_line(gravity, period, motion, hit.time), math.inf, longest)
    far = _far(gravity, period, motion, leaves)
    longest = select(longest < far, longest, far)
    goes_on = longest > leaves
    return select(goes_on, longest, leaves), _hit_in(gaps.walls, goes_on, hit)


@by_type
def _far(gravity, period, motion, leaves):
    """When a flight is surely no more cells away than it may go; `leaves` is when it leaves this one."""
    return _CELLS * leaves


@_far.register(Gravity)
def _(gravity, period, motion, leaves):
    r, v = motion
    x, y = _time_far(period.x, r.x, v.x, gravity.x), _time_far(period.y, r.y, v.y, gravity.y)
    return _least(x, y, _time_far(period.z, r.z, v.z, gravity.z))


@by_type
def _is_line(gravity, period, motion, free):
    """Whether a flight that is free for so long goes through each cell as through this one."""
    return False


@_is_line.register(Nothing)
def _(gravity, period, motion, free):
    r, v = motion
    x = _spans(period.x, r.x, v.x, free) & _is_kept(period.y, v.y) & _is_kept(period.z, v.z)
    y = _spans(period.y, r.y, v.y, free) & _is_kept(period.z, v.z) & _is_kept(period.x, v.x)
    z = _spans(period.z, r.z, v.z, free) & _is_kept(period.x, v.x) & _is_kept(period.y, v.y)
    return x | y | z


@by_type
def _spans(length, x, v, free):
    """Whether it begins at a face and is free as far as the place beyond the other that is its image."""
    return False


@_spans.register(float)
def _(length, x, v, free):
    begins = ((v > 0.0) & (x <= _AT_FACE * length)) | ((v < 0.0) & (x >= length - _AT_FACE * length))
    return begins & (abs(v) * free > length)


@by_type
def _is_kept(length, v):
    """Whether the walls along this axis are the same for it in every cell."""
    return v == 0.0


_is_kept.register(Free, lambda length, v: True)


@by_type
def _hit_in(walls, goes_on, hit):
    """The hit of a flight that goes on over faces, or not."""
    return hit


@_hit_in.register(Nothing)
def _(walls, goes_on, hit):
    # Of a fall it may be known for a part of its way only that it is free.
    return Hit(select(goes_on, math.inf, hit.time), select(goes_on, -1.0, hit.wall))


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
        if _has_gone(period, step, middle):
            high = middle
        else:
            low = middle
    return high


@inlined
def _has_gone(period, step, s):
    r0, a, b, c = step
    r = r0 + s * (a + s * (b + s * c))
    return (_excess(period.x, r.x) > 0.0) | (_excess(period.y, r.y) > 0.0) | (_excess(period.z, r.z) > 0.0)

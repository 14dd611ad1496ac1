"""Flights that go on over the faces of a cell that repeats, because no wall that has images is in their way.

In a gap between two coordinates there is no such wall, however far a flight goes along the other axes; and one along an
axis that passes all walls of a cell passes those of every cell.
"""

import math
from typing import Any

from ...kernel.jit import select
from ...kernel.record import Record
from ..time_of_impact.course import rise_time
from ..time_of_impact.flights import Hit
from .axes import CELLS, Free, least, length_of, most, pulls, time_far, time_out

# A flight that is nearer to a face than this part of the length of the cell begins at it: beyond the other face walls
# are known as far as that.
_AT_FACE = 5e-4


class Gap(Record):
    """The coordinates along an axis between which no wall is that has images; it may go on beyond the upper face."""

    low: float
    high: float


class Beside(Record):
    """The coordinates below and above which no wall is that has images, along an axis that does not repeat."""

    low: float
    high: float


class Gaps(Record):
    """The gap along each axis, or None; and whether there are walls without images, None for no."""

    x: Any
    y: Any
    z: Any
    walls: Any


# --- Along one axis --------------------------------------------------------------------------------------


def _time_in(gap, length, x, v, pull):
    """The time that a coordinate stays in a gap; 0 if it is outside the gap, or if the axis has no gap."""
    if gap is None:
        return 0.0
    if isinstance(gap, Gap):
        x = x + select(x < gap.low, length_of(length), 0.0)
        return select((x > gap.low) & (x < gap.high), time_out(pull, (gap.low, gap.high), x, v), 0.0)
    below, above = x < gap.low, x > gap.high
    # Below is what is above of -x.
    far, towards = select(below, x - gap.low, gap.high - x), select(below, v, -v)
    return select(below | above, _time_to_reach(pull, far, towards, below), 0.0)


def _time_to_reach(pull, far, v, below):
    """When a coordinate so far below 0 reaches it."""
    if pull is None:
        return select(v > 0.0, -far * (1.0 / v), math.inf)
    return rise_time(far, 0.5 * v, select(below, 0.5 * pull, -0.5 * pull))


# --- Of a flight -----------------------------------------------------------------------------------------


def _time_in_gaps(gaps, period, gravity, motion):
    """The time that a flight stays in a gap."""
    (r, v), (gx, gy, gz) = motion, pulls(gravity)
    x = _time_in(gaps.x, period.x, r.x, v.x, gx)
    y = _time_in(gaps.y, period.y, r.y, v.y, gy)
    z = _time_in(gaps.z, period.z, r.z, v.z, gz)
    return most(x, y, z)


def longer(gaps, period, gravity, motion, ends):
    """The first of `ends`, or when the gap ends in which it flies, less the second."""
    time, late = ends
    if gaps is None:
        return time
    longest = _time_in_gaps(gaps, period, gravity, motion) - late
    return select(longest > time, longest, time)


def over_faces(gaps, period, gravity, motion, ends):
    """When a flight leaves the cell, or the gap in which it goes on over faces; and its hit.

    `ends` are the first of these, the hit, and by how much the flight may end later.
    """
    leaves, hit, late = ends
    if gaps is None:
        return leaves, hit
    longest = _time_in_gaps(gaps, period, gravity, motion) - late
    if gravity is None:
        longest = select(_is_line(period, motion, leaves, hit.time), math.inf, longest)
    far = _far(gravity, period, motion, leaves)
    longest = select(longest < far, longest, far)
    goes_on = longest > leaves
    if gaps.walls is None:
        # Of a fall it may be known for a part of its way only that it is free.
        hit = Hit(select(goes_on, math.inf, hit.time), select(goes_on, -1.0, hit.wall))
    return select(goes_on, longest, leaves), hit


def _far(gravity, period, motion, leaves):
    """When a flight is surely no more cells away than it may go; `leaves` is when it leaves this one."""
    if gravity is None:
        return CELLS * leaves
    r, v = motion
    x, y = time_far(period.x, r.x, v.x, gravity.x), time_far(period.y, r.y, v.y, gravity.y)
    return least(x, y, time_far(period.z, r.z, v.z, gravity.z))


def _is_line(period, motion, leaves, free):
    """Whether a straight flight that leaves then, and is free for so long, goes through each cell as through this."""
    _r, v = motion
    x, y, z = _is_kept(period.x, v.x), _is_kept(period.y, v.y), _is_kept(period.z, v.z)
    # That of the only component; axis by axis this would cost 4 ns a flight.
    speed = most(abs(_across(period.x, v.x)), abs(_across(period.y, v.y)), abs(_across(period.z, v.z)))
    length = select(x, select(y, _passed(period.z), _passed(period.y)), _passed(period.x))
    # It begins at a face, and is free as far as the place beyond the other that is its image.
    begins = speed * leaves >= (1.0 - _AT_FACE) * length
    return ((x & y) | (x & z) | (y & z)) & begins & (free > (1.0 + 2.0 * _AT_FACE) * leaves)


def _is_kept(length, v):
    """Whether the walls along this axis are the same for it in every cell."""
    return True if isinstance(length, Free) else v == 0.0


def _across(length, v):
    """The component of a velocity along which walls change."""
    return 0.0 if isinstance(length, Free) else v


def _passed(length):
    """The distance from one face to the other; infinite along an axis that does not repeat."""
    return math.inf if length is None else length_of(length)

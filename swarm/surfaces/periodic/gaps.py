"""Flights over the faces of a periodic cell, because no wall with images is in their way.

In a gap between two coordinates there is no such wall, however far a flight goes along the other axes; and a flight
along an axis that passes all walls of a cell passes those of every cell.
"""

import math
from typing import Any

from ...kernel.jit import select
from ...kernel.record import Record
from ..time_of_impact.course import rise_time
from ..time_of_impact.flights import Hit
from .axes import CELLS, Free, least, length_of, most, pulls, time_far, time_out

# A flight nearer to a face than this part of the length of the cell begins at it: beyond the other face walls
# are known as far as this.
_AT_FACE = 5e-4


class Gap(Record):
    """The coordinates along an axis between which no wall has images; the gap may extend beyond the upper face."""

    low: float
    high: float


class Beside(Record):
    """The coordinates below and above which no wall has images, along an axis without a period."""

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
    """Return the time that a coordinate stays in a gap; 0 if it is outside the gap, or if the axis has no gap."""
    if gap is None:
        return 0.0
    if isinstance(gap, Gap):
        x = x + select(x < gap.low, length_of(length), 0.0)
        return select((x > gap.low) & (x < gap.high), time_out(pull, (gap.low, gap.high), x, v), 0.0)
    below, above = x < gap.low, x > gap.high
    # Below is the same as above for -x.
    far, towards = select(below, x - gap.low, gap.high - x), select(below, v, -v)
    return select(below | above, _time_to_reach(pull, far, towards, below), 0.0)


def _time_to_reach(pull, far, v, below):
    """Return when a coordinate `far` below 0 reaches 0."""
    if pull is None:
        return select(v > 0.0, -far * (1.0 / v), math.inf)
    return rise_time(far, 0.5 * v, select(below, 0.5 * pull, -0.5 * pull))


# --- A flight --------------------------------------------------------------------------------------------


def _time_in_gaps(gaps, period, gravity, motion):
    """Return the time that a flight stays in a gap."""
    (r, v), (gx, gy, gz) = motion, pulls(gravity)
    x = _time_in(gaps.x, period.x, r.x, v.x, gx)
    y = _time_in(gaps.y, period.y, r.y, v.y, gy)
    z = _time_in(gaps.z, period.z, r.z, v.z, gz)
    return most(x, y, z)


def longer(gaps, period, gravity, motion, ends):
    """Return the first of `ends`, or when the gap ends in which it flies, less the second, if this is later."""
    time, late = ends
    if gaps is None:
        return time
    longest = _time_in_gaps(gaps, period, gravity, motion) - late
    return select(longest > time, longest, time)


def over_faces(gaps, period, gravity, motion, ends):
    """Return when a flight leaves the cell, or the gap in which it crosses faces; and its hit.

    `ends` are the time at which it leaves the cell, the hit, and by how much the flight may end later.
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
        # A fall may be known to be free for a part of its way only.
        hit = Hit(select(goes_on, math.inf, hit.time), select(goes_on, -1.0, hit.wall))
    return select(goes_on, longest, leaves), hit


def _far(gravity, period, motion, leaves):
    """Return when a flight is surely no more cells away than it may go; `leaves` is when it leaves this cell."""
    if gravity is None:
        return CELLS * leaves
    r, v = motion
    x, y = time_far(period.x, r.x, v.x, gravity.x), time_far(period.y, r.y, v.y, gravity.y)
    return least(x, y, time_far(period.z, r.z, v.z, gravity.z))


def _is_line(period, motion, leaves, free):
    """Whether a straight flight that leaves at `leaves`, and is free until `free`, crosses each cell as this one."""
    _r, v = motion
    x, y, z = _is_kept(period.x, v.x), _is_kept(period.y, v.y), _is_kept(period.z, v.z)
    # The speed of the only component; axis by axis this would cost 4 ns a flight.
    speed = most(abs(_across(period.x, v.x)), abs(_across(period.y, v.y)), abs(_across(period.z, v.z)))
    length = select(x, select(y, _passed(period.z), _passed(period.y)), _passed(period.x))
    # It begins at a face, and is free as far as the image of this place beyond the other face.
    begins = speed * leaves >= (1.0 - _AT_FACE) * length
    return ((x & y) | (x & z) | (y & z)) & begins & (free > (1.0 + 2.0 * _AT_FACE) * leaves)


def _is_kept(length, v):
    """Whether a flight meets the same walls along this axis in every cell."""
    return True if isinstance(length, Free) else v == 0.0


def _across(length, v):
    """Return the component of a velocity along which walls change."""
    return 0.0 if isinstance(length, Free) else v


def _passed(length):
    """Return the distance from one face to the other; infinite along an axis without a period."""
    return math.inf if length is None else length_of(length)

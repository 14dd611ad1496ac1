"""Safe steps in lanes, to walls in any motion whose levels have a bound of their third derivative.

A stride is one safe step of all walls. Its bounds hold until the parabola of a level itself rises: near the hit what
is not known of f''' is the only error, and a stride leaves the cube of its length. What a few strides do not find goes
on in the next pass, from where it is.
"""

import math
from typing import Any, NamedTuple

from ..kernel.gravity import accelerated
from ..kernel.jit import by_type, inlined, select
from ..kernel.vector import ZERO
from .course import rise_time
from .flights import Hit
from .fold import Chain
from .moving import at
from .relative import Framed, flight_of, motion_of
from .rising import bounds_on, levels, third_of
from .safe import closed_hit

_EPSILON = 2.220446049250313e-16
# What a lane knows of its way: the time of the flight so far, the wall that it has met or -1, and the first hit with
# the walls that have a closed form.
_TIME, _MET, _CLOSED, _OTHER = 0, 1, 2, 3


class Known(NamedTuple):
    """The levels of a wall, and the particle in its frame."""

    levels: Any
    body: Any
    framed: Framed


class Stride(NamedTuple):
    """The time at which the first level may rise, its wall, and whether it surely does but for round-off."""

    time: float
    wall: float
    meets: Any


@inlined
def begin(chain, gravity, course, lane, r, v, left):
    """The way of a flight with so much of the frame left [s] into a lane of the course."""
    found = closed_hit(at(chain, left), gravity, r, v)
    course[_TIME, lane], course[_MET, lane] = 0.0, -1.0
    course[_CLOSED, lane], course[_OTHER, lane] = found.time, found.wall


@inlined
def stride(chain, gravity, course, lane, r, v, left, is_first):
    """One stride of a lane that has not met a wall."""
    t, met = course[_TIME, lane], course[_MET, lane]
    longest = select(course[_CLOSED, lane] < left, course[_CLOSED, lane], left) - t
    flight = flight_of(r, v, accelerated(gravity, ZERO, 1.0), left)
    known = _known(chain.walls, None, flight, t)
    within = _first_rise(known)
    within = select(within < longest, within, longest)
    found = _stride(known, 0.0, within, is_first)
    under_way = (met < 0.0) & (longest > 0.0)
    step = select(found.time < within, found.time, within)
    course[_TIME, lane] = select(under_way, t + step, t)
    course[_MET, lane] = select(under_way & found.meets & (found.time <= longest), found.wall, met)


@inlined
def end(course, lane):
    """The first `Hit` of a lane, if its strides have found it."""
    t, met, closed = course[_TIME, lane], course[_MET, lane], course[_CLOSED, lane]
    # No wall in any motion before the closed hit
    arrives = (met < 0.0) & (t >= closed)
    return Hit(select(arrives, closed, t), select(arrives, course[_OTHER, lane], met))


@by_type
def _known(chain, last, flight, t):
    """`Known` of all walls that are met by safe steps; `last` is `Framed` of the wall before."""
    return


@_known.register(Chain)
def _(chain, last, flight, t):
    mine = motion_of(chain.first, last, flight, t)
    return Chain(_known_of(mine, chain.first), _known(chain.rest, mine, flight, t))


@by_type
def _known_of(mine, wall):
    return


_known_of.register(Framed, lambda mine, wall: Known(levels(wall.body, mine.seen), wall.body, mine))


# --- When the parabola of a level rises ------------------------------------------------------------------


@by_type
def _first_rise(known):
    """When the first of the levels' own parabolas rises."""
    return math.inf


@_first_rise.register(Chain)
def _(known):
    mine, other = _first_rise_of(known.first), _first_rise(known.rest)
    return select(mine < other, mine, other)


@by_type
def _first_rise_of(known):
    return math.inf


_first_rise_of.register(Known, lambda known: _parabolas(known.levels))


@by_type
def _parabolas(found):
    return math.inf


@_parabolas.register(Chain)
def _(found):
    mine, other = rise_time(found.first.level, found.first.half, found.first.bend), _parabolas(found.rest)
    return select(mine < other, mine, other)


# --- A stride --------------------------------------------------------------------------------------------


@by_type
def _stride(known, number, within, is_first):
    """The `Stride` of all walls, with bounds that hold for so long."""
    return Stride(math.inf, -1.0, False)


@_stride.register(Chain)
def _(known, number, within, is_first):
    rest = _stride(known.rest, number + 1.0, within, is_first)
    return _sooner(known.first, number, within, is_first, rest)


@by_type
def _sooner(known, number, within, is_first, rest):
    return rest


@_sooner.register(Known)
def _(known, number, within, is_first, rest):
    framed = known.framed
    bounds = bounds_on(known.body, framed.drive, framed.seen, within)
    room = _EPSILON * framed.seen.coordinates
    return _of_levels(known.levels, number, within, bounds, room, is_first, rest)


@by_type
def _of_levels(found, number, within, bounds, room, is_first, rest):
    return rest


@_of_levels.register(Chain)
def _(found, number, within, bounds, room, is_first, rest):
    here = found.first
    third = third_of(here, bounds, within)
    sixth = third * within * (1.0 / 6.0)
    time = rise_time(here.level, here.half, here.bend + sixth)
    if is_first:
        # From the wall inwards f is t (f' + f''/2 t + ...): one power of t nearer to it than the parabola.
        leaving = rise_time(2.0 * here.half, 0.5 * here.bend, third * (1.0 / 6.0))
        time = select((here.half <= 0.0) & (leaving > time), leaving, time)
    # The parabola is above f by no more than this.
    meets = 2.0 * sixth * time * time <= here.steepness * room
    other = _of_levels(found.rest, number, within, bounds, room, is_first, rest)
    mine = time < other.time
    return Stride(
        select(mine, time, other.time),
        select(mine, number, other.wall),
        (mine & meets) | ((not mine) & other.meets),
    )

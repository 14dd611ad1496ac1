"""Safe steps in lanes, to walls in any motion whose levels have a bound of their third derivative.

A stride is one safe step of all walls together. Its bounds hold until the parabola of a level itself rises: near the
hit what is not known of f''' is the only error, and a stride leaves the cube of its length. What a few strides do not
find goes on in the next pass, from where it is.
"""

import math
from typing import Any, NamedTuple

from ..kernel.gravity import accelerated
from ..kernel.jit import by_type, inlined, select
from ..kernel.vector import ZERO
from .course import rise_time
from .flights import Hit
from .fold import Chain
from .moving import Moving, at
from .relative import Framed, flight_of, motion_of
from .rising import Between, Level, bounds_on, level_of, third_of
from .safe import closed_hit

_EPSILON = 2.220446049250313e-16
# What a lane knows of its way: the time of the flight so far, the wall that it has met or -1, and the first hit with
# the walls that have a closed form.
_TIME, _MET, _CLOSED, _OTHER = 0, 1, 2, 3
# The bounds of a stride hold for at most so many times the pace of a wall: beyond, a power series says little.
_AHEAD = 32.0


class Known(NamedTuple):
    """The level of a wall, the wall and the particle in its frame."""

    level: Any
    body: Any
    framed: Framed


class Rise(NamedTuple):
    """When a level rises at the soonest, and by how much it is at most below 0 then."""

    time: float
    error: float


class Stride(NamedTuple):
    """The time at which the first level may rise, its wall, and whether it surely does but for round-off."""

    time: float
    wall: float
    meets: Any


# --- In a lane -------------------------------------------------------------------------------------------


@inlined
def begin(chain, gravity, course, lane, r, v, left):
    """The way of a flight with so much of the frame left [s] into a lane of the course."""
    found = closed_hit(at(chain, left), gravity, r, v)
    course[_TIME, lane], course[_MET, lane] = 0.0, -1.0
    course[_CLOSED, lane], course[_OTHER, lane] = found.time, found.wall


@inlined
def stride(chain, gravity, course, lane, r, v, left, is_first):
    """One stride of a lane that has not met a wall."""
    t, met, closed = course[_TIME, lane], course[_MET, lane], course[_CLOSED, lane]
    longest = select(closed < left, closed, left) - t
    flight = flight_of(r, v, accelerated(gravity, ZERO, 1.0), left)
    known = _known(chain.walls, None, flight, t)
    within, ahead = _first_rise(known), _AHEAD * _pace(chain.walls)
    ahead = select(ahead < longest, ahead, longest)
    within = select(within < ahead, within, ahead)
    found = _stride(known, 0.0, within, is_first)
    step = select(found.time < within, found.time, within)
    under_way = (met < 0.0) & (longest > 0.0)
    course[_TIME, lane] = select(under_way, t + step, t)
    course[_MET, lane] = select(under_way & found.meets & (found.time <= within), found.wall, met)


@inlined
def end(course, lane):
    """The first `Hit` of a lane, if its strides have found it."""
    t, met, closed = course[_TIME, lane], course[_MET, lane], course[_CLOSED, lane]
    # No wall in any motion before the closed hit
    arrives = (met < 0.0) & (t >= closed)
    return Hit(select(arrives, closed, t), select(arrives, course[_OTHER, lane], met))


@by_type
def _pace(chain):
    """The shortest pace of all walls that are met by safe steps."""
    return math.inf


@_pace.register(Chain)
def _(chain):
    mine, other = _pace_of(chain.first), _pace(chain.rest)
    return select(mine < other, mine, other)


@by_type
def _pace_of(wall):
    return math.inf


_pace_of.register(Moving, lambda wall: wall.drive.pace)

# --- All walls that are met by safe steps ----------------------------------------------------------------


@by_type
def _known(chain, last, flight, t):
    """`Known` of each; `last` is `Framed` of the wall before."""
    return


@_known.register(Chain)
def _(chain, last, flight, t):
    mine = motion_of(chain.first, last, flight, t)
    return Chain(_known_of(mine, chain.first), _known(chain.rest, mine, flight, t))


@by_type
def _known_of(mine, wall):
    return


_known_of.register(Framed, lambda mine, wall: Known(level_of(wall.body, mine.seen), wall.body, mine))


@by_type
def _first_rise(known):
    """When the first of the levels' own parabolas rises."""
    return math.inf


@_first_rise.register(Chain)
def _(known):
    mine, other = _own_rise_of(known.first), _first_rise(known.rest)
    return select(mine < other, mine, other)


@by_type
def _own_rise_of(known):
    return math.inf


_own_rise_of.register(Known, lambda known: _own_rise(known.level))


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
    drive, seen = known.framed.drive, known.framed.seen
    sixth = third_of(known.level, bounds_on(known.body, drive, seen, within), within) * (1.0 / 6.0)
    time = _rise(known.level, sixth, within, is_first)
    # The parabola is above f by no more than this.
    meets = 2.0 * sixth * within * time * time <= _EPSILON * seen.coordinates * _steepness(known.level)
    mine = time < rest.time
    return Stride(
        select(mine, time, rest.time), select(mine, number, rest.wall), (mine & meets) | ((not mine) & rest.meets)
    )


# --- Of one level ----------------------------------------------------------------------------------------


@by_type
def _own_rise(level):
    """When its own parabola rises."""
    raise NotImplementedError


@by_type
def _rise(level, sixth, within, is_first):
    """When it rises at the soonest, if a sixth of f''' is bounded within that time."""
    raise NotImplementedError


@by_type
def _steepness(level):
    raise NotImplementedError


_own_rise.register(Level, lambda level: rise_time(level.level, level.half, level.bend))
_steepness.register(Level, lambda level: level.steepness)


@_rise.register(Level)
def _(level, sixth, within, is_first):
    time = rise_time(level.level, level.half, level.bend + sixth * within)
    if is_first:
        # From the wall inwards f is t (f' + f''/2 t + ...): one power of t nearer to it than the parabola. Away from a
        # wall it says less, and of a particle at rest nothing: both are nowhere below f.
        leaving = rise_time(2.0 * level.half, 0.5 * level.bend, sixth)
        time = select((level.half <= 0.0) & (leaving > time), leaving, time)
    return time


_steepness.register(Between, lambda level: 1.0)


@_own_rise.register(Between)
def _(level):
    # The plane ahead, unless the particle turns short of it: then the one behind
    c, b, a = level.place - level.radius, level.half, level.bend
    discriminant = b * b - a * c
    reaches = (discriminant >= 0.0) | (a > 0.0)
    discriminant = select(reaches, discriminant, b * b - a * (level.place + level.radius))
    root = math.sqrt(select(discriminant > 0.0, discriminant, 0.0))
    over, under = select(reaches, -c, b + root), select(reaches, b + root, -a)
    return select(under > 0.0, select(over > 0.0, over, 0.0) / under, math.inf)


@_rise.register(Between)
def _(level, sixth, within, is_first):
    b, k = level.half, sixth * within
    c, a = level.place - level.radius, level.bend + k
    discriminant = b * b - a * c
    root = math.sqrt(select(discriminant > 0.0, discriminant, 0.0))
    reaches = ((discriminant >= 0.0) | (a > 0.0)) & (b + root > 0.0)
    ahead = select(reaches, select(c < 0.0, -c, 0.0) / (b + root), math.inf)
    # The one behind: the particle moves away from it.
    c, a = -level.place - level.radius, k - level.bend
    discriminant = b * b - a * c
    root = math.sqrt(select(discriminant > 0.0, discriminant, 0.0))
    behind = select(a > 0.0, (b + root) / a, math.inf)
    if is_first:
        leaving = rise_time(-2.0 * b, -0.5 * level.bend, sixth)
        behind = select(leaving > behind, leaving, behind)
    return select(behind < ahead, behind, ahead)

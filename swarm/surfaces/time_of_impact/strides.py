"""Safe steps in lanes, to walls in any motion with levels that have a bound of their third derivative.

A stride is one safe step of all walls together. Its bounds hold until the parabola of a level itself rises: near the
hit the part of f''' that is not known is the only error, and a stride leaves the cube of its length. A hit that a few
strides do not find is searched in the next pass, from the place reached.
"""

import math

from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ...kernel.vector import norm
from ..in_motion.moving import Moving
from .flights import Hit
from .rising import ThirdDerivativeBound, flight_of
from .safe import closed_hit, seen_by_walls

# The rows of a lane: the time of the flight so far, the wall that it has met or -1, the time and the wall of the first
# hit with walls that have a closed form, and the speed at its start.
TIME, MET, CLOSED, OTHER, SPEED = 0, 1, 2, 3, 4
# The number of these rows, and of the first ones that strides change.
KNOWN, FOUND = 5, 2
# The bounds of a stride hold for at most this many times the pace of a wall: beyond, a power series is useless.
AHEAD = 32.0


def start(walls, gravity, course, lane, r, v, remaining):
    """Start a flight with `remaining` of the frame left [s] in a lane of the course."""
    found = closed_hit(walls.at(remaining), gravity, r, v)
    course[TIME, lane], course[MET, lane] = 0.0, -1.0
    course[CLOSED, lane], course[OTHER, lane], course[SPEED, lane] = found.time, found.wall, norm(v)


def stride(walls, gravity, course, lane, r, v, remaining, is_first):
    """Take one stride of a lane that has not met a wall."""
    t, met, closed = course[TIME, lane], course[MET, lane], course[CLOSED, lane]
    longest = select(closed < remaining, closed, remaining) - t
    known = levels_of(walls, flight_of(r, v, gravity, remaining, course[SPEED, lane]), t)
    within, ahead = _first_rise(known), AHEAD * pace(walls)
    ahead = select(ahead < longest, ahead, longest)
    within = select(within < ahead, within, ahead)
    time, wall, meets = _first_stride(known, within, is_first)
    after = t + select(time < within, time, within)
    if is_first and gravity is None:
        after = _through_cores(known, r, v, remaining, after, t + longest)
    under_way = (met < 0.0) & (longest > 0.0)
    course[TIME, lane] = select(under_way, after, t)
    course[MET, lane] = select(under_way & meets & (time <= within), wall, met)


def levels_of(walls, flight, t):
    """Return (the number of a wall, the `ThirdDerivativeBound` of its level) of each wall that is met by strides."""
    return tuple(
        (number, ThirdDerivativeBound(wall.body, seen, wall.body.level_along(seen)))
        for wall, number, seen in seen_by_walls(walls, flight, t)
    )


def _through_cores(known, r, v, remaining, t, longest):
    """Return a time up to `longest` until which a straight flight, free until t, surely stays in all cores."""
    first = longest
    for _number, one in known:
        way = one.seen.drive.passage(one.body, r, v, remaining)
        if way is None:
            return t
        leaves = select((way.enters < t) & (t < way.leaves), way.leaves, t)
        first = select(leaves < first, leaves, first)
    return select(t < first, first, t)


def met(course, lane):
    """Return the first `Hit` of a lane, if its strides have found it."""
    t, met, closed = course[TIME, lane], course[MET, lane], course[CLOSED, lane]
    # No wall in any motion before the closed hit
    arrives = (met < 0.0) & (t >= closed)
    return Hit(select(arrives, closed, t), select(arrives, course[OTHER, lane], met))


def pace(walls):
    """Return the shortest pace of all walls that move."""
    shortest = math.inf
    for wall in reversed(walls.each):
        mine = wall.drive.time_scale if isinstance(wall, Moving) else math.inf
        shortest = select(mine < shortest, mine, shortest)
    return shortest


def _first_rise(known):
    """Return when the first of the levels' own parabolas rises."""
    first = math.inf
    for _number, one in known:
        mine = one.level.own_rise()
        first = select(mine < first, mine, first)
    return first


def _first_stride(known, within, is_first):
    """Return (when the first level may rise, its wall, whether it surely does up to round-off) within a time."""
    first, wall, meets_first = math.inf, -1.0, False
    for number, one in known:
        sixth, level = one.third(within) * (1.0 / 6.0), one.level
        time = level.soonest(sixth, within, is_first)
        # The parabola is above f by at most this.
        meets = 2.0 * sixth * within * time * time <= EPSILON * one.seen.coordinates * level.steepness
        mine = time < first
        first, wall = select(mine, time, first), select(mine, number, wall)
        meets_first = (mine & meets) | ((not mine) & meets_first)
    return first, wall, meets_first

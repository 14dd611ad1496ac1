"""First hits in lanes with walls in any motion: a guess, Newton's steps of second order, and a proof.

A guess of the first hit is improved without bounds. Two Taylor polynomials, one from the start of the flight on and one
from its end back, with a bound of the third derivative as their rest, then prove that no wall is met before: each holds
for half of the way, or as far as what lies so deep that no wall ever comes there. What is not proven is left to the
safe steps of strides.py, which begin anew.
"""

import math
from typing import Any

from ...kernel.gravity import accelerated
from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ...kernel.vector import ZERO, norm
from ..in_motion.drive import Wave
from .flights import COURSE
from .rising import ThirdDerivativeBound, flight_of, nearest_root
from .safe import closed_hit, seen_by_walls
from .strides import AHEAD, CLOSED, MET, OTHER, SPEED, TIME, pace

# Of a lane besides what its strides know: the guess, and of each wall the polynomial at the start, when the flight
# enters what the wall never reaches, infinite if it does not, and when it leaves that.
_GUESS, WALLS, _OF_WALL, _ENTERS, _LEAVES = 5, 6, 5, 3, 4
# After the walls are the sine and the versine of each angle at the guess.
_OF_WAVE = 2
# Improvements of the guess before the last.
AIMS = 2


def start(walls, gravity, course, lane, r, v, remaining):
    """The guess of a lane's first hit, and how far the polynomial from its start proves it free."""
    found, speed = closed_hit(walls.at(remaining), gravity, r, v), norm(v)
    course[TIME, lane], course[MET, lane] = 0.0, -1.0
    course[CLOSED, lane], course[OTHER, lane], course[SPEED, lane] = found.time, found.wall, speed
    longest = select(found.time < remaining, found.time, remaining)
    known = _known(walls, gravity, speed, r, v, remaining, 0.0)
    ahead = AHEAD * pace(walls)
    guess = math.inf
    passages: tuple[Any, ...] = ()
    for _number, one in known:
        mine = one.level.own_rise()
        way = one.seen.drive.passage(one.body, r, v, remaining)
        if way is not None:
            across = (way.enters < way.leaves) & (way.leaves > 0.0) & (mine > 0.5 * ahead)
            mine = select(across, way.hits, mine)
        guess, passages = select(mine < guess, mine, guess), (*passages, way)
    course[_GUESS, lane] = select(guess < longest, guess, longest)
    for k, (way, (_number, one)) in enumerate(zip(passages, known, strict=True)):
        at = WALLS + k * _OF_WALL
        for i in range(3):
            course[at + i, lane] = one.level[i]
        if way is not None:
            across = (way.enters < way.leaves) & (way.leaves > 0.0)
            course[at + _ENTERS, lane] = select(across, way.enters, math.inf)
            course[at + _LEAVES, lane] = way.leaves


def put_waves(walls, course, lane, remaining):
    """The waves of all motions at the guess of a lane, in a loop of its own: two short loops are sooner than a long."""
    guess, at = course[_GUESS, lane], _first_wave(walls)
    for drive in _known_drives(walls):
        for wave in drive.waves_at(remaining - guess):
            course[at, lane], course[at + 1, lane] = wave
            at += _OF_WAVE


def _at_guess(walls, course, lane):
    """The walls with the waves of a lane."""
    at = _first_wave(walls)
    waves: tuple[Wave, ...] = ()
    for drive in _known_drives(walls):
        for _rate in drive.rates():
            waves = (*waves, Wave(course[at, lane], course[at + 1, lane]))
            at += _OF_WAVE
    return walls.with_waves(waves)


def _first_wave(walls):
    return WALLS + len(walls.each) * _OF_WALL


def _known_drives(walls):
    """The motions of which the waves are kept: all, if a lane has the rows."""
    drives = walls.drives()
    count = sum(len(drive.rates()) for drive in drives)
    return drives if count * _OF_WAVE <= len(walls.each) * (COURSE - _OF_WALL) else ()


def improve(walls, gravity, course, lane, r, v, remaining):
    """A guess that is nearer to the hit."""
    guess = course[_GUESS, lane]
    known = _known(_at_guess(walls, course, lane), gravity, course[SPEED, lane], r, v, remaining, guess)
    closed = course[CLOSED, lane]
    longest = select(closed < remaining, closed, remaining)
    way, _wall = _nearest_root(known)
    after = guess + way
    after = select(after < longest, after, longest)
    course[_GUESS, lane] = select((guess > 0.0) & (after > 0.0), after, guess)


def prove(walls, gravity, course, lane, r, v, remaining):
    """The hit of a lane, if it is proven."""
    guess, closed = course[_GUESS, lane], course[CLOSED, lane]
    longest = select(closed < remaining, closed, remaining)
    known = _known(_at_guess(walls, course, lane), gravity, course[SPEED, lane], r, v, remaining, guess)
    way, wall = _nearest_root(known)
    meets = guess + way < longest
    way = select(meets, way, longest - guess)
    time = select(meets, guess + way, longest)
    far, proven = abs(way), (guess > 0.0) & (time > 0.0)
    for k, (number, one) in enumerate(known):
        mine, level = meets & (wall == number), one.level
        at = WALLS + k * _OF_WALL
        ahead = since = 0.5 * time
        if one.body.has_core and one.seen.drive.swing_amplitude() is not None:
            enters, leaves = course[at + _ENTERS, lane], course[at + _LEAVES, lane]
            across = enters < time
            ahead, since = select(across, enters, ahead), select(across, leaves, since)
            ahead, since = select(ahead > 0.0, ahead, 0.0), select(since < time, since, time)
        back = time - since
        sixth = one.third(time + far) * (1.0 / 6.0)
        near = sixth * far * far * far <= EPSILON * one.seen.coordinates * level.steepness
        start = type(level)(*(course[at + i, lane] for i in range(3)), *level[3:])
        proven = proven & (near | (not mine)) & start.is_below(1.0, sixth, ahead, True)
        proven = proven & level.moved(way, mine).is_below(-1.0, sixth, back, mine)
    course[TIME, lane] = select(proven, time, 0.0)
    course[MET, lane] = select(proven & meets, wall, -1.0)


def is_open(course, lane, remaining):
    """Whether it is not proven yet where the first hit of a lane is, or that the lane meets no wall."""
    closed = course[CLOSED, lane]
    return (course[MET, lane] < 0.0) & (course[TIME, lane] < select(closed < remaining, closed, remaining))


def _known(walls, gravity, speed, r, v, remaining, t):
    flight = flight_of(r, v, accelerated(gravity, ZERO, 1.0), remaining, speed)
    return tuple(
        (number, ThirdDerivativeBound(wall.body, seen, wall.body.level_along(seen)))
        for wall, number, seen in seen_by_walls(walls, flight, t)
    )


def _nearest_root(known):
    """How far ahead, or back, the first of the parabolas rises that are next to 0 by their slopes, and its wall."""
    c, b, a, wall = 0.0, 0.0, 0.0, -1.0
    for number, one in known:
        mine = one.level.ahead()
        # -c/b < -c'/b' without a division
        sooner = (mine.b > 0.0) & ((b <= 0.0) | (mine.c * b > c * mine.b))
        c, b, a = select(sooner, mine.c, c), select(sooner, mine.b, b), select(sooner, mine.a2, a)
        wall = select(sooner, number, wall)
    return nearest_root(c, b, a), wall

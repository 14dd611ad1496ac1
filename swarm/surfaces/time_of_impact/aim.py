"""First hits in lanes with walls in any motion: a guess, Newton's steps of second order, and a proof.

A guess of the first hit is improved without bounds. It is then proven that the guess is a root to round-off, by a bound
of the third derivative, and that no wall is met before. For a wall that only swings, a bound of its motion proves this:
most flights pass so deep, or so fast, that the level rises through 0 at most once (see `passage_of`). For other walls
and flights two series prove it: two Taylor polynomials, one from the start of the flight on and one from its end back,
each for half of the way, or up to a depth that no wall ever reaches. Hits that are not proven are left to the safe
steps of strides.py, which begin anew.
"""

import math
from typing import Any

from ...kernel.elementary import nearly_sine_and_versine_of, reduced, sine_and_versine_of
from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ..in_motion.drive import LITTLE_ANGLE, Wave
from ..in_motion.moving import Moving
from . import strides
from .rising import flight_of, nearest_root
from .strides import CLOSED, MET, SPEED, TIME, levels_of

# The rows of a lane after those of its strides: the guess, the way from there to the nearest root, the wall and the
# parabola with this root, and the scale of round-off at the guess. Then for each wall the time until which its passage
# is free, or else the polynomial at the start; after these its level at the guess, and its level at the end, where the
# bound of f'''/6 replaces the steepness.
GUESS, _WAY, _WALL, _NEAREST, _COORDINATES, WALLS = 5, 6, 7, 8, 11, 12
_AT_END, _KEPT, _SIXTH, _OF_WALL = 3, 4, 3, 7
# After the walls are the sine and the versine of each angle at the guess, of at most `_WAVES` angles a wall.
_OF_WAVE, _WAVES = 2, 3
# Improvements of the guess before the last.
AIMS = 2


def start(walls, gravity, course, lane, r, v, remaining):
    """Start the guess of a lane's first hit, and keep all that the start of the flight proves."""
    strides.start(walls, gravity, course, lane, r, v, remaining)
    longest, guess = _longest(course, lane, remaining), math.inf
    starts: tuple[Any, ...] = ()
    here = with_waves(walls, course, lane) if lacks_passages(walls) else walls
    known = _known(here, gravity, course[SPEED, lane], r, v, remaining, 0.0)
    for _number, one in known:
        way, level = one.seen.drive.passage(one.body, r, v, remaining), one.level
        if way is not None:
            guess = select(way.hits < guess, way.hits, guess)
        # A single wall is met or not: the time until which it is not met does not matter.
        free = () if way is None else (way.free() if len(known) > 1 else select(way.once, math.inf, 0.0),)
        starts = (*starts, free or (level[0], level[1], level[2]))
    course[GUESS, lane] = select(guess < longest, guess, longest)
    for k, kept in enumerate(starts):
        for i, number in enumerate(kept):
            course[WALLS + k * _OF_WALL + i, lane] = number


def guess_by_levels(walls, gravity, course, lane, r, v, remaining):
    """Set the guess of a lane to the rise of a level without a passage, if its parabola at the start rises sooner."""
    guess = course[GUESS, lane]
    for k, (_number, one) in enumerate(_known(walls, gravity, course[SPEED, lane], r, v, remaining, 0.0)):
        if one.seen.drive.passage(one.body, r, v, remaining) is None:
            at = WALLS + k * _OF_WALL
            rise = one.level.of_rows(tuple(course[at + i, lane] for i in range(_AT_END))).own_rise()
            guess = select(rise < guess, rise, guess)
    course[GUESS, lane] = guess


def start_series(walls, gravity, course, lane, r, v, remaining):
    """Put the polynomials of all walls at the start of a lane."""
    for k, (_number, one) in enumerate(_known(walls, gravity, course[SPEED, lane], r, v, remaining, 0.0)):
        for i in range(3):
            course[WALLS + k * _OF_WALL + i, lane] = one.level[i]


def put_angles_at_guess(walls, course, lane, remaining):
    """Put the `reduced` angles of all motions at the guess of a lane."""
    put_angles(walls, course, lane, remaining - course[GUESS, lane])


def put_angles(walls, course, lane, left):
    """Put the `reduced` angles of all motions at the time when `left` of the frame remains."""
    for at, rate in _waves(walls):
        course[at, lane], course[at + 1, lane] = reduced(rate * -left)


def put_waves(walls, course, lane, is_guess):
    """Put the waves of these angles; at a guess that is improved to about 1e-7: its error is cubed."""
    of = nearly_sine_and_versine_of if is_guess else sine_and_versine_of
    for at, _rate in _waves(walls):
        course[at, lane], course[at + 1, lane] = of(course[at, lane], course[at + 1, lane])


def with_waves(walls, course, lane):
    """Return the walls with the waves that were put for a lane."""
    return walls.with_waves(tuple(Wave(course[at, lane], course[at + 1, lane]) for at, _rate in _waves(walls)))


def copy_waves(walls, source, i, target, k):
    """Copy the waves of lane i of a course into lane k of another one."""
    for at, _rate in _waves(walls):
        target[at, k], target[at + 1, k] = source[at, i], source[at + 1, i]


def carry_waves(walls, course, lane):
    """Carry the waves at the guess of a lane to its hit, if that is proven."""
    way = select(course[MET, lane] >= 0.0, course[_WAY, lane], 0.0)
    for at, rate in _waves(walls):
        course[at, lane], course[at + 1, lane] = Wave(course[at, lane], course[at + 1, lane]).later(rate * way)


def _waves(walls):
    """Return (the first row of a wave, its rate) for each wave that is kept."""
    rates = tuple(rate for drive in _known_drives(walls) for rate in drive.rates())
    return tuple((_first_wave(walls) + k * _OF_WAVE, rate) for k, rate in enumerate(rates))


def _first_wave(walls):
    return WALLS + len(walls.each) * _OF_WALL


def _known_drives(walls):
    """Return the motions with waves that are kept: all, if a lane has the rows."""
    drives = walls.drives()
    count = sum(len(drive.rates()) for drive in drives)
    return drives if count <= len(walls.each) * _WAVES else ()


def put_levels(walls, gravity, course, lane, r, v, remaining, is_last):
    """Put the level that rises next to the guess of a lane or, before the proof, all levels at the guess.

    In a loop without a root or a quotient: operations that wait for these leave no room for the next lanes.
    """
    guess = course[GUESS, lane]
    known = _known(with_waves(walls, course, lane), gravity, course[SPEED, lane], r, v, remaining, guess)
    c, b, a, wall = _nearest_rise(known)
    course[_NEAREST, lane], course[_NEAREST + 1, lane], course[_NEAREST + 2, lane] = c, b, a
    course[_WALL, lane] = wall
    if not is_last:
        return
    for k, (_number, one) in enumerate(known):
        course[_COORDINATES, lane] = one.seen.coordinates
        for i in range(_KEPT):
            course[WALLS + k * _OF_WALL + _AT_END + i, lane] = one.level[i]


def put_way(course, lane):
    """Put the time from the guess of a lane to the nearest rise of its levels, ahead or back."""
    course[_WAY, lane] = nearest_root(*(course[_NEAREST + i, lane] for i in range(3)))


def improve(course, lane, remaining):
    """Move the guess nearer to the hit."""
    guess, longest = course[GUESS, lane], _longest(course, lane, remaining)
    after = guess + nearest_root(*(course[_NEAREST + i, lane] for i in range(3)))
    after = select(after < longest, after, longest)
    course[GUESS, lane] = select((guess > 0.0) & (after > 0.0), after, guess)


def _end(course, lane, remaining):
    """Return (when the flight of a lane meets a wall or ends, its time from the guess, whether it meets a wall)."""
    guess, way, longest = course[GUESS, lane], course[_WAY, lane], _longest(course, lane, remaining)
    time = guess + way
    meets = time < longest
    return select(meets, time, longest), select(meets, way, longest - guess), meets


def put_ends(walls, gravity, course, lane, r, v, remaining):
    """Put the levels at the end of the flight of a lane, and bounds of f'''/6: infinite if the end may be no root."""
    time, way, meets = _end(course, lane, remaining)
    far, coordinates = abs(way), course[_COORDINATES, lane]
    known = _known(with_waves(walls, course, lane), gravity, course[SPEED, lane], r, v, remaining, course[GUESS, lane])
    for k, (number, one) in enumerate(known):
        at = WALLS + k * _OF_WALL + _AT_END
        level = one.level.of_rows(tuple(course[at + i, lane] for i in range(_KEPT)))
        sixth = one._replace(level=level).third(time + far) * (1.0 / 6.0)
        # The parabola at the guess tells all about the end.
        near = sixth * far * far * far <= EPSILON * coordinates * level.steepness
        end = level.moved(way, meets & (course[_WALL, lane] == number))
        course[at, lane], course[at + 1, lane], course[at + 2, lane] = end[0], end[1], end[2]
        course[at + _SIXTH, lane] = select(near, sixth, math.inf)


def prove(walls, gravity, course, lane, r, v, remaining, by_series):
    """Keep the hit of a lane if it is proven: by the passages of walls that only swing, or else `by_series`."""
    time, way, meets = _end(course, lane, remaining)
    wall, proven = course[_WALL, lane], (course[GUESS, lane] > 0.0) & (time > 0.0)
    for k, (number, one) in enumerate(_known(walls, gravity, course[SPEED, lane], r, v, remaining, 0.0)):
        at = WALLS + k * _OF_WALL
        end = one.level.of_rows(tuple(course[at + _AT_END + i, lane] for i in range(_KEPT)))
        sixth = course[at + _AT_END + _SIXTH, lane]
        near = sixth < math.inf
        passage = one.seen.drive.passage(one.body, r, v, remaining)
        if passage is not None and not by_series:
            # A level that may rise twice is left to the series: its end alone proved only one flight in a hundred.
            free = course[at, lane]
            once = (free == math.inf) & near & end.is_admissible()
            others = (not (meets & (wall == number))) & (time <= free) & (free < math.inf)
            proven = proven & (once | others)
        else:
            ahead = since = 0.5 * time
            if passage is not None:
                across = (passage.enters < passage.leaves) & (passage.leaves > 0.0) & (passage.enters < time)
                ahead, since = select(across, passage.enters, ahead), select(across, passage.leaves, since)
                ahead, since = select(ahead > 0.0, ahead, 0.0), select(since < time, since, time)
            start = one.level.of_rows(tuple(course[at + i, lane] for i in range(_AT_END)))
            proven = proven & near & start.is_below(sixth, ahead, True) & end.is_below(sixth, time - since, False)
    for _at, rate in _waves(walls):
        proven = proven & ((not meets) | (abs(rate * way) <= LITTLE_ANGLE))
    course[TIME, lane] = select(proven, time, 0.0)
    course[MET, lane] = select(proven & meets, wall, -1.0)


def lacks_passages(walls):
    """Whether some walls have no passage."""
    return not all(_have_passages(walls))


def has_series(walls):
    """Whether the proof by series proves more than that by passages, because some walls have a passage."""
    return any(_have_passages(walls))


def _have_passages(walls):
    """For each wall that moves other than uniformly, whether its flights have a passage."""
    moving = (wall for wall in walls.each if isinstance(wall, Moving) and wall.accelerates)
    return tuple(wall.drive.only_swings() and wall.body.has_core for wall in moving)


def rows(walls):
    """The number of rows of the course that a lane uses."""
    return _first_wave(walls) + len(_waves(walls)) * _OF_WAVE


def open_rows(walls):
    """The rows that a lane without a proven hit needs: for a stride, and for the proof by series."""
    if not has_series(walls):
        return CLOSED, SPEED
    levels = tuple(WALLS + k * _OF_WALL + i for k, _wall in enumerate(walls.each) for i in range(_AT_END, _OF_WALL))
    waves = tuple(at + i for at, _rate in _waves(walls) for i in range(_OF_WAVE))
    return CLOSED, SPEED, GUESS, _WAY, _WALL, *levels, *waves


def is_open(course, lane, remaining):
    """Whether it is still unproven where the first hit of a lane is, or that the lane meets no wall."""
    return (course[MET, lane] < 0.0) & (course[TIME, lane] < _longest(course, lane, remaining))


def _longest(course, lane, remaining):
    """The time when the flight of a lane ends: with the frame, or at the first hit that has a closed form."""
    closed = course[CLOSED, lane]
    return select(closed < remaining, closed, remaining)


def _known(walls, gravity, speed, r, v, remaining, t):
    return levels_of(walls, flight_of(r, v, gravity, remaining, speed), t)


def _nearest_rise(known):
    """Return the first parabola c + 2 b t + a t^2 that rises next to here by its slope, and its wall."""
    c, b, a, wall = 0.0, 0.0, 0.0, -1.0
    for number, one in known:
        mine = one.level.ahead()
        # -c/b < -c'/b' without a division
        sooner = (mine.b > 0.0) & ((b <= 0.0) | (mine.c * b > c * mine.b))
        c, b, a = select(sooner, mine.c, c), select(sooner, mine.b, b), select(sooner, mine.a2, a)
        wall = select(sooner, number, wall)
    return c, b, a, wall

"""When a free flight meets the walls of a scene."""

import math
from typing import Any, NamedTuple

from ...kernel.gravity import as_vector
from ...kernel.jit import outlined, select
from ..presence.rooms import is_of_room, leaving
from ..walls import Field
from .course import Fall, Quartic
from .looks import FlightByLooks, Looked
from .polynomial import ConvexFlight, PolynomialFall, PolynomialFlight


class Hit(NamedTuple):
    """The time of a hit and the number of the wall.

    The number is -1 where the flight is surely free until that time, and must be searched further from there.
    """

    time: float
    wall: float


# The most rooms of a union, or cells of a field, that a step is followed through.
_MOST_ROOMS = 1000
# No hit, ever.
NEVER = Hit(math.inf, 0.0)


def of_flights(falls):
    """Return the names of the methods of a wall that free flights need; `falls`: under gravity."""
    return ("falling_hit" if falls else "first_hit",)


def of_steps(falls):
    """Return the names of the methods that whole steps need, some of which are skipped by a bound."""
    # The loops of a fall are compiled for every method.
    free = ("safe_time", "falling_hit") if falls else ("first_hit",)
    return *free, "inner", "level_of"


def hit(gravity, surface, r, v):
    """Return when the free flight leaves the admissible side of one wall: (time, whether it is a hit)."""
    if gravity is None:
        return surface.first_hit(r, v)
    return surface.falling_hit(r, v, as_vector(gravity))


def first_hit(walls, gravity, r, v):
    """Return the first `Hit` of a free flight."""
    first = NEVER
    for rooms in reversed(walls.joined()):
        hits = tuple(tuple(hit(gravity, wall, r, v) for _number, wall, _gentle in room) for room in rooms)
        left = union_hit(walls, rooms, hits, gravity, (r, v))
        first = soonest(left, 0.0, first)
    for number, wall in reversed(walls.shared()):
        if isinstance(wall, Field):
            first = soonest(wall.members.field_hit(gravity, r, v), number, first)
        else:
            time, found = hit(gravity, wall, r, v)
            first = sooner(time, found, number, first)
    return first


def union_hit(walls, rooms, hits, gravity, flight, stops=False):
    """Return the first `Hit` of a flight (r, v) with a union, from the hits in its rooms; `stops` as in `end`."""
    leaves: Any = ()
    for room, some in zip(rooms, hits, strict=True):
        first = NEVER
        for (number, _wall, _gentle), (time, found) in zip(reversed(room), reversed(some), strict=True):
            first = sooner(time, found, number, first)
        leaves = (*leaves, first)
    return Hit(*leaving(walls, rooms, leaves, gravity, flight, stops))


def soonest(hit, number, later):
    """Return the sooner of two hits: with the field that begins at this wall number, and with a later wall."""
    first = hit.time <= later.time
    wall = select(hit.wall < 0.0, -1.0, hit.wall + number)
    return Hit(select(first, hit.time, later.time), select(first, wall, later.wall))


def sooner(time, found, number, later):
    """Return the sooner of two hits: with the wall of this number, and with a later wall."""
    sooner = later.time < time
    return Hit(select(sooner, later.time, time), select(sooner, later.wall, select(found, number, -1.0)))


# --- In lanes, by steps ----------------------------------------------------------------------------------

# A flight in lanes: the state of the safe steps of each wall, in this number of rows for each wall.
COURSE = 13
_WINDOW, _TIME, _LAST, _CLOSE = 5, 6, 7, 8
# Rows of a polynomial: all its numbers except the window
_OF_POLYNOMIAL = 0, 1, 2, 3, 4, 5, 8
# A guess, where a polynomial has no start and end
_GUESS = 8
# Rows of a fall with a guess: all powers
_OF_FALL = 0, 1, 2, 3, 4, 9, 10, 11, 12
# Rows of a flight by looks: its constants, the next look and the last look
_OF_CONSTANTS = 4, 5, 8
_OF_LOOKS = 0, 1, 2, 3


def begin(walls, gravity, course, row, lane, r, v, aims=False):
    """Write the start of a flight to each wall into course[row:, lane]; `aims`: leave the work of `turn` to `aimed`."""
    for k, wall in enumerate(walls.each):
        at = row + k * COURSE
        if aims and gravity is not None and wall.fall_powers > 0:
            _begin_fall(course, at, lane, wall.fall(gravity, r, v))
            continue
        steps = wall.steps(gravity, r, v)
        if steps is None:
            time, found = hit(gravity, wall, r, v)
            course[at + _TIME, lane], course[at + _LAST, lane] = time, select(found, 0.0, math.inf)
            continue
        if isinstance(steps, Fall):
            for i, number in enumerate(steps.level):
                course[at + i, lane] = number
            course[at + _CLOSE, lane] = steps.nearly
        elif isinstance(steps, PolynomialFlight):
            _begin_polynomial(course, at, lane, steps)
            if aims and wall.aims:
                _begin_guess(course, at, lane, steps)
                continue
        elif isinstance(steps, FlightByLooks):
            _begin_looks(course, at, lane, steps)
            continue
        course[at + _TIME, lane], course[at + _LAST, lane] = steps.first_step()


def _begin_polynomial(course, at, lane, flight):
    """Write the numbers of a polynomial."""
    for i, number in zip(_OF_POLYNOMIAL, flight, strict=False):
        if number is not None:
            course[at + i, lane] = number


def _begin_fall(course, at, lane, fall):
    """Write the numbers of a fall."""
    for i, number in zip(_OF_FALL, fall.powers, strict=False):
        course[at + i, lane] = number
    course[at + _WINDOW, lane] = fall.window
    course[at + _TIME, lane], course[at + _LAST, lane] = 0.0, math.inf


def _begin_guess(course, at, lane, flight):
    """Write the start of a guess of the root."""
    course[at + _WINDOW, lane], course[at + _LAST, lane] = flight.window, 0.5 * flight.window
    if isinstance(flight, ConvexFlight):
        course[at + _GUESS, lane] = flight.turn()


def _begin_looks(course, at, lane, flight):
    """Write the start of a flight by looks."""
    for i, number in zip(_OF_CONSTANTS, flight.constants(), strict=False):
        course[at + i, lane] = number
    _keep(course, at, lane, flight.first())


def _look_on(course, at, lane, flight):
    """Look at the flight once more, if it needs that."""
    constants = tuple(course[at + i, lane] for i in _OF_CONSTANTS[: len(flight.constants())])
    goes_on = course[at + _LAST, lane] > 0.0
    known = Looked(course[at + _TIME, lane], goes_on, *(course[at + i, lane] for i in _OF_LOOKS))
    after = flight.with_constants(*constants).look(known)
    _keep(course, at, lane, Looked(*(select(goes_on, new, old) for new, old in zip(after, known, strict=True))))


def _keep(course, at, lane, known):
    """Write the numbers of `Looked`."""
    for i, number in zip(_OF_LOOKS, (known.at, known.before, known.level, known.half), strict=True):
        course[at + i, lane] = number
    course[at + _TIME, lane], course[at + _LAST, lane] = known.free, select(known.goes_on, 1.0, 0.0)


def turn(walls, gravity, course, row, lane):
    """Put the time from which to guess the first hit with a wall, where that is a chain of operations of its own."""
    for k, wall in enumerate(walls.each):
        level = _level(course, row + k * COURSE, lane, wall, gravity) if _is_aimed(wall, gravity) else None
        if level is not None and not isinstance(level, ConvexFlight):
            course[row + k * COURSE + _GUESS, lane] = level.turn()


def aim(walls, gravity, course, row, lane):
    """Guess the first hits."""
    for k, wall in enumerate(walls.each):
        if _is_aimed(wall, gravity):
            at = row + k * COURSE
            course[at + _GUESS, lane] = _level(course, at, lane, wall, gravity).aim(course[at + _GUESS, lane])


def nearer(walls, gravity, course, row, lane):
    """Improve the guesses."""
    for k, wall in enumerate(walls.each):
        if _is_aimed(wall, gravity):
            at, level = row + k * COURSE, _level(course, row + k * COURSE, lane, wall, gravity)
            guess = course[at + _GUESS, lane]
            course[at + _GUESS, lane] = select(course[at + _LAST, lane] > 0.0, level.nearer(guess), guess)


def aimed(walls, gravity, course, row, lane, is_last):
    """Improve the guesses again; a guess that leads to a hit is the first step."""
    for k, wall in enumerate(walls.each):
        if _is_aimed(wall, gravity):
            at, level = row + k * COURSE, _level(course, row + k * COURSE, lane, wall, gravity)
            guess, length = level.aimed(course[at + _GUESS, lane], course[at + _LAST, lane], is_last)
            course[at + _GUESS, lane], course[at + _LAST, lane] = guess, length
            course[at + _TIME, lane] = select(length > 0.0, 0.0, guess)


def step_off(walls, gravity, course, row, lane, r, v):
    """Take the first safe step of a fall to each wall to which no guess has led."""
    for k, wall in enumerate(walls.each):
        if _is_aimed(wall, gravity):
            at = row + k * COURSE
            goes_on, (t, length) = course[at + _LAST, lane] > 0.0, wall.steps(gravity, r, v).first_safe_step()
            course[at + _TIME, lane] = select(goes_on, t, course[at + _TIME, lane])
            course[at + _LAST, lane] = select(goes_on, length, course[at + _LAST, lane])


def leave_free(walls, gravity, course, row, lane, remaining):
    """Stop guessing for walls that the flight surely does not meet in this frame."""
    for k, wall in enumerate(walls.each):
        if _is_aimed(wall, gravity):
            at, level = row + k * COURSE, _level(course, row + k * COURSE, lane, wall, gravity)
            free = (course[at + _LAST, lane] > 0.0) & level.is_free(remaining)
            course[at + _TIME, lane] = select(free, remaining, course[at + _TIME, lane])
            course[at + _GUESS, lane] = select(free, remaining, course[at + _GUESS, lane])
            course[at + _LAST, lane] = select(free, -1.0, course[at + _LAST, lane])


def _is_aimed(wall, gravity):
    """Whether the hit with a wall is guessed."""
    return wall.aims if gravity is None else wall.fall_powers > 0


def _level(course, at, lane, wall, gravity):
    """Return the `PolynomialFlight`, or `PolynomialFall`, to a wall."""
    if gravity is not None:
        powers = tuple(course[at + i, lane] for i in _OF_FALL[: wall.fall_powers])
        return PolynomialFall(powers, course[at + _WINDOW, lane])
    level = wall.flight(*(course[at + i, lane] for i in _OF_POLYNOMIAL[: wall.kept]))
    return level._replace(window=course[at + _WINDOW, lane]) if wall.aims else level


def step(walls, gravity, course, row, lane, r, v):
    """Take one safe step to every wall that needs steps, of the flight that starts at r."""
    for k, wall in enumerate(walls.each):
        at = row + k * COURSE
        if gravity is not None and wall.is_quartic:
            level = Quartic(*(course[at + i, lane] for i in range(_WINDOW + 1)))
            steps = Fall(level, course[at + _CLOSE, lane], wall.may_be_far)
        elif gravity is None and wall.kept > 0:
            steps = _level(course, at, lane, wall, gravity)
        else:
            steps = wall.steps(gravity, r, v)
        if isinstance(steps, FlightByLooks):
            _look_on(course, at, lane, steps)
        elif steps is not None:
            t, last = steps.next_step(course[at + _TIME, lane], course[at + _LAST, lane])
            course[at + _TIME, lane], course[at + _LAST, lane] = t, last


def end(walls, gravity, course, row, lane, flight, stops=False):
    """Return `first_hit` from the course of a flight (r, v); with `stops` no flight continues in another room."""
    first, k = NEVER, len(walls.shared())
    # A flight that stops is used only to learn whether it needs more steps.
    asked = None if stops else flight
    for rooms in walls.joined():
        hits: Any = ()
        for room in rooms:
            hits = (
                *hits,
                tuple(_known(wall, gravity, course, row, k + i, lane, asked) for i, (_n, wall, _g) in enumerate(room)),
            )
            k += len(room)
        first = soonest(union_hit(walls, rooms, hits, gravity, flight, stops), 0.0, first)
    for k, (_number, wall) in reversed(tuple(enumerate(walls.shared()))):
        time, found = _known(wall, gravity, course, row, k, lane, asked)
        first = sooner(time, found, float(k), first)
    return first


def _known(wall, gravity, course, row, k, lane, flight):
    """Return the hit with wall k that the course holds: (time, whether it is a hit); `flight` (r, v) refines it."""
    at = row + k * COURSE
    time, found = course[at + _TIME, lane], course[at + _LAST, lane] == 0.0
    if flight is not None and (wall.kept > 0 if gravity is None else wall.fall_powers > 0):
        time = select(found, wall.refined(gravity, *flight, time), time)
    return time, found


# --- Of one wall, and of all but one ---------------------------------------------------------------------


def hit_of(walls, gravity, wall, r, v):
    """Return `hit` of the wall with this number."""
    return walls.of(wall, (math.inf, True), _hit_of, gravity, r, v)


def _hit_of(surface, gravity, r, v):
    return hit(gravity, surface, r, v)


def other_hit(walls, wall, r, v, until=math.inf):
    """Return the first hit of a straight flight up to `until` with any wall except this one; -1: with any wall.

    In a union it is a hit with the walls of the same room, even where the flight passes into another room there.
    """
    first = NEVER
    for rooms in reversed(walls.joined()):
        is_in_union = False
        for room in reversed(rooms):
            is_in_room = is_of_room(room, wall)
            is_in_union = is_in_room | is_in_union
            for number, other, _gentle in reversed(room):
                time, _found = other.first_hit(r, v)
                first = _unless(first, (wall == number) | (not is_in_room), Hit(time, number))
        first = _unless(first, is_in_union, union_end(walls, rooms, r, v, until))
    # The only wall has no other: else the compiler would compute its hit and throw it away at run time.
    several = len(walls.each) > 1 or len(walls.fields()) > 0
    for number, other in reversed(walls.shared() if several else ()):
        if isinstance(other, Field):
            first = soonest(other.members.other_hit(wall - number, r, v, until), number, first)
        else:
            time, _found = other.first_hit(r, v)
            first = _unless(first, wall == number, Hit(time, number))
    return first


def _unless(first, skip, hit):
    """Return the sooner hit, but the `first` one where the other is to be skipped."""
    use = (first.time < hit.time) | skip
    return Hit(select(use, first.time, hit.time), select(use, first.wall, hit.wall))


@outlined
def union_end(walls, rooms, r, v, until):
    """Return the `Hit` where a straight flight leaves a union; the wall is -1 if it stays inside up to `until`."""
    t = 0.0
    for _room in range(_MOST_ROOMS):
        place = r + t * v
        hits = tuple(tuple(wall.first_hit(place, v) for _number, wall, _gentle in room) for room in rooms)
        hit = union_hit(walls, rooms, hits, None, (place, v))
        t += hit.time
        if hit.wall >= 0.0 or not t < until:
            return Hit(t, hit.wall)
    return Hit(t, -1.0)


def is_free(walls, r, v, until):
    """Whether a straight flight meets no wall up to `until`."""
    if len(walls.fields()) > 0 or len(walls.unions) > 0:
        return other_hit(walls, -1.0, r, v, until).time > until
    return first_hit(walls, None, r, v).time > until


# --- Free time, with and without gravity -----------------------------------------------------------------


def free_time(gravity, walls, r, v):
    """Return a time during which the flight surely stays admissible; 0 for a particle that is in contact now."""
    if gravity is None:
        return select(walls.outside(-1.0, r), 0.0, first_hit(walls, gravity, r, v).time)
    return safe_time(walls, r, v, as_vector(gravity))


def safe_time(walls, r, v, pull):
    """Return the smallest safe time of all walls."""
    shortest = math.inf
    for wall in reversed(walls.each):
        time = wall.safe_time(r, v, pull)
        shortest = select(shortest < time, shortest, time)
    return shortest

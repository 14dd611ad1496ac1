"""The time when a flight meets walls in any motion: safe steps of all walls, so that no hit is skipped."""

import math
from typing import Any

from ...kernel.arrays import index
from ...kernel.grid import cell_of, entries_of
from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ..fields.members import member
from ..presence.rooms import leaving
from ..walls import Field, Following, Walls
from . import flights
from .flights import NEVER, Hit, hit, sooner, soonest
from .march import SafeStep, Search, first_met
from .rising import Flight, flight_of

# A flight that is past a wall by at most this many times the round-off of its place is at the wall.
_ROUND_OFF = 8.0
# The bounds of a flight in the cell of a field hold for at most this many times its length, after this many trials.
_CLOSE, _TRIALS = 2.0, 8
# At first they hold for this many times the time that a straight flight would be in its cell.
CURVED = 1.5


class ShortestStep(Record):
    """The shortest safe step of all walls, its wall and its way; a wall that the flight has passed, or -1, how far."""

    time: float
    wall: float
    way: float
    room: float  # a shorter way is round-off
    past: float
    depth: float


_NO_STEP = ShortestStep(math.inf, -1.0, math.inf, 0.0, -1.0, 0.0)


# --- Of all walls ----------------------------------------------------------------------------------------


def seen_by_walls(walls, flight, t):
    """Return (wall, its number, `Seen`) of each wall outside of fields that is met by safe steps, last to first."""
    found: Any = ()
    seen = None
    for number, wall in walls.numbered():
        if not isinstance(wall, (Field, Following)):
            seen = wall.seen(flight, t)
        if seen is not None and not isinstance(wall, Field):
            found = ((wall, number, seen), *found)
    return found


def _nearest(walls, flight, t, longest):
    """Return the `ShortestStep` of all walls that are met by safe steps."""
    found = _NO_STEP
    for wall, number, seen in seen_by_walls(walls, flight, t):
        found = _nearer(seen, wall.body, number, found, longest)
    for number, field in reversed(walls.fields()):
        if field.members.accelerates:
            found = _nearest_in_cell(field.members, number, found, flight, t, longest)
    return found


@outlined
def _nearest_in_cell(field, number, found, flight, t, longest):
    """Return the shorter step of `found` and those to the bodies of the cell in which the particle is at t.

    A step may end where the particle leaves the cell, which is no hit.
    """
    grid, seen = field.body.grid, field.seen(flight, t)
    until = until_next_cell(field.body, seen, min(found.time, longest))
    if until < found.time:
        found = ShortestStep(until, -1.0, math.inf, 0.0, found.past, found.depth)
    cell = cell_of(grid, seen.r)
    first, stop = entries_of(grid, cell.number)
    here = field.body.way_in_cell(cell, seen, min(found.time, longest))
    for k in range(first, stop):
        if field.body.may_meet(cell, index(k - first), here):
            m, within = grid.entries[k], min(found.time, longest)
            if field.body.misses(index(m), seen, within):
                continue
            found = _nearer(seen, member(field.body, index(m)), number + m, found, within)
    return found


@outlined
def until_next_cell(members, seen, longest):
    """Return a time up to `longest` during which a particle, seen in the frame of a field, is surely near its cell.

    Near the block of free cells around its cell, where these are known.
    """
    grid = members.grid
    cell, time = cell_of(grid, seen.r), 0.0
    # The bound of the acceleration grows with the time that it holds for: at first the time of a straight flight.
    within = min(CURVED * members.until_out(cell, None, seen.r, seen.v), longest)
    for _k in range(_TRIALS):
        until = members.until_out(cell, seen.pulls(within), seen.r, seen.v)
        time = max(time, min(until, within))
        if not _CLOSE * time < within:
            break
        within = math.sqrt(time * within)
    return time


def _nearer(seen, body, number, rest, longest):
    """Return the shorter `ShortestStep` of one wall and `rest`."""
    step = body.moving_step(seen, longest)
    is_past = (step.level > 0.0) & (step.half > 0.0)
    speed, room = seen.bounds(0.0).speed, 2.0 * EPSILON * seen.coordinates
    depth, way = speed * (0.5 * step.level / select(is_past, step.half, 1.0)), speed * step.time
    sooner_one = step.time < rest.time
    return ShortestStep(
        *select(sooner_one, (step.time, number, way, room), rest[:4]), *select(is_past, (number, depth), rest[4:])
    )


class ToWalls(Search):
    """A flight to all walls that are met by safe steps, up to the time `longest`."""

    walls: Any
    flight: Flight
    longest: float

    def look(self, t, is_first):
        longest = self.longest - t
        near = _nearest(self.walls, self.flight, t, longest)
        is_past = near.past >= 0.0 and not is_first
        # By round-off: a wall that bends within its bounds is not passed by more.
        is_at = is_past and near.depth <= _ROUND_OFF * near.room
        if is_at:
            return SafeStep(t, 0.0, near.past, -1.0)
        # A step that only ends with the time `longest` is no hit, however short.
        arrives = near.time < longest and (not is_first or near.time == 0.0) and near.way <= near.room
        return SafeStep(t, near.time, select(arrives, near.wall, -1.0), select(is_past, near.past, -1.0))

    def past(self, t):
        return _nearest(self.walls, self.flight, t, 0.0).past


@outlined
def march_moving(walls, flight, longest):
    """Return the first `Hit` with the walls that are met by safe steps, if there is one before `longest`."""
    return Hit(*first_met(ToWalls(walls, flight, longest)))


@outlined
def march_alone(walls, r, v, pull, remaining):
    """Return `march_moving` of a flight with `remaining` of the frame left [s]."""
    return march_moving(walls, flight_of(r, v, pull, remaining), remaining)


# --- Free time -------------------------------------------------------------------------------------------


def free_time_moving(walls, gravity, r, v, remaining):
    """Return a time during which a flight surely stays admissible, with `remaining` of the frame left [s].

    0 for a particle that is in contact now.
    """
    now, time = walls.at(remaining), math.inf
    if not walls.accelerate:
        return flights.free_time(gravity, now, r, v)
    for wall in reversed(now.each):
        here = _free_of(wall, gravity, r, v)
        time = select(time < here, time, here)
    return time


def _free_of(wall, gravity, r, v):
    """Return the free time of one wall."""
    if not wall.accelerates:
        return flights.free_time(gravity, Walls((wall,)), r, v)
    # One safe step only: of a flight of many steps the next one begins nearer to the wall.
    step = wall.body.moving_step(wall.sees(gravity, r, v), wall.remaining)
    return select(step.level > 0.0, 0.0, step.time)


# --- First hits ------------------------------------------------------------------------------------------


@outlined
def first_hit_moving(walls, gravity, r, v, remaining):
    """Return the first `Hit` of a free flight with walls in any motion, with `remaining` of the frame left [s]."""
    if walls.unions:
        return _first_hit_in_rooms(walls, gravity, r, v, remaining)
    found = closed_hit(walls.at(remaining), gravity, r, v)
    longest = select(found.time < remaining, found.time, remaining)
    met = march_moving(walls, flight_of(r, v, gravity, remaining), longest)
    if met.wall >= 0.0 or met.time < longest:
        return met
    return found


def _first_hit_in_rooms(walls, gravity, r, v, remaining):
    """Return `first_hit_moving` where some of the walls belong to unions."""
    found: Any = NEVER
    shared = tuple(wall for _number, wall in walls.shared())
    if shared:
        found = first_hit_moving(walls.alone(shared), gravity, r, v, remaining)
    for rooms, now in zip(walls.joined(), walls.at(remaining).joined(), strict=True):
        leaves: Any = ()
        for room in rooms:
            some = walls.alone(tuple(wall for _number, wall, _gentle in room))
            leaves = (*leaves, soonest(first_hit_moving(some, gravity, r, v, remaining), room[0][0], NEVER))
        left = Hit(*leaving(walls, now, leaves, gravity, (r, v), False))
        found = soonest(left, 0.0, found)
    return found


def closed_hit(walls, gravity, r, v):
    """Return the first hit with the walls that have a closed form."""
    found = NEVER
    for number, wall in reversed(walls.numbered()):
        if isinstance(wall, Field):
            found_in = NEVER if wall.members.accelerates else wall.members.field_hit(gravity, r, v)
            found = soonest(found_in, number, found)
        else:
            time, meets = (math.inf, True) if wall.accelerates else hit(gravity, wall, r, v)
            found = sooner(time, meets, number, found)
    return found

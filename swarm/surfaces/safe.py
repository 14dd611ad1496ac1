"""When a flight meets walls in any motion: safe steps of all walls, so that no hit is skipped."""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.gravity import accelerated
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import ZERO
from ..motion import Guide
from . import flights
from .drive import drive_of
from .fields.grid import cell_of
from .fields.members import Members, member
from .fields.moved import until_next_in_frame
from .flights import NEVER, Hit, hit, sooner, soonest
from .moving import Driven, Following, Marched, Moving, Translated
from .posed import Drifting, Posed
from .relative import flight_of
from .rotation import Rotated
from .surface import Surface
from .walls import Field, Walls

_EPSILON = 2.220446049250313e-16
# Safe steps of one flight; what is not found by then goes on in the next pass.
_MARCH = 200
# A flight that is past a wall by so many times the round-off of its place is at it.
_ROUND_OFF = 8.0
# Bisections of an interval down to neighbouring numbers.
_BISECTIONS = 1100


class Nearest(Record):
    """The shortest safe step of all walls, its wall and how far it goes; a wall that is passed, or -1, and how far."""

    time: float
    wall: float
    way: float
    room: float  # what way counts as none
    past: float
    depth: float


_NOBODY = Nearest(math.inf, -1.0, math.inf, 0.0, -1.0, 0.0)


# --- Of all walls ----------------------------------------------------------------------------------------


def seen_by_walls(walls, flight, t):
    """(wall, its number, `Seen`) of each wall in no field that is met by safe steps, last to first."""
    found: Any = ()
    seen = None
    for number, wall in walls.numbered():
        if isinstance(wall, Field):
            continue
        if not isinstance(wall, Following):
            seen = wall.seen(flight, t) if isinstance(wall, Driven) else None
        if seen is not None:
            found = ((wall, number, seen), *found)
    return found


def _nearest(walls, flight, t, longest):
    """The `Nearest` of all walls that are met by safe steps."""
    found = _NOBODY
    for wall, number, seen in seen_by_walls(walls, flight, t):
        found = _nearer(seen, wall.body, number, found, longest)
    for number, field in reversed(walls.fields()):
        if isinstance(field.members, Moving) and not isinstance(field.members, Translated):
            found = _nearest_in_cell(field.members, number, found, flight, t, longest)
    return found


@outlined
def _nearest_in_cell(field, number, found, flight, t, longest):
    """The nearest of what is found and the bodies of the cell in which a particle is then.

    To leave the cell ends a step, but is no hit.
    """
    grid, seen = field.body.grid, field.seen(flight, t)
    until = until_next_in_frame(grid, seen, min(found.time, longest))
    if until < found.time:
        found = Nearest(until, -1.0, math.inf, 0.0, found.past, found.depth)
    cell = index(cell_of(grid, seen.r).number)
    for k in range(grid.first[cell], grid.first[cell + 1]):
        m = grid.entries[k]
        found = _nearer(seen, member(field.body, index(m)), number + m, found, min(found.time, longest))
    return found


def _nearer(seen, body, number, rest, longest):
    """The `Nearest` of one wall and the rest."""
    step = body.moving_step(seen, longest)
    is_past = (step.level > 0.0) & (step.half > 0.0)
    speed, room = seen.bounds(0.0).speed, 2.0 * _EPSILON * seen.coordinates
    depth, way = speed * (0.5 * step.level / select(is_past, step.half, 1.0)), speed * step.time
    sooner_one = step.time < rest.time
    return Nearest(
        *select(sooner_one, (step.time, number, way, room), rest[:4]),
        *select(is_past, (number, depth), rest[4:]),
    )


@outlined
def march(walls, flight, longest):
    """The first `Hit` with the walls that are met by safe steps, if there is one before the longest time."""
    t, before = 0.0, 0.0
    for i in range(_MARCH):
        near = _nearest(walls, flight, t, longest - t)
        if i > 0 and near.past >= 0.0:
            # By round-off: a wall that bends as is said is not passed by more.
            if near.depth <= _ROUND_OFF * near.room:
                return Hit(t, near.past)
            return _last_inside(walls, flight, before, t, near.past)
        # A step that only ends with the longest time is no hit, however short.
        if not near.time < longest - t:
            return Hit(longest, -1.0)
        before, t = t, t + near.time
        if (i > 0 or near.time == 0.0) and near.way <= near.room:
            return Hit(t, near.wall)
    return Hit(t, -1.0)


@outlined
def _last_inside(walls, flight, low, high, wall):
    """The last time between two at which no wall is passed: at the second one is, by round-off."""
    for _i in range(_BISECTIONS):
        t = 0.5 * (low + high)
        if not low < t < high:
            break
        past = _nearest(walls, flight, t, 0.0).past
        if past >= 0.0:
            high, wall = t, past
        else:
            low = t
    return Hit(low, wall)


def lacks_bend(surface: Surface) -> bool:
    """Whether a surface moves so that its hits need safe steps, and does not bound its bend."""
    return _needs_steps(surface) and any(_is_unknown(wall) for wall in surface.walls())


def _needs_steps(surface: Surface) -> bool:
    if surface.mass is not None and surface.inertia is None:
        return isinstance(surface.motion, Guide) and surface.motion.stiffness > 0.0
    if surface.motion is None:
        return False
    drive = drive_of(surface, 0.0)
    return bool(drive.swings) or drive.track is not None or drive.turn is not None


def _is_unknown(wall: Any) -> bool:
    if isinstance(wall, Members):
        return _is_unknown(wall.like)
    if isinstance(wall, Rotated):
        return _is_unknown(wall.body)
    return wall.needs_bend and not wall.gives("hessian_bounds")


# --- Free time -------------------------------------------------------------------------------------------


def free_time(walls, gravity, r, v, remaining):
    """A time during which a flight surely stays admissible, with so much of the frame left [s].

    0 for a particle that is in contact now.
    """
    now, time = walls.at(remaining), math.inf
    if not isinstance(walls, Marched):
        return flights.free_time(gravity, now, r, v)
    for wall in reversed(now.each):
        here = _free_of(wall, gravity, r, v)
        time = select(time < here, time, here)
    return time


def _free_of(surface, gravity, r, v):
    """The free time of one wall."""
    if not _is_marched(surface):
        return flights.free_time(gravity, Walls((surface,)), r, v)
    # One safe step: of a flight of many steps the next one begins nearer to the wall.
    step = surface.body.moving_step(_seen_now(surface, gravity, r, v), surface.remaining)
    return select(step.level > 0.0, 0.0, step.time)


def _is_marched(surface):
    """Whether a wall at an instant is met by safe steps."""
    return isinstance(surface, Posed) and not isinstance(surface, Drifting)


def _seen_now(surface, gravity, r, v):
    """A particle in the frame of such a wall."""
    flight = flight_of(r, v, accelerated(gravity, ZERO, 1.0), surface.remaining)
    return Moving(surface.body, surface.drive).seen(flight, 0.0)


# --- First hits ------------------------------------------------------------------------------------------


@outlined
def first_hit(walls, gravity, r, v, remaining):
    """The first `Hit` of a free flight with walls in any motion, with so much of the frame left [s]."""
    found = closed_hit(walls.at(remaining), gravity, r, v)
    longest = select(found.time < remaining, found.time, remaining)
    met = march(walls, flight_of(r, v, accelerated(gravity, ZERO, 1.0), remaining), longest)
    if met.wall >= 0.0 or met.time < longest:
        return met
    return found


def closed_hit(walls, gravity, r, v):
    """The first hit with the walls that have a closed form."""
    found = NEVER
    for number, wall in reversed(walls.numbered()):
        if isinstance(wall, Field):
            closed = not _is_marched(wall.members)
            found = soonest(wall.members.field_hit(gravity, r, v) if closed else NEVER, number, found)
        else:
            time, meets = (math.inf, True) if _is_marched(wall) else hit(gravity, wall, r, v)
            found = sooner(time, meets, number, found)
    return found


@outlined
def _alone(surface, r, v, pull):
    """When a flight leaves the admissible side of this wall: (time, whether it does then)."""
    found = march(
        Walls((Moving(surface.body, surface.drive),)), flight_of(r, v, pull, surface.remaining), surface.remaining
    )
    return found.time, found.wall >= 0.0


@outlined
def _field_alone(field, r, v, pull):
    """The first hit of a flight with the bodies of a field, or how far it is surely free."""
    alone = Walls((Field(Moving(field.body, field.drive)),))
    return march(alone, flight_of(r, v, pull, field.remaining), field.remaining)


def _first_hit_of_field(members, gravity, r, v):
    return _field_alone(members, r, v, accelerated(gravity, ZERO, 1.0))


def _until_next_cell(members, r, v):
    return until_next_in_frame(members.body.grid, _seen_now(members, None, r, v), members.remaining)


# What takes safe steps is known only here.
Posed.first_hit = lambda surface, r, v: _alone(surface, r, v, ZERO)  # type: ignore[method-assign]
Posed.falling_hit = _alone  # type: ignore[method-assign]
Posed.field_hit = _first_hit_of_field  # type: ignore[attr-defined]
Posed.until_next_cell = _until_next_cell  # type: ignore[attr-defined]

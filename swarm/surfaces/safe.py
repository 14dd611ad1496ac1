"""When a flight meets walls in any motion: safe steps of all walls, so that no hit is skipped."""

import math
from typing import Any, NamedTuple

from ..kernel.gravity import accelerated
from ..kernel.jit import by_type, by_type_outlined, index, outlined, select
from ..kernel.vector import ZERO
from ..motion import Guide
from . import contract, flights
from .drive import drive_of
from .fields.grid import cell_of
from .fields.members import Members, member
from .fields.moved import until_next_in_frame
from .flights import NEVER, Hit, hit, sooner, soonest
from .fold import Chain, Field, count
from .moving import Following, Marched, Moving, Translated, at
from .posed import Drifting, Posed
from .relative import Framed, bounds_of, flight_of, motion_of, seen_at
from .rising import safe_step
from .rotation import Rotated
from .surface import Surface

_EPSILON = 2.220446049250313e-16
# Safe steps of one flight; what is not found by then goes on in the next pass.
_MARCH = 200
# A flight that is past a wall by so many times the round-off of its place is at it.
_ROUND_OFF = 8.0
# Bisections of an interval down to neighbouring numbers.
_BISECTIONS = 1100


class Nearest(NamedTuple):
    """The shortest safe step of all walls, its wall and how far it goes; a wall that is passed, or -1, and how far."""

    time: float
    wall: float
    way: float
    room: float  # what way counts as none
    past: float
    depth: float


_NOBODY = Nearest(math.inf, -1.0, math.inf, 0.0, -1.0, 0.0)


# --- Of all walls ----------------------------------------------------------------------------------------


@by_type
def _nearest(chain, number, last, flight, t, longest):
    """The `Nearest` of all walls that are met by safe steps; `last` is `Framed` of the wall before."""
    return _NOBODY


@_nearest.register(Chain)
def _(chain, number, last, flight, t, longest):
    mine = motion_of(chain.first, last, flight, t)
    rest = _nearest(chain.rest, number + 1.0, mine, flight, t, longest)
    return _nearer(mine, chain.first, number, rest, longest)


@_nearest.register(Field)
def _(chain, number, last, flight, t, longest):
    rest = _nearest(chain.rest, number + count(chain.first), None, flight, t, longest)
    return _nearest_of_field(chain.first, number, rest, flight, t, longest)


@by_type
def _nearest_of_field(field, number, rest, flight, t, longest):
    """The `Nearest` of the bodies of a field and the rest."""
    return rest


@_nearest_of_field.register(Moving)
def _(field, number, rest, flight, t, longest):
    return _nearest_in_cell(field, number, rest, flight, t, longest)


_nearest_of_field.register(Translated, lambda field, number, rest, flight, t, longest: rest)


@outlined
def _nearest_in_cell(field, number, rest, flight, t, longest):
    """The same by the bodies of the cell in which a particle is then; to leave the cell ends a step, but is no hit."""
    grid, mine = field.body.grid, Framed(field.drive, seen_at(field.drive, flight, t))
    until, found = until_next_in_frame(grid, field.drive, mine.seen, min(rest.time, longest)), rest
    if until < rest.time:
        found = Nearest(until, -1.0, math.inf, 0.0, rest.past, rest.depth)
    cell = index(cell_of(grid, mine.seen.r).number)
    for k in range(grid.first[cell], grid.first[cell + 1]):
        m = grid.entries[k]
        body = Following(member(field.body, index(m)))
        found = _nearer(mine, body, number + m, found, min(found.time, longest))
    return found


@by_type
def _nearer(mine, wall, number, rest, longest):
    """The `Nearest` of one wall and the rest."""
    return rest


@_nearer.register(Framed)
def _(mine, wall, number, rest, longest):
    seen = mine.seen
    step = safe_step(wall.body, mine.drive, seen, longest)
    is_past = (step.level > 0.0) & (step.half > 0.0)
    speed, room = bounds_of(mine.drive, seen, 0.0).speed, 2.0 * _EPSILON * seen.coordinates
    depth, way = speed * (0.5 * step.level / select(is_past, step.half, 1.0)), speed * step.time
    sooner_one = step.time < rest.time
    return Nearest(
        select(sooner_one, step.time, rest.time),
        select(sooner_one, number, rest.wall),
        select(sooner_one, way, rest.way),
        select(sooner_one, room, rest.room),
        select(is_past, number, rest.past),
        select(is_past, depth, rest.depth),
    )


@outlined
def march(chain, flight, longest):
    """The first `Hit` with the walls that are met by safe steps, if there is one before the longest time."""
    t, before = 0.0, 0.0
    for i in range(_MARCH):
        near = _nearest(chain, 0.0, None, flight, t, longest - t)
        if i > 0 and near.past >= 0.0:
            # By round-off: a wall that bends as is said is not passed by more.
            if near.depth <= _ROUND_OFF * near.room:
                return Hit(t, near.past)
            return _last_inside(chain, flight, before, t, near.past)
        # A step that only ends with the longest time is no hit, however short.
        if not near.time < longest - t:
            return Hit(longest, -1.0)
        before, t = t, t + near.time
        if (i > 0 or near.time == 0.0) and near.way <= near.room:
            return Hit(t, near.wall)
    return Hit(t, -1.0)


@outlined
def _last_inside(chain, flight, low, high, wall):
    """The last time between two at which no wall is passed: at the second one is, by round-off."""
    for _i in range(_BISECTIONS):
        t = 0.5 * (low + high)
        if not low < t < high:
            break
        past = _nearest(chain, 0.0, None, flight, t, 0.0).past
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
    return drive.swings is not None or drive.track is not None or drive.turn is not None


def _is_unknown(wall: Any) -> bool:
    if isinstance(wall, Members):
        return _is_unknown(wall.like)
    if isinstance(wall, Rotated):
        return _is_unknown(wall.body)
    own = safe_step.dispatch(type(wall)) is safe_step.dispatch(object)
    return own and contract.bend.dispatch(type(wall)) is contract.bend.dispatch(object)


# --- Free time -------------------------------------------------------------------------------------------


@by_type
def free_time(chain, gravity, r, v, left):
    """A time during which a flight surely stays admissible, with so much of the frame left [s].

    0 for a particle that is in contact now.
    """
    return flights.free_time(gravity, at(chain, left), r, v)


@free_time.register(Marched)
def _(chain, gravity, r, v, left):
    return _free_of_all(at(chain, left), gravity, r, v)


@by_type
def _free_of_all(chain, gravity, r, v):
    return math.inf


@_free_of_all.register(Chain)
def _(chain, gravity, r, v):
    here, other = _free_of(chain.first, gravity, r, v), _free_of_all(chain.rest, gravity, r, v)
    return select(other < here, other, here)


@by_type
def _free_of(surface, gravity, r, v):
    """The free time of one wall."""
    return flights.free_time(gravity, Chain(surface, None), r, v)


_free_of.register(Drifting, lambda surface, gravity, r, v: flights.free_time(gravity, Chain(surface, None), r, v))


@_free_of.register(Posed)
def _(surface, gravity, r, v):
    # One safe step: of a flight of many steps the next one begins nearer to the wall.
    seen = seen_at(surface.drive, flight_of(r, v, accelerated(gravity, ZERO, 1.0), surface.left), 0.0)
    step = safe_step(surface.body, surface.drive, seen, surface.left)
    return select(step.level > 0.0, 0.0, step.time)


# --- First hits ------------------------------------------------------------------------------------------


@by_type_outlined
def first_hit(chain, gravity, r, v, left):
    """The first `Hit` of a free flight with the walls of a scene, with so much of the frame left [s]."""
    return NEVER


@first_hit.register(Marched)
def _(chain, gravity, r, v, left):
    found = closed_hit(at(chain, left), gravity, r, v)
    longest = select(found.time < left, found.time, left)
    met = march(chain.walls, flight_of(r, v, accelerated(gravity, ZERO, 1.0), left), longest)
    if met.wall >= 0.0 or met.time < longest:
        return met
    return found


@by_type
def closed_hit(chain, gravity, r, v):
    """The first hit with the walls that have a closed form."""
    return NEVER


@closed_hit.register(Chain)
def _(chain, gravity, r, v):
    rest = closed_hit(chain.rest, gravity, r, v)
    time, found = _closed(chain.first, gravity, r, v)
    return sooner(time, found, rest)


@closed_hit.register(Field)
def _(chain, gravity, r, v):
    rest = closed_hit(chain.rest, gravity, r, v)
    return soonest(_closed_in_field(chain.first, gravity, r, v), rest, count(chain.first))


@by_type
def _closed_in_field(field, gravity, r, v):
    return field.first_hit(gravity, r, v)


_closed_in_field.register(Posed, lambda field, gravity, r, v: NEVER)
_closed_in_field.register(Drifting, lambda field, gravity, r, v: field.first_hit(gravity, r, v))


@by_type
def _closed(surface, gravity, r, v):
    return hit(gravity, surface, r, v)


_closed.register(Posed, lambda surface, gravity, r, v: (math.inf, True))
_closed.register(Drifting, lambda surface, gravity, r, v: hit(gravity, surface, r, v))


@outlined
def _alone(surface, r, v, pull):
    """When a flight leaves the admissible side of this wall: (time, whether it does then)."""
    found = march(Chain(Moving(surface.body, surface.drive), None), flight_of(r, v, pull, surface.left), surface.left)
    return found.time, found.wall >= 0.0


contract.first_hit.register(Posed, lambda surface, r, v: _alone(surface, r, v, ZERO))
contract.falling_hit.register(Posed, lambda surface, r, v, pull: _alone(surface, r, v, pull))


@outlined
def _field_alone(field, r, v, pull):
    """The first hit of a flight with the bodies of a field, or how far it is surely free."""
    chain = Field(Moving(field.body, field.drive), None)
    return march(chain, flight_of(r, v, pull, field.left), field.left)


def _first_hit_of_field(members, gravity, r, v):
    return _field_alone(members, r, v, accelerated(gravity, ZERO, 1.0))


def _until_next_cell(members, r, v):
    seen = seen_at(members.drive, flight_of(r, v, ZERO, members.left), 0.0)
    return until_next_in_frame(members.body.grid, members.drive, seen, members.left)


# What takes safe steps is known only here.
Posed.first_hit = _first_hit_of_field  # type: ignore[attr-defined]
Posed.until_next_cell = _until_next_cell  # type: ignore[attr-defined]

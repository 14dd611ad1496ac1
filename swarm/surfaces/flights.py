"""When a free flight meets the walls of a scene: the hits and free times of one wall, folded over the chain."""

import math
from typing import NamedTuple

from ..kernel.gravity import Gravity, Nothing, as_vector
from ..kernel.jit import by_type, inlined, select
from . import contract
from .course import Quartic, arrived, close, leave, safe_step
from .fold import Chain, Field, count, member, outside


class Hit(NamedTuple):
    """Time of a hit and the wall's number.

    The number is -1 where the flight is surely free until then, and what comes after is not known yet.
    """

    time: float
    wall: float


# No hit, ever.
NEVER = Hit(math.inf, 0.0)


def of_flights(falls):
    """What the free flights of a method ask of every wall, with gravity or without."""
    return (contract.falling_hit if falls else contract.first_hit,)


def of_steps(falls):
    """The same for whole steps, some of which are jumped over."""
    # The loops of a fall are compiled for every method.
    free = (contract.safe_time, contract.falling_hit) if falls else (contract.first_hit,)
    return *free, contract.inner, contract.level_of


@by_type
def hit(gravity, surface, r, v):
    """When the free flight leaves the admissible side of one wall: (time, whether it does then)."""
    raise NotImplementedError


hit.register(Nothing, lambda gravity, surface, r, v: contract.first_hit(surface, r, v))
hit.register(Gravity, lambda gravity, surface, r, v: contract.falling_hit(surface, r, v, as_vector(gravity)))


@by_type
def first_hit(chain, gravity, r, v):
    """The first `Hit` of a free flight."""
    raise NotImplementedError


@first_hit.register(Chain)
def _(chain, gravity, r, v):
    time, found = hit(gravity, chain.first, r, v)
    return sooner(time, found, first_hit(chain.rest, gravity, r, v))


@first_hit.register(Field)
def _(chain, gravity, r, v):
    return soonest(field_hit(chain.first, gravity, r, v), first_hit(chain.rest, gravity, r, v), count(chain.first))


first_hit.register(Nothing, lambda chain, gravity, r, v: NEVER)


@by_type
def field_hit(members, gravity, r, v):
    """The first `Hit` of a free flight with the bodies of a field, or how far it is surely free."""
    raise NotImplementedError


@inlined
def soonest(hit, later, before):
    """The sooner one of two hits, the second with a wall that has so many more walls before it."""
    first = hit.time <= later.time
    behind = select(later.wall < 0.0, -1.0, later.wall + before)
    return Hit(select(first, hit.time, later.time), select(first, hit.wall, behind))


@inlined
def sooner(time, found, later):
    """The sooner one of the hit of the first wall and that of the rest."""
    sooner = later.time < time
    wall = select(later.wall < 0.0, -1.0, later.wall + 1.0)
    return Hit(select(sooner, later.time, time), select(sooner, wall, select(found, 0.0, -1.0)))


# --- Falls in lanes --------------------------------------------------------------------------------------

# A falling flight in lanes: what the safe steps of each wall know, in this many rows a wall.
COURSE = 9
_WINDOW, _TIME, _LAST, _CLOSE = 5, 6, 7, 8


@by_type
def by_steps(chain):
    """A number where falls to a wall of a chain take safe steps, else None: a type for the compiler."""
    return


by_steps.register(Chain, lambda chain: _one_of(contract.falls_by_steps(chain.first), chain.rest))


@by_type
def _one_of(steps, rest):
    return steps


_one_of.register(Nothing, lambda steps, rest: by_steps(rest))


@by_type
def begin_fall(chain, course, row, lane, r, v, pull):
    """The course of a falling flight for every wall into course[row:, lane]."""


@begin_fall.register(Chain)
def _(chain, course, row, lane, r, v, pull):
    if contract.is_quartic(chain.first):
        level = contract.course(chain.first, r, v, pull)
        course[row, lane], course[row + 1, lane], course[row + 2, lane] = level.c, level.b, level.a2
        course[row + 3, lane], course[row + 4, lane], course[row + _WINDOW, lane] = level.a3, level.a4, level.window
        course[row + _TIME, lane], course[row + _LAST, lane] = leave(level)
        course[row + _CLOSE, lane] = close(level.window)
    else:
        time, found = contract.falling_hit(chain.first, r, v, pull)
        course[row + _TIME, lane], course[row + _LAST, lane] = time, select(found, 0.0, math.inf)
    begin_fall(chain.rest, course, row + COURSE, lane, r, v, pull)


@by_type
def step_fall(chain, course, row, lane):
    """One safe step of every wall that needs steps."""


@step_fall.register(Chain)
def _(chain, course, row, lane):
    if contract.is_quartic(chain.first):
        level = Quartic(
            course[row, lane], course[row + 1, lane], course[row + 2, lane],
            course[row + 3, lane], course[row + 4, lane], course[row + _WINDOW, lane],
        )  # fmt: skip
        course[row + _TIME, lane], course[row + _LAST, lane] = safe_step(
            contract.may_be_far(chain.first), level, course[row + _CLOSE, lane],
            course[row + _TIME, lane], course[row + _LAST, lane],
        )  # fmt: skip
    step_fall(chain.rest, course, row + COURSE, lane)


@by_type
def end_fall(chain, course, row, lane):
    """`first_hit` from the course."""
    raise NotImplementedError


@end_fall.register(Chain)
def _(chain, course, row, lane):
    found = arrived(course[row + _LAST, lane])
    return sooner(course[row + _TIME, lane], found, end_fall(chain.rest, course, row + COURSE, lane))


end_fall.register(Nothing, lambda chain, course, row, lane: NEVER)


# --- Of one wall, and of all but one ---------------------------------------------------------------------


@by_type
def hit_of(chain, gravity, wall, r, v):
    """`hit` of the wall with this number."""
    raise NotImplementedError


@hit_of.register(Chain)
def _(chain, gravity, wall, r, v):
    time, found = hit(gravity, chain.first, r, v)
    other, found_other = hit_of(chain.rest, gravity, wall - 1.0, r, v)
    here = wall == 0.0
    return select(here, time, other), (here & found) | ((not here) & found_other)


@hit_of.register(Field)
def _(chain, gravity, wall, r, v):
    time, found = hit(gravity, member(chain.first, wall), r, v)
    other, found_other = hit_of(chain.rest, gravity, wall - count(chain.first), r, v)
    here = wall < count(chain.first)
    return select(here, time, other), (here & found) | ((not here) & found_other)


hit_of.register(Nothing, lambda chain, gravity, wall, r, v: (math.inf, True))


@by_type
def other_hit(chain, wall, r, v):
    """The first hit of a straight flight with any wall but this one, which is one of the chain's."""
    raise NotImplementedError


other_hit.register(Chain, lambda chain, wall, r, v: _other_hit(chain.rest, chain, wall, r, v))


@by_type
def _other_hit(rest, chain, wall, r, v):
    raise NotImplementedError


# The only wall has no other: without this the compiler would compute its hit and throw it away at run time.
_other_hit.register(Nothing, lambda rest, chain, wall, r, v: NEVER)
_other_hit.register(Chain, lambda rest, chain, wall, r, v: _hit_but(chain, wall, r, v))


@by_type
def _hit_but(chain, wall, r, v):
    raise NotImplementedError


@_hit_but.register(Chain)
def _(chain, wall, r, v):
    time, _found = contract.first_hit(chain.first, r, v)
    other = _hit_but(chain.rest, wall - 1.0, r, v)
    use = (other.time < time) | (wall == 0.0)
    return Hit(select(use, other.time, time), select(use, other.wall + 1.0, 0.0))


_hit_but.register(Nothing, lambda chain, wall, r, v: NEVER)


# --- Free time, with and without gravity -----------------------------------------------------------------


@by_type
def free_time(gravity, chain, r, v):
    """A time during which the flight surely stays admissible; 0 for a particle that is in contact now."""
    raise NotImplementedError


@free_time.register(Nothing)
def _(gravity, chain, r, v):
    return select(outside(chain, -1.0, r), 0.0, first_hit(chain, gravity, r, v).time)


free_time.register(Gravity, lambda gravity, chain, r, v: safe_time(chain, r, v, as_vector(gravity)))


@by_type
def safe_time(chain, r, v, pull):
    """The smallest safe time of all walls."""
    raise NotImplementedError


@safe_time.register(Chain)
def _(chain, r, v, pull):
    time = contract.safe_time(chain.first, r, v, pull)
    other = safe_time(chain.rest, r, v, pull)
    return select(other < time, other, time)


safe_time.register(Nothing, lambda chain, r, v, pull: math.inf)

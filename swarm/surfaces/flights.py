"""When a free flight meets the walls of a scene: the hits and free times of one surface, folded over the chain."""

import math

from ..kernel.gravity import Gravity, Nothing
from ..kernel.jit import by_type, select
from . import base
from .chain import Chain, outside
from .course import arrived, close, leave, safe_step


def of_flights(falls):
    """What the free flights of a method ask of every wall, with gravity or without."""
    return (base.falling_hit if falls else base.first_hit,)


def of_steps(falls):
    """The same for whole steps, some of which are jumped over."""
    # The loops of a fall are compiled for every method.
    free = (base.safe_time, base.falling_hit) if falls else (base.first_hit,)
    return *free, base.inner, base.level_of


@by_type
def hit(gravity, surface, x, y, z, vx, vy, vz):
    """When the free flight leaves the admissible side of one surface: (time, whether it does then)."""
    raise NotImplementedError


@hit.register(Nothing)
def _(gravity, surface, x, y, z, vx, vy, vz):
    return base.first_hit(surface, x, y, z, vx, vy, vz)


@hit.register(Gravity)
def _(gravity, surface, x, y, z, vx, vy, vz):
    return base.falling_hit(surface, x, y, z, vx, vy, vz, gravity.x, gravity.y, gravity.z)


@by_type
def first_hit(chain, gravity, x, y, z, vx, vy, vz):
    """Time of the first hit of a free flight, and the index of the surface.

    The index is -1 where the flight is surely free until then, and more is not known yet.
    """
    raise NotImplementedError


@first_hit.register(Chain)
def _(chain, gravity, x, y, z, vx, vy, vz):
    time, found = hit(gravity, chain.first, x, y, z, vx, vy, vz)
    later, index = first_hit(chain.rest, gravity, x, y, z, vx, vy, vz)
    sooner = later < time
    here = select(found, 0.0, -1.0)
    return select(sooner, later, time), select(sooner, select(index < 0.0, -1.0, index + 1.0), here)


@first_hit.register(Nothing)
def _(chain, gravity, x, y, z, vx, vy, vz):
    return math.inf, 0.0


# A falling flight in lanes: what the safe steps of each wall know, in this many rows a wall.
COURSE = 9


@by_type
def begin_fall(chain, course, row, lane, x, y, z, vx, vy, vz, gx, gy, gz):
    """The course of a falling flight for every wall into course[row:, lane]."""


@begin_fall.register(Chain)
def _(chain, course, row, lane, x, y, z, vx, vy, vz, gx, gy, gz):
    if base.is_quartic(chain.first):
        c, b, a2, a3, a4, window = base.course(chain.first, x, y, z, vx, vy, vz, gx, gy, gz)
        course[row, lane], course[row + 1, lane], course[row + 2, lane] = c, b, a2
        course[row + 3, lane], course[row + 4, lane], course[row + 5, lane] = a3, a4, window
        course[row + 6, lane], course[row + 7, lane] = leave(c, b, a2, a3, a4, window)
        course[row + 8, lane] = close(window)
    else:
        time, found = base.falling_hit(chain.first, x, y, z, vx, vy, vz, gx, gy, gz)
        course[row + 6, lane], course[row + 7, lane] = time, select(found, 0.0, math.inf)
    begin_fall(chain.rest, course, row + COURSE, lane, x, y, z, vx, vy, vz, gx, gy, gz)


@by_type
def step_fall(chain, course, row, lane):
    """One safe step of every wall that needs steps."""


@step_fall.register(Chain)
def _(chain, course, row, lane):
    if base.is_quartic(chain.first):
        course[row + 6, lane], course[row + 7, lane] = safe_step(
            base.may_be_far(chain.first), course[row, lane], course[row + 1, lane], course[row + 2, lane],
            course[row + 3, lane], course[row + 4, lane], course[row + 5, lane], course[row + 8, lane],
            course[row + 6, lane], course[row + 7, lane],
        )  # fmt: skip
    step_fall(chain.rest, course, row + COURSE, lane)


@by_type
def end_fall(chain, course, row, lane):
    """`first_hit` from the course."""
    raise NotImplementedError


@end_fall.register(Chain)
def _(chain, course, row, lane):
    time, found = course[row + 6, lane], arrived(course[row + 7, lane])
    later, index = end_fall(chain.rest, course, row + COURSE, lane)
    here = select(found, 0.0, -1.0)
    sooner = later < time
    return select(sooner, later, time), select(sooner, select(index < 0.0, -1.0, index + 1.0), here)


@end_fall.register(Nothing)
def _(chain, course, row, lane):
    return math.inf, 0.0


@by_type
def hit_of(chain, gravity, index, x, y, z, vx, vy, vz):
    """`hit` of surface `index`."""
    raise NotImplementedError


@hit_of.register(Chain)
def _(chain, gravity, index, x, y, z, vx, vy, vz):
    time, found = hit(gravity, chain.first, x, y, z, vx, vy, vz)
    other, found_other = hit_of(chain.rest, gravity, index - 1.0, x, y, z, vx, vy, vz)
    here = index == 0.0
    return select(here, time, other), (here & found) | ((not here) & found_other)


@hit_of.register(Nothing)
def _(chain, gravity, index, x, y, z, vx, vy, vz):
    return math.inf, True


@by_type
def other_hit(chain, index, x, y, z, vx, vy, vz):
    """Time until which a straight flight is free of any surface but `index`, one of the chain's, and the next one."""
    raise NotImplementedError


@other_hit.register(Chain)
def _(chain, index, x, y, z, vx, vy, vz):
    return _other_hit(chain.rest, chain, index, x, y, z, vx, vy, vz)


@by_type
def _other_hit(rest, chain, index, x, y, z, vx, vy, vz):
    raise NotImplementedError


@_other_hit.register(Nothing)
def _(rest, chain, index, x, y, z, vx, vy, vz):
    # The only surface has no other: without this the compiler would compute its hit and throw it away at run time.
    return math.inf, 0.0


@_other_hit.register(Chain)
def _(rest, chain, index, x, y, z, vx, vy, vz):
    return _hit_but(chain, index, x, y, z, vx, vy, vz)


@by_type
def _hit_but(chain, index, x, y, z, vx, vy, vz):
    raise NotImplementedError


@_hit_but.register(Chain)
def _(chain, index, x, y, z, vx, vy, vz):
    time, _found = base.first_hit(chain.first, x, y, z, vx, vy, vz)
    later, other = _hit_but(chain.rest, index - 1.0, x, y, z, vx, vy, vz)
    use = (later < time) | (index == 0.0)
    return select(use, later, time), select(use, other + 1.0, 0.0)


@_hit_but.register(Nothing)
def _(chain, index, x, y, z, vx, vy, vz):
    return math.inf, 0.0


# --- Free time, with and without gravity -----------------------------------------------------------------


@by_type
def free_time(gravity, chain, x, y, z, vx, vy, vz):
    """A time during which the flight surely stays admissible; 0 for a particle that is in contact now."""
    raise NotImplementedError


@free_time.register(Nothing)
def _(gravity, chain, x, y, z, vx, vy, vz):
    time, _index = first_hit(chain, gravity, x, y, z, vx, vy, vz)
    return select(outside(chain, -1.0, x, y, z), 0.0, time)


@free_time.register(Gravity)
def _(gravity, chain, x, y, z, vx, vy, vz):
    return safe_time(chain, x, y, z, vx, vy, vz, gravity.x, gravity.y, gravity.z)


@by_type
def safe_time(chain, x, y, z, vx, vy, vz, gx, gy, gz):
    """The smallest safe time of all surfaces."""
    raise NotImplementedError


@safe_time.register(Chain)
def _(chain, x, y, z, vx, vy, vz, gx, gy, gz):
    time = base.safe_time(chain.first, x, y, z, vx, vy, vz, gx, gy, gz)
    other = safe_time(chain.rest, x, y, z, vx, vy, vz, gx, gy, gz)
    return select(other < time, other, time)


@safe_time.register(Nothing)
def _(chain, x, y, z, vx, vy, vz, gx, gy, gz):
    return math.inf

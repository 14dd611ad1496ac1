"""Safe steps to a wall whose level is known near each place of a flight, and what follows from them.

Where the level along a whole flight is no quartic, or one of which round-off leaves nothing, it is asked for anew at
the end of each step: a polynomial of the time from there that is nowhere below it. A step ends where a parabola above
that rises through 0, so no root is skipped; near the root it is Newton's step of second order.
"""

import math
from typing import Any, NamedTuple

from ..kernel.gravity import Gravity, Nothing, accelerated, displacement
from ..kernel.jit import by_type, inlined, outlined, select
from . import contract, flights
from .course import positive, rise_by, rise_time

# Steps of a flight that is asked for alone; what is not found by then goes on in the next pass.
_STEPS = 100


class Near(NamedTuple):
    """The level from one place of a flight on, nowhere above c + 2 b t + a2 t^2 + a3 t^3 + a4 t^4.

    The window is a time for which that says something. A step that leaves no more than `nearly` of the level is the
    last, unless to rise through 0 is not yet to meet the wall.
    """

    c: Any
    b: Any
    a2: Any
    a3: Any
    a4: Any
    window: Any
    nearly: Any
    meets: Any


class NearFall(NamedTuple):
    """The same with four powers of the time more."""

    c: Any
    b: Any
    a2: Any
    a3: Any
    a4: Any
    a5: Any
    a6: Any
    a7: Any
    a8: Any
    window: Any
    nearly: Any
    meets: Any


class NearPiece(NamedTuple):
    """The level of a `Near` up to a border, beyond which it may differ by (speed t + bent t^2 - margin)^2.

    `rises`: whether it may be higher by that.
    """

    c: Any
    b: Any
    a2: Any
    a3: Any
    a4: Any
    speed: Any
    bent: Any
    margin: Any
    rises: Any
    window: Any
    nearly: Any
    meets: Any


@by_type
def _slopes(level, t):
    """(s, m) with a3 t^3 + a4 t^4 + ... <= s t^3 and of a magnitude of at most m t^3 from 0 to t."""
    raise NotImplementedError


@_slopes.register(Near)
def _(level, t):
    return positive(level.a3) + t * positive(level.a4), abs(level.a3) + t * abs(level.a4)


@_slopes.register(NearFall)
def _(level, t):
    rise = positive(level.a6) + t * (positive(level.a7) + t * positive(level.a8))
    rise = positive(level.a3) + t * (positive(level.a4) + t * (positive(level.a5) + t * rise))
    size = abs(level.a6) + t * (abs(level.a7) + t * abs(level.a8))
    return rise, abs(level.a3) + t * (abs(level.a4) + t * (abs(level.a5) + t * size))


@_slopes.register(NearPiece)
def _(level, t):
    rise, size = positive(level.a3) + t * positive(level.a4), abs(level.a3) + t * abs(level.a4)
    return rise, size + _beyond(level, t) / select(t > 0.0, t, math.inf)


@by_type
def _bend(level, t):
    """What takes the place of a2 from 0 to t."""
    return level.a2


@_bend.register(NearPiece)
def _(level, t):
    return level.a2 + select(level.rises, _beyond(level, t), 0.0)


@inlined
def _beyond(level, t):
    """s with (speed t + bent t^2 - margin)^2 <= s t^2 from 0 to t, 0 before the border."""
    over = positive(level.speed + t * level.bent - level.margin / select(t > 0.0, t, math.inf))
    return select(t > 0.0, over * over, 0.0)


@inlined
def _slopes_within(level, reach):
    """Of a step as far as its reach: `_slopes` and `_bend`."""
    # The reach is infinite only where the level is a parabola.
    t = select(reach < math.inf, reach, 0.0)
    rise, size = _slopes(level, t)
    return rise, size, _bend(level, t)


@inlined
def _ended(level, time, reach, size):
    """(the step, its length or 0 if it is the last)."""
    step = select(time < reach, time, reach)
    # A step that only ends at its reach is no hit, however short.
    last = level.meets & (time <= reach) & (rise_by(size, reach) * step * step <= level.nearly)
    return step, select(last, 0.0, step)


@inlined
def first_step(level):
    """The first step of a flight: (t, its length, 0 if it is the last)."""
    rise, size, a2 = _slopes_within(level, level.window)
    time = rise_time(level.c, level.b, a2 + rise_by(rise, level.window))
    # See `leave` in course.py.
    leaving = rise_time(2.0 * level.b, 0.5 * a2, rise)
    return _ended(level, select((level.b <= 0.0) & (leaving > time), leaving, time), level.window, size)


@inlined
def next_step(level, t, last):
    """One step more of a flight, from where the steps until t have led: (t, its length, 0 if it is the last).

    The parabola holds for twice the last step, or without end where the level is one itself.
    """
    reach = select(level.window < math.inf, 2.0 * last, math.inf)
    rise, size, a2 = _slopes_within(level, reach)
    step, length = _ended(level, rise_time(level.c, level.b, a2 + rise_by(rise, reach)), reach, size)
    goes_on = under_way(t, last)
    return select(goes_on, t + step, t), select(goes_on, length, last)


@inlined
def under_way(t, last):
    """Whether a flight has not met the wall, and may."""
    return (t < math.inf) & (last > 0.0)


@inlined
def place(gravity, r, v, t, last):
    """Where the steps of a flight have led it, and its velocity there; its start where there are no more of them."""
    s = select(under_way(t, last), t, 0.0)
    return r + displacement(gravity, v, s), accelerated(gravity, v, s)


# --- What follows from `near` ----------------------------------------------------------------------------


@outlined
def _first_hit(surface, gravity, r, v):
    """`first_hit` with or without gravity."""
    t, last = first_step(contract.near(surface, gravity, r, v))
    for _step in range(_STEPS):
        if not under_way(t, last):
            break
        p, w = place(gravity, r, v, t, last)
        t, last = next_step(contract.near(surface, gravity, p, w), t, last)
    return t, not under_way(t, last)


@contract.near.implies(contract.first_hit)
def _(surface, r, v):
    return _first_hit(surface, None, r, v)


@contract.near.implies(contract.falling_hit)
def _(surface, r, v, pull):
    return _first_hit(surface, Gravity(pull.x, pull.y, pull.z), r, v)


@contract.near.implies(contract.safe_time)
def _(surface, r, v, pull):
    level = contract.near(surface, Gravity(pull.x, pull.y, pull.z), r, v)
    return select(level.c > 0.0, 0.0, first_step(level)[0])


# --- In lanes --------------------------------------------------------------------------------------------

contract.near.implies(flights.in_steps)(lambda surface: 1.0)


@contract.near.implies(flights.begin_wall)
def _(surface, gravity, course, row, lane, r, v):
    _begin(_in_steps(gravity, surface), surface, gravity, course, row, lane, r, v)


@contract.near.implies(flights.step_wall)
def _(surface, gravity, course, row, lane, r, v):
    _step(_in_steps(gravity, surface), surface, gravity, course, row, lane, r, v)


@by_type
def _in_steps(gravity, surface):
    return 1.0


_in_steps.register(Nothing, lambda gravity, surface: flights.in_steps(surface))


@by_type
def _begin(steps, surface, gravity, course, row, lane, r, v):
    level = contract.near(surface, gravity, r, v)
    course[row + flights.TIME, lane], course[row + flights.LAST, lane] = first_step(level)


@_begin.register(Nothing)
def _(steps, surface, gravity, course, row, lane, r, v):
    flights.begin_whole(gravity, surface, course, row, lane, r, v)


@by_type
def _step(steps, surface, gravity, course, row, lane, r, v):
    t, last = course[row + flights.TIME, lane], course[row + flights.LAST, lane]
    p, w = place(gravity, r, v, t, last)
    level = contract.near(surface, gravity, p, w)
    course[row + flights.TIME, lane], course[row + flights.LAST, lane] = next_step(level, t, last)


@_step.register(Nothing)
def _(steps, surface, gravity, course, row, lane, r, v):
    pass

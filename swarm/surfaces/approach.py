"""Safe steps to a wall whose level is known near each place of a flight, and what follows from them.

Where the level along a whole flight is no quartic, or one of which round-off leaves nothing, it is asked for anew at
the end of each step: a polynomial of the time from there that is nowhere below it. A step ends where a parabola above
that rises through 0, so no root is skipped; near the root it is Newton's step of second order.
"""

import math
from typing import Any

from ..kernel.gravity import Gravity, accelerated, displacement
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from . import flights
from .course import Majorant, positive, rise_by

# Steps of a flight that is asked for alone; what is not found by then goes on in the next pass.
_STEPS = 100


class Near(Majorant):
    """The level from one place of a flight on, nowhere above c + 2 b t + a2 t^2 + a3 t^3 + ...

    The window is a time for which that says something. A step that leaves no more than `nearly` of the level is the
    last, unless to rise through 0 is not yet to meet the wall.
    """

    c: Any
    b: Any
    a2: Any
    higher: Any  # a3, a4, ...
    window: Any
    nearly: Any
    meets: Any
    border: Any = None  # None or `Border`

    def bounds(self, reach):
        """(the level with the a2 of a step as far as its reach, s, m).

        Up to there the terms from t^3 on are at most s t^3, beyond a border with a2, and of a magnitude of at most
        m t^3.
        """
        # The reach is infinite only where the level is a parabola.
        t = select(reach < math.inf, reach, 0.0)
        rise, size = positive(self.higher[-1]), abs(self.higher[-1])
        for a in reversed(self.higher[:-1]):
            rise, size = positive(a) + t * rise, abs(a) + t * size
        if self.border is None:
            return self, rise, size
        beyond = self.border.beyond(t)
        a2 = self.a2 + select(self.border.rises, beyond, 0.0)
        above = Near(self.c, self.b, a2, self.higher, self.window, self.nearly, self.meets, self.border)
        return above, rise, size + beyond / select(t > 0.0, t, math.inf)

    def ended(self, time, reach, size):
        """(the step, its length or 0 if it is the last)."""
        step = select(time < reach, time, reach)
        # A step that only ends at its reach is no hit, however short.
        last = self.meets & (time <= reach) & (rise_by(size, reach) * step * step <= self.nearly)
        return step, select(last, 0.0, step)

    def first_step(self):
        """The first step of a flight: (t, its length, 0 if it is the last)."""
        above, rise, size = self.bounds(self.window)
        return self.ended(above.rises_after_leaving(rise, self.window), self.window, size)

    def next_step(self, t, last):
        """One step more of a flight, from where the steps until t have led: (t, its length, 0 if it is the last).

        The parabola holds for twice the last step, or without end where the level is one itself.
        """
        reach = select(self.window < math.inf, 2.0 * last, math.inf)
        above, rise, size = self.bounds(reach)
        step, length = self.ended(above.rises(rise, reach), reach, size)
        goes_on = under_way(t, last)
        return select(goes_on, t + step, t), select(goes_on, length, last)


class Border(Record):
    """A border, beyond which a level may differ by (speed t + bent t^2 - margin)^2; `rises`: be higher by that."""

    speed: Any
    bent: Any
    margin: Any
    rises: Any

    def beyond(self, t):
        """s with (speed t + bent t^2 - margin)^2 <= s t^2 from 0 to t, 0 before the border."""
        over = positive(self.speed + t * self.bent - self.margin / select(t > 0.0, t, math.inf))
        return select(t > 0.0, over * over, 0.0)


def under_way(t, last):
    """Whether a flight has not met the wall, and may."""
    return (t < math.inf) & (last > 0.0)


def place(gravity, r, v, t, last):
    """Where the steps of a flight have led it, and its velocity there; its start where there are no more of them."""
    s = select(under_way(t, last), t, 0.0)
    return r + displacement(gravity, v, s), accelerated(gravity, v, s)


# --- What follows from `near` ----------------------------------------------------------------------------


@outlined
def first_hit(surface, gravity, r, v):
    """`first_hit` with or without gravity."""
    t, last = surface.near(gravity, r, v).first_step()
    for _step in range(_STEPS):
        if not under_way(t, last):
            break
        p, w = place(gravity, r, v, t, last)
        t, last = surface.near(gravity, p, w).next_step(t, last)
    return t, not under_way(t, last)


def safe_time(surface, r, v, pull):
    """A time during which a fall surely stays admissible."""
    level = surface.near(Gravity(pull.x, pull.y, pull.z), r, v)
    return select(level.c > 0.0, 0.0, level.first_step()[0])


# --- In lanes --------------------------------------------------------------------------------------------


def begin(surface, gravity, course, row, lane, r, v):
    """The start of a flight into course[row:, lane]."""
    if _in_steps(surface, gravity):
        level = surface.near(gravity, r, v)
        course[row + flights.TIME, lane], course[row + flights.LAST, lane] = level.first_step()
    else:
        flights.begin_whole(gravity, surface, course, row, lane, r, v)


def step(surface, gravity, course, row, lane, r, v):
    """One safe step of it."""
    if _in_steps(surface, gravity):
        t, last = course[row + flights.TIME, lane], course[row + flights.LAST, lane]
        level = surface.near(gravity, *place(gravity, r, v, t, last))
        course[row + flights.TIME, lane], course[row + flights.LAST, lane] = level.next_step(t, last)


def _in_steps(surface, gravity):
    """Whether a flight takes steps: a constant for the compiler."""
    return gravity is not None or surface.in_steps is not None

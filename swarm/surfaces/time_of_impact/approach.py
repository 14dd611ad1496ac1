"""Safe steps to a wall with a level that is known near each place of a flight.

They serve where the level along a whole flight is no quartic, or one that round-off spoils. Each step asks for a new
bound of the level: a polynomial of the time from there that is nowhere below it. A step ends where a parabola above
this polynomial rises through 0, so no root is skipped; near the root it is Newton's step of second order.
order.
"""

import math
from typing import Any

from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import Vec
from .course import Majorant, positive, rise_by, under_way


class LevelBound(Majorant):
    """A bound of the level from one place of a flight on: c + 2 b t + a2 t^2 + a3 t^3 + ...

    The bound is useful for the time `window`. A step that leaves no more than `nearly` of the level is the last, unless
    `meets` is False: the level may rise through 0 there without a hit.
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
        """Return (the level with the a2 of a step up to its reach, s, m).

        Up to the reach the terms from t^3 on, and beyond a border a2, are at most s t^3, and their magnitude is at most
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
        above = self._replace(a2=self.a2 + select(self.border.rises, beyond, 0.0))
        return above, rise, size + beyond / select(t > 0.0, t, math.inf)

    def step(self, time, reach, size):
        """Return (the step, its length or 0 if it is the last)."""
        step = select(time < reach, time, reach)
        # A step that only ends at its reach is no hit, however short.
        last = self.meets & (time <= reach) & (rise_by(size, reach) * step * step <= self.nearly)
        return step, select(last, 0.0, step)

    def first_step(self):
        """Return the first step of a flight: (t, its length or 0 if it is the last)."""
        above, rise, size = self.bounds(self.window)
        return self.step(above.rises_after_leaving(rise, self.window), self.window, size)


class Border(Record):
    """A border, beyond which a level may differ by (speed t + bent t^2 - margin)^2; `rises`: it may be higher."""

    speed: Any
    bent: Any
    margin: Any
    rises: Any

    def beyond(self, t):
        """Return s with (speed t + bent t^2 - margin)^2 <= s t^2 from 0 to t; 0 before the border."""
        over = positive(self.speed + t * self.bent - self.margin / select(t > 0.0, t, math.inf))
        return select(t > 0.0, over * over, 0.0)


class Approach(Record):
    """The steps of a flight to a wall that gives a bound of its level, `near`, at each step."""

    surface: Any
    gravity: Any
    r: Vec
    v: Vec

    # A flight that needs more steps continues in the next pass.
    most = 100

    def first_step(self):
        return self.surface.near(self.gravity, self.r, self.v).first_step()

    def next_step(self, t, last):
        goes_on = under_way(t, last)
        # Where there are no more steps, the result of the step from the start is not used.
        s = select(goes_on, t, 0.0)
        place, velocity = self.r + displacement(self.gravity, self.v, s), accelerated(self.gravity, self.v, s)
        step, length = self.step_from(place, velocity, last)
        return select(goes_on, t + step, t), select(goes_on, length, last)

    def step_from(self, p, w, last):
        """Return (the step from a place with a velocity, its length or 0 if it is the last)."""
        # The parabola holds for twice the last step, or without end where the level itself is a parabola.
        level = self.surface.near(self.gravity, p, w)
        reach = select(level.window < math.inf, 2.0 * last, math.inf)
        above, rise, size = level.bounds(reach)
        return level.step(above.rises(rise, reach), reach, size)


class AimedApproach(Approach):
    """The steps of a flight to a wall with a `fall`, a `PolynomialFall`: its first root is guessed."""

    def first_step(self):
        time, open_ = self.surface.fall(self.gravity, self.r, self.v).aims(math.inf)
        first, length = self.first_safe_step()
        return select(open_ > 0.0, first, time), select(open_ > 0.0, length, 0.0)

    def first_safe_step(self):
        """Return the first step where no guess has led to the root."""
        return Approach.first_step(self)

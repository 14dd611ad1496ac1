"""Safe steps along a straight flight with a level that is a polynomial of time of degree 4 at most.

The coefficients are known once for the whole flight. From the wall inwards the level has a root at 0, which is divided
out: what is left is a cubic; its first root above 0 is the hit. The last step leaves to Newton's method what two
steps of that make round-off: one by the same coefficients, and one by the level at the place of impact.
"""

import math
from typing import Any

from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from .course import Quartic, positive, rise_by, rise_time, under_way

# Steps that all lanes take: of a hundred flights from a wall of degree 4 one needs more.
POLYNOMIAL_STEPS = 4
# From here two steps of Newton's method leave round-off: part of the slope that it changes by on the way to the root.
_CONVERGES = 1e-5


class PolynomialFlight(Record):
    """The steps of a flight along which c + 2 b t + a2 t^2 + a3 t^3 + a4 t^4 is to rise through 0.

    Of a solid the polynomial begins at the time `since`, and what is after `until` does not count; of a cavity both are
    None. The first step is at most of the length `window`.
    """

    c: float
    b: float
    a2: float
    a3: float
    a4: float
    since: Any = None
    until: Any = None
    window: float = 0.0

    most = 60

    def first_step(self):
        start = 0.0 if self.since is None else select(self.since <= self.until, self.since, math.inf)
        return start, 0.5 * self.window

    def next_step(self, t, last):
        """One step towards the first root: (t, its length, 0 if it is the last), as those of `course.Fall`."""
        s = t if self.since is None else t - self.since
        c, b, a2, a3, a4, _window = Quartic(self.c, self.b, self.a2, self.a3, self.a4, 0.0).moved(s)
        # Where neither of the higher terms rises, the parabola is above the level for ever.
        reach = select((a3 > 0.0) | (a4 > 0.0), 2.0 * last, math.inf)
        excess = rise_by(positive(a3 + positive(a4) * reach), reach)
        time = rise_time(c, b, a2 + excess)
        at_root, step = time <= reach, select(time < reach, time, reach)
        # The level there is -left: one step of Newton's method goes on from it.
        left = step * step * (excess - step * (a3 + step * a4))
        slope = 2.0 * b + step * (2.0 * a2 + step * (3.0 * a3 + step * (4.0 * a4)))
        rises = at_root & (slope > 0.0)
        way = left / select(rises, slope, 1.0)
        bend = abs(a2) + 3.0 * step * (abs(a3) + 2.0 * step * abs(a4))
        converges = rises & (way * bend <= _CONVERGES * slope)
        is_last = converges | (at_root & (step <= EPSILON * s))
        # A parabola that holds for about as long as the way to the root is the nearest to the level.
        length = select(rises & (way < step) & (way > 0.0), way, step)
        step = select(converges, step + way, step)
        after = t + step
        if self.until is not None:
            after = select(after > self.until, math.inf, after)
        goes_on = under_way(t, last)
        length = select(is_last | (after == math.inf), 0.0, length)
        return select(goes_on, after, t), select(goes_on, length, last)

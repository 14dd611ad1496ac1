"""Safe steps along a straight flight whose level is a polynomial of time of degree 4 at most.

The coefficients are known once for the whole flight. From the wall inwards the level has a root at 0, which is divided
out: what is left is a cubic, whose first root above 0 is the hit.
"""

import math
from typing import Any

from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from .course import Quartic, positive, rise_by, rise_time, under_way

# A step is the last that leaves no more of the level than this part of its terms: what rounding leaves of their sum.
_CLOSE = 0.5 * EPSILON


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
        step = select(time < reach, time, reach)
        left = step * step * (excess - step * (a3 + step * a4))
        higher = abs(self.a2) + s * (abs(self.a3) + s * abs(self.a4))
        terms = abs(self.c) + s * (2.0 * abs(self.b) + s * higher)
        is_last = (time <= reach) & (left <= _CLOSE * terms)
        after = t + step
        if self.until is not None:
            after = select(after > self.until, math.inf, after)
        goes_on = under_way(t, last)
        length = select(is_last | (after == math.inf), 0.0, step)
        return select(goes_on, after, t), select(goes_on, length, last)

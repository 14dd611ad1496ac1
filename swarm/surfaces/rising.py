"""Until when the level of a wall that moves surely stays below 0: safe steps of one wall.

In the frame of a wall the flight is a curve whose velocity w, acceleration a and jerk j have bounds W, A and J for any
time ahead. Along it the level f of a wall with the inner function q, whose H = grad grad q/2 has eigenvalues of at most
the magnitude m, has
    f' = grad q.w,   f''/2 = w.H w + grad q.a/2,   |f'''| <= 6 m W A + |grad q| J,
the last where H is constant. A step ends where the parabola above f rises through 0; near the hit each one triples the
digits, or doubles them where only f'' has a bound.
"""

import math
from typing import Any

from ..kernel.jit import select
from ..kernel.record import Record
from ..kernel.vector import absolute, dot, norm, times, total
from .course import rise_time
from .relative import Seen

# The bounds of a step hold for at most so many times its length, after so many trials.
_CLOSE, _TRIALS = 2.0, 8


class Step(Record):
    """The level, half its derivative, and a time during which the flight stays admissible."""

    level: float
    half: float
    time: float


class Ahead(Record):
    """A level along a flight, and what bounds it for some time ahead."""

    def rise(self, within):
        """When it rises through 0, with bounds that hold for so long."""
        raise NotImplementedError

    def longest(self, longest):
        """The longest time, of at most this one, in which the level surely does not rise."""
        time, within, too_long = 0.0, longest, longest
        for _k in range(_TRIALS):
            time = max(time, min(self.rise(within), within))
            # The bounds grow with the time that they hold for: those of a long time say little of a short step.
            too_long = select(time < within, within, too_long)
            if not _CLOSE * time < too_long:
                break
            within = math.sqrt(time * too_long)
        return time


class Bent(Ahead):
    """Of a level whose second derivative has a bound."""

    seen: Seen
    level: float
    half: float
    steepness: float
    most: float
    magnitude: float
    reach: float
    clear: float

    def rise(self, within):
        bounds = self.seen.bounds(within)
        speed = bounds.speed
        # f''/2 <= w.H w + |grad q| A/2, where grad q turns by 2 m W t at most
        bend = max(self.most, 0.0) * speed * speed
        bend += 0.5 * bounds.acceleration * (self.steepness + 2.0 * self.magnitude * speed * within)
        some = select(speed > 0.0, speed, 1.0)
        step = min(rise_time(self.level, self.half, bend), select(speed > 0.0, self.reach / some, math.inf))
        return max(step, self.clear / some)


class Known(Ahead):
    """Of a level whose third derivative has one."""

    body: Any
    seen: Seen
    level: Any  # `Level` or `Between`

    def third(self, within):
        """The bound of f''' within that time."""
        return self.level.third(self.body.bounds_along(self.seen, within), within)

    def rise(self, within):
        here = self.level
        return rise_time(here.c, here.b, here.a2 + self.third(within) * within * (1.0 / 6.0))


def level_step(body, seen, level, longest):
    """The `Step` of a level whose third derivative has a bound, whose time is at most the longest."""
    return Step(level.c, level.b, Known(body, seen, level).longest(min(level.own_rise(), longest)))


def bent_step(body, seen, longest):
    """The `Step` of a wall that bounds its bend."""
    n, level = body.inner_gradient(seen.r), body.level_of(body.inner(seen.r))
    half = 0.5 * body.side * dot(n, seen.v)
    most, magnitude, reach = body.hessian_bounds(seen.r)
    bent = Bent(seen, level, half, norm(n), most, magnitude, reach, body.clearance(seen.r))
    return Step(level, half, bent.longest(longest))


def bounds_along(n, seen, within):
    """`Bounds` of a flight that a flat wall with this normal sees: only the jerk along that counts.

    Where a motion has none of it, a particle that leaves the wall at no speed stays at it without end.
    """
    bounds, drive = seen.bounds(within), seen.drive
    if drive.turn is None:
        jerk = total(absolute(times(n, drive.jerks)))
    else:
        # Along its axis a rotation leaves a place as it is.
        axis = drive.turn.axis
        along = dot(n, axis)
        jerk = abs(along) * total(absolute(times(axis, drive.jerks))) + norm(n - along * axis) * bounds.jerk
    return bounds._replace(jerk=select(jerk < bounds.jerk, jerk, bounds.jerk))

"""The level along a flight as a polynomial of time, and when it first rises through 0.

A straight flight makes the level of a quadric a parabola; its root is a closed form. A fall makes it a quartic; its
first root is found by safe steps: none is skipped, however close to a double one. Steps have two methods, `first_step`
and `next_step`. Each moves a flight on from the time reached so far and returns a length, 0 at the root.
"""

import math
from typing import TYPE_CHECKING, Any

from ...kernel.gravity import rise_time as rise_time
from ...kernel.gravity import rise_time_by as rise_time_by
from ...kernel.gravity import rise_time_inside as rise_time_inside
from ...kernel.jit import select
from ...kernel.limits import TINY
from ...kernel.record import Record
from ...kernel.vector import cross, dot, square

# Safe steps of a falling flight that all lanes take, and how many more one may take in the same pass.
SAFE_STEPS = 5
MORE_STEPS = 16
# A safe step is the last where the parabola is above the level by at most this part of the rise of a crossing.
_CLOSE = 1e-16
# A fall at a solid from more than this many of its sizes away ends where it has come this many times nearer: the
# round-off of the level's coefficients is that of the distance, so they are computed anew from there. (To end every
# such fall on the way, even one that misses, made a fall in a sphere with a small ball 6 times slower.)
_FAR = 32.0
# Length of a last step that found no hit: too short to change a time.
_NO_HIT = TINY


class Majorant(Record):
    """A level from one time of a flight on: c + 2 b t + a2 t^2 + ..., with a rest of at most s t^3 up to a time."""

    if TYPE_CHECKING:
        c: Any
        b: Any
        a2: Any

    def rises(self, slope, within):
        """Return the soonest time when the level rises through 0, where the bound s (`slope`) holds up to `within`."""
        return rise_time(self.c, self.b, self.a2 + rise_by(slope, within))

    def leaves(self, slope):
        """When 2 b t + a2 t^2 + s t^3 rises through 0: from a wall inwards the level is one power of t nearer to it."""
        return rise_time(2.0 * self.b, 0.5 * self.a2, slope)

    def rises_after_leaving(self, slope, within):
        """Return the later time of `rises` and `leaves`, where the level does not rise at once."""
        time, leaving = self.rises(slope, within), self.leaves(slope)
        return select((self.b <= 0.0) & (leaving > time), leaving, time)


class Quartic(Majorant):
    """The level of a fall, c + 2 b t + a2 t^2 + a3 t^3 + a4 t^4, and the time in which it crosses the surface's size.

    The window is infinite where the level is a parabola; from afar see `level_and_window`.
    """

    c: float
    b: float
    a2: float
    a3: float
    a4: float
    window: float

    def steepest(self, within):
        """s >= 0 with a3 t^3 + a4 t^4 <= s t^3 up to this time."""
        return positive(self.a3 + select(self.a4 > 0.0, self.a4 * within, 0.0))

    def moved(self, t):
        """Return the level from a later time on: Horner's scheme, applied again to its quotients."""
        a4 = self.a4
        a3t = self.a3 + t * a4
        a2t = self.a2 + t * a3t
        twice_bt = 2.0 * self.b + t * a2t
        ct = self.c + t * twice_bt
        a3t = a3t + t * a4
        a2t = a2t + t * a3t
        bt = 0.5 * (twice_bt + t * a2t)
        a3t = a3t + t * a4
        a2t = a2t + t * a3t
        a3t = a3t + t * a4
        return Quartic(ct, bt, a2t, a3t, a4, self.window)

    def first_step(self):
        """Return the first step of a flight that does not rise at once: (t, the last length for `Fall.next_step`).

        Where c <= 0 and b <= 0 the level is below t (2 b + a2 t + s t^2), one power of t nearer to it than the parabola
        of a safe step: a flight from the wall has c = 0. This saves a fifth of the steps. A particle at rest under a
        ceiling needs it: the parabola of the whole window rises at once there.
        """
        window = abs(self.window)
        time = self.leaves(self.steepest(window))
        time = select(self.b <= 0.0, select(time < window, time, window), 0.0)
        return time, select(time < math.inf, math.inf, 0.0)


def ball_rise_time(side, radius2, d, v):
    """`rise_time` for |d + v t|^2 - R^2, also from afar."""
    c, b, a = square(d) - radius2, dot(d, v), square(v)
    # b^2 - a c = R^2 |v|^2 - |d x v|^2, Lagrange's identity; near the wall the first form is the better one.
    from_afar = radius2 * a - square(cross(d, v))
    return rise_time_by(side * c, side * b, side * a, select(c > radius2, from_afar, b * b - a * c))


def level_and_window(c, own, size, speed2, pull2):
    """Return (c, window) of a fall from its level, the level's sizes on the surface and here, square speed and pull.

    The window is a time in which the fall crosses the surface; from outside, the way there and the way across. From
    afar c is that of a level set around the surface and the window is negative: to rise through it is no hit.
    """
    far = abs(c) > _FAR * _FAR * own
    window = 2.0 * math.sqrt(size / (speed2 + math.sqrt(size * pull2)))
    return select(far, 1.0 - 1.0 / (_FAR * _FAR), 1.0) * c, select(far, -window, window)


def safe_rise_time(level):
    """Return a time up to |window| during which a level surely stays <= 0."""
    window = abs(level.window)
    time = level.rises(level.steepest(window), window)
    return select(level.c > 0.0, 0.0, select(time < window, time, window))


def rise_near(level):
    """Return (a time up to |window| while a level surely stays <= 0, whether it rises then), near its first rise.

    The parabola that holds for twice the time of the first one is less far above the level.
    """
    window = abs(level.window)
    first = level.rises(level.steepest(window), window)
    rises, leaving = first <= window, level.first_step()[0]
    time = select(rises, first, window)
    rises, time = rises & (leaving <= time), select(leaving > time, leaving, time)
    reach = 2.0 * time
    again = level.rises(level.steepest(reach), reach)
    within = select(again < reach, again, reach)
    later = within > time
    return select(later, within, time), select(later, again <= reach, rises) & (level.window > 0.0)


def positive(a):
    """max(a, 0)"""
    return select(a > 0.0, a, 0.0)


def rise_by(slope, window):
    """slope * window, 0 where the window is infinite because the level is a parabola."""
    return select(slope > 0.0, slope * window, 0.0)


def close(window):
    """Return the largest reach step^2 of a step that leaves nothing of the level."""
    window = abs(window)
    return _CLOSE * window * window * window


class Fall(Record):
    """The steps of a flight with a level that is known as a whole."""

    level: Quartic
    nearly: float  # the bound `close` of the window
    may_be_far: Any  # whether the level may be that of a flight from afar: a constant for the compiler

    most = SAFE_STEPS + MORE_STEPS

    def first_step(self):
        return self.level.first_step()

    def next_step(self, t, last):
        """Return one step towards the first rise of the level through 0: (t, its length).

        The step ends where a parabola that is nowhere below the level rises through 0, so no root is skipped, however
        close to a double one. The parabola holds for twice the last step: near a root it becomes the level's own Taylor
        polynomial, and a step leaves the cube of its length. A step that leaves nothing is the last: the length is 0
        from then on. With a negative window, from afar, it is next to 0: no hit, but a place to begin again from.
        """
        there, window = 0.0, self.level.window
        if self.may_be_far:
            there, window = select(window < 0.0, _NO_HIT, 0.0), abs(window)
        reach = select(2.0 * last < window, 2.0 * last, window)
        here = self.level.moved(t)
        time = here.rises(here.steepest(reach), reach)
        step = select(time < reach, time, reach)
        # A step that only ends at its reach is no hit, however short: a flight may pass the wall by 1e-12 of its size.
        at_root = time <= reach
        return t + step, select(at_root & (reach * step * step <= self.nearly), there, step)


def under_way(t, last):
    """Whether a flight has not met the wall yet, and may still meet it."""
    return (t < math.inf) & (last > 0.0)


def first_rise(steps):
    """Return (the time that the steps of a flight lead to, whether that is final: the hit, or infinite)."""
    t, last = steps.first_step()
    for _step in range(steps.most):
        if not under_way(t, last):
            break
        t, last = steps.next_step(t, last)
    return t, not under_way(t, last)

"""Safe steps along a straight flight with a level that is a polynomial of time of degree 4 at most.

The coefficients are known once for the whole flight. From the wall inwards the level has a root at 0, which is divided
out. The rest is a cubic; its first root above 0 is the hit. Steps of Halley's method lead to it from a guess, and
Bernstein coefficients prove that it is the first. Where they do not, safe steps are taken. The last safe step ends
where two steps of Newton's method leave round-off: one by the same coefficients, and one by the level at the place of
impact, which also follows Halley's method.
"""

import math
from typing import Any

from ...kernel.jit import select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from .course import Quartic, positive, rise_by, rise_time, under_way

# Steps that all lanes take to a solid.
POLYNOMIAL_STEPS = 4
# Replaces 0 below a fraction: no power of its inverse that is needed overflows.
_TINY = 1e-30
# Two steps of Newton's method leave round-off if the slope changes by no more than this part on the way to the root.
_CONVERGES = 1e-5
# A guess of the root takes this number of times two steps of Halley's method; the second of the two may change the
# slope and the time by these parts: their product, squared, is left, and the square of that is round-off.
AIMED, _HALLEY_CONVERGES, _HALLEY_WAY = 3, 1e-3, 1e-2
# Along a fall a step leads at most this many times the time ahead, and back to no less than this part of it.
_AHEAD, _BACK = 2.0, 0.25
# The root of e x^3 + m x^2 + (1 - 2 m) x = 1 - m is (1 + p e + q e^2)/(1 + (1 + p) e + s e^2), for m of 0 or 1/2 to 9 %
# up to e = 100.
_P, _Q, _S = 0.8, 0.01, 0.08


def _turn(c, b, a2, a3):
    """Return the turning point of a cubic c + b t + a2 t^2 + a3 t^3 next to its first root > 0, or its inflection."""
    discriminant = a2 * a2 - 3.0 * a3 * b
    turns, root = discriminant > 0.0, math.sqrt(abs(discriminant))
    # The times of its maximum and minimum, without cancellation. A division takes as long as ten sums.
    third, bottom = select(a3 == 0.0, _TINY, 3.0 * a3), a2 + select(a2 < 0.0, -root, root)
    both = 1.0 / (third * select(bottom == 0.0, _TINY, bottom))
    over = both * bottom
    far, near = -bottom * over, -b * (both * third)
    top, low = select(a2 < 0.0, near, far), select(a2 < 0.0, far, near)
    falls = (top > 0.0) & (c + top * (b + top * (a2 + top * a3)) > 0.0)
    return select(turns, select(falls, top, low), -a2 * over)


def _guess(c, b, a2, a3, turn):
    """Return about the first root above 0 of a cubic with c < 0; any number if it has none."""
    value = c + turn * (b + turn * (a2 + turn * a3))
    # The parabola from the turning point on, or from there back, or from the start on
    from_there = (turn > 0.0) & ((value < 0.0) | (b * b < 4.0 * a2 * c) | (a2 * a2 > 3.0 * a3 * b))
    back = from_there & (value >= 0.0)
    sign, t = select(back, -1.0, 1.0), select(from_there, turn, 0.0)
    value = sign * select(from_there, value, c)
    slope = b + t * (2.0 * a2 + 3.0 * t * a3)
    half = sign * (a2 + 3.0 * t * a3)
    rise = math.sqrt(positive(slope * slope - 4.0 * half * value))
    # The root of the parabola over/under, and its change by the cubic term, e = more/less
    over, under = -2.0 * value, slope + rise
    more, less = a3 * over * over, rise * under * under
    over = over * (less * less + more * (_P * less + _Q * more))
    under = under * (less * less + more * ((1.0 + _P) * less + _S * more))
    return t + sign * (over / select(under == 0.0, _TINY, under))


def bernstein(powers, t):
    """The Bernstein coefficients of a level from 0 to t: b_j = sum C(j, k) a_k t^k/C(n, k), by Pascal's triangle."""
    n, power = len(powers) - 1, 1.0
    row: Any = ()
    for k, a in enumerate(powers):
        row = (*row, power * a * (1.0 / math.comb(n, k)))
        power = power * t
    for k in range(n):
        row = (*row[: k + 1], *(one + other for one, other in zip(row[k:-1], row[k + 1 :], strict=True)))
    return row


def _are_below(coefficients):
    """Whether a level with these Bernstein coefficients is surely below 0; without the last, except at the end."""
    below = True
    for one in coefficients:
        below = below & (one < 0.0)
    return below


def _are_below_in_halves(coefficients):
    """Whether the level is below 0 except at the end, by de Casteljau's coefficients of each half, times 2, 4, ..."""
    below, row = coefficients[0] < 0.0, coefficients
    for _one in coefficients[1:]:
        row = tuple(one + other for one, other in zip(row[1:], row[:-1], strict=True))
        below = below & (row[0] < 0.0) & (row[-1] < 0.0)
    return below


class _HalleyStep(Record):
    """The level where a step of Halley's method begins, and how far back the step leads."""

    value: float
    slope: float
    bend: float  # a bound of half the second derivative
    way: float


def _halley_step(value, slope, half, bend):
    bottom = slope * slope - value * half
    return _HalleyStep(value, slope, bend, value * slope / select(bottom == 0.0, _TINY, bottom))


class Guessed(Record):
    """A level that is a polynomial of time; a guess of its first root above 0 is improved and proven."""

    def turn(self):
        """Return the time from which to guess the first root."""
        c, b, a2, a3 = self._cubic()
        return _turn(c, b, a2, a3)

    def aim(self, turn):
        """Return a guess of the first root."""
        c, b, a2, a3 = self._cubic()
        return _guess(c, b, a2, a3, turn)

    def _cubic(self):
        """Return a cubic that equals the level on the wall, and about equals it up to the window."""
        raise NotImplementedError

    def aims(self, length):
        """Return (the first root or a guess of it, the given length or 0 if it is the root)."""
        time = self.aim(self.turn())
        for k in range(AIMED):
            time, length = self.aimed(self.nearer(time), length, k == AIMED - 1)
        return time, length

    def nearer(self, t):
        """Return a time nearer to the root, by a step of Halley's method."""
        return t - self._halley(t).way

    def aimed(self, t, length, is_last):
        """(a time nearer to the root, the length or 0 if one step of Newton's method leads from it to the root)."""
        step = self._halley(t)
        root = t - step.way
        converges = (step.slope > 0.0) & (abs(step.value) * step.bend <= _HALLEY_CONVERGES * (step.slope * step.slope))
        converges = converges & (abs(step.way) <= _HALLEY_WAY * root)
        found = converges & self._is_below(root, is_last)
        goes_on = length > 0.0
        return select(goes_on, root, t), select(goes_on & found, 0.0, length)

    def _halley(self, t):
        """Return a step of Halley's method from a time."""
        raise NotImplementedError

    def _is_below(self, root, is_last):
        """Whether the level is surely below 0 until a root; with `is_last` also by the halves of the way."""
        raise NotImplementedError


class PolynomialFlight(Guessed):
    """The steps of a flight to the time when c + 2 b t + a2 t^2 + a3 t^3 + a4 t^4 rises through 0.

    For a solid the polynomial begins at the time `since`, and a rise after `until` does not count; for a cavity both
    are None. The first step is at most of the length `window`.
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
        if self.since is not None:
            return select(self.since <= self.until, self.since, math.inf), 0.5 * self.window
        time, length = self.aims(0.5 * self.window)
        return select(length > 0.0, 0.0, time), length

    def _cubic(self):
        # Above the level where it is not on the wall
        return self.c, 2.0 * self.b, self.a2, self.a3 + self.a4 * self.window

    def _halley(self, t):
        c, b, a2, a3t, a4t = self.c, 2.0 * self.b, self.a2, t * self.a3, t * t * self.a4
        value = c + t * (b + t * (a2 + a3t + a4t))
        slope = b + t * (2.0 * a2 + 3.0 * a3t + 4.0 * a4t)
        half, bend = a2 + 3.0 * a3t + 6.0 * a4t, abs(a2) + 3.0 * abs(a3t) + 6.0 * abs(a4t)
        return _halley_step(value, slope, half, bend)

    def _is_below(self, root, is_last):
        before = self._before(root)
        # A level that is below 0 by its coefficients is so by those of its halves.
        return _are_below(before) | (is_last & _are_below_in_halves((*before, 0.0)))

    def is_free(self, until):
        """Whether the level is surely below 0 until this time."""
        last = self.c + until * (2.0 * self.b + until * (self.a2 + until * (self.a3 + until * self.a4)))
        return _are_below(self._before(until)) & (last < 0.0)

    def _before(self, t):
        """Return its Bernstein coefficients from 0 to t but the last; until then it is nowhere above the largest."""
        c, q1, q2, q3 = self.c, 2.0 * t * self.b, t * t * self.a2, t * t * t * self.a3
        return c, c + 0.25 * q1, c + 0.5 * q1 + (1.0 / 6.0) * q2, c + 0.75 * q1 + 0.5 * q2 + 0.25 * q3

    def next_step(self, t, last):
        """Return one step towards the first root, as in `course.Fall`: (t, its length or 0 if it is the last)."""
        s = t if self.since is None else t - self.since
        c, b, a2, a3, a4, _window = Quartic(self.c, self.b, self.a2, self.a3, self.a4, 0.0).moved(s)
        # Where neither of the higher terms rises, the parabola is above the level for ever.
        reach = select((a3 > 0.0) | (a4 > 0.0), 2.0 * last, math.inf)
        excess = rise_by(positive(a3 + positive(a4) * reach), reach)
        time = rise_time(c, b, a2 + excess)
        at_root, step = time <= reach, select(time < reach, time, reach)
        # The level there is -left: one step of Newton's method continues from it.
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


class ConvexFlight(PolynomialFlight):
    """A flight along which the level bends upwards all the way, so that its cubic has one inflection at most.

    Only the guess relies on that, so it need not be certain.
    """

    def turn(self):
        _c, _b, a2, a3 = self._cubic()
        # A parabola bends one way only: it is the parabola of the guess from the start on.
        return select(a3 == 0.0, 0.0, -a2 / select(a3 == 0.0, 1.0, 3.0 * a3))


class PolynomialFall(Guessed):
    """A level of any degree along a fall: its coefficients from t^0 on, and a time in which it crosses the surface."""

    powers: Any
    window: float

    def aim(self, turn):
        # The cubic may have no root, or one far beyond.
        time, longest = Guessed.aim(self, turn), 2.0 * self.window
        return select((time > 0.0) & (time < longest), time, longest)

    def _cubic(self):
        # The level there, with the terms from t^3 on taken half the way across
        c, b, a2 = self.powers[:3]
        a3 = 0.0
        for a in reversed(self.powers[3:]):
            a3 = a + self.window * a3
        return c, b, a2, a3

    def _halley(self, t):
        value, slope, half, bend = self.powers[-1], 0.0, 0.0, 0.0
        for a in reversed(self.powers[:-1]):
            half = slope + t * half
            slope = value + t * slope
            value = a + t * value
        for k in range(len(self.powers) - 1, 1, -1):
            bend = 0.5 * k * (k - 1) * abs(self.powers[k]) + t * bend
        step = _halley_step(value, slope, half, bend)
        # Where a level falls slowly, or not at all, a step leads far away.
        longest, shortest = (1.0 - _BACK) * t, (1.0 - _AHEAD) * t
        way = select(step.way < longest, select(step.way > shortest, step.way, shortest), longest)
        return step._replace(way=way)

    def is_free(self, until):
        """Whether the level is surely below 0 until this time."""
        return _are_below(bernstein(self.powers, until))

    def _is_below(self, root, is_last):
        before = bernstein(self.powers, root)[:-1]
        return _are_below(before) | (is_last & _are_below_in_halves((*before, 0.0)))

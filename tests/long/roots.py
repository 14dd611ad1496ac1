"""Levels along flights as polynomials of time: with 32 digits for many flights at once, and exactly for one.

A level is built by the surface's own formula, whose numbers are the doubles that the kernels take. The same code runs
with arrays of double-double numbers, with fractions, and with the sizes of its terms.
"""

import itertools
import math
from fractions import Fraction

import numpy as np
from numba import njit
from numba.extending import register_jitable

# A pair of doubles is split by Dekker's constant.
_SPLIT = 134217729.0
# Bisections of a bracket down to neighbouring doubles, also where the root is much closer to 0 than to 1.
_HALVINGS = 400
_SMALLEST = 1e-40
# Round-off of a sum of nine terms, with room.
_SURE = 1e-14
# Stops of one flight at most: roots and turning points of five polynomials of degree 8.
_STOPS = 96


# --- Numbers ---------------------------------------------------------------------------------------------


@register_jitable
def _two_sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@register_jitable
def _two_product(a, b):
    p = a * b
    c = _SPLIT * a
    ah = c - (c - a)
    al = a - ah
    c = _SPLIT * b
    bh = c - (c - b)
    bl = b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@register_jitable
def _add(ah, al, bh, bl):
    s, e = _two_sum(ah, bh)
    t, f = _two_sum(al, bl)
    s, e = _two_sum(s, e + t)
    return _two_sum(s, e + f)


@register_jitable
def _multiply(ah, al, bh, bl):
    p, e = _two_product(ah, bh)
    return _two_sum(p, e + (ah * bl + al * bh))


class Double:
    """Arrays of double-double numbers: unevaluated sums of two doubles, 32 digits."""

    __array_ufunc__ = None

    def __init__(self, high, low=0.0):
        self.high, self.low = np.asarray(high, dtype=np.float64), np.asarray(low, dtype=np.float64)

    @classmethod
    def of(cls, number):
        """A number, a fraction, or itself."""
        if isinstance(number, Double):
            return number
        if isinstance(number, Fraction):
            return cls(float(number), float(number - Fraction(float(number))))
        return cls(number)

    def __add__(self, other):
        other = self.of(other)
        return Double(*_add(self.high, self.low, other.high, other.low))

    def __mul__(self, other):
        other = self.of(other)
        return Double(*_multiply(self.high, self.low, other.high, other.low))

    def __neg__(self):
        return Double(-self.high, -self.low)


class Course:
    """A polynomial of time."""

    __array_ufunc__ = None
    number = staticmethod(Double.of)

    def __init__(self, parts):
        self.parts = parts

    def _of(self, other):
        return other.parts if isinstance(other, Course) else [self.number(other)]

    def __add__(self, other):
        one, other = self.parts, self._of(other)
        longer, shorter = (one, other) if len(one) >= len(other) else (other, one)
        return type(self)([a + b for a, b in zip(longer, shorter, strict=False)] + list(longer[len(shorter) :]))

    def __mul__(self, other):
        one, other = self.parts, self._of(other)
        sums = [None] * (len(one) + len(other) - 1)
        for i, a in enumerate(one):
            for k, b in enumerate(other):
                sums[i + k] = a * b if sums[i + k] is None else sums[i + k] + a * b
        return type(self)(sums)

    def __neg__(self):
        return type(self)([-part for part in self.parts])

    def __sub__(self, other):
        return self + (-other)

    def __rsub__(self, other):
        return -self + other

    __radd__, __rmul__ = __add__, __mul__


class Exact(Course):
    """With fractions: one flight."""

    number = staticmethod(Fraction)


class Terms(Course):
    """The sizes of the terms: nothing cancels."""

    number = staticmethod(lambda number: abs(float(number)) if isinstance(number, Fraction) else np.abs(number))

    def __neg__(self):
        return self


# --- Roots, with 32 digits -------------------------------------------------------------------------------


@njit(cache=True)
def _value(high, low, order, t):
    """The derivative of this order, over its factorial."""
    n = high.size - 1
    vh, vl = 0.0, 0.0
    for j in range(n, order - 1, -1):
        # C(j, order)
        factor = 1.0
        for i in range(order):
            factor = factor * (j - i) / (i + 1)
        vh, vl = _multiply(vh, vl, t, 0.0)
        ah, al = _multiply(high[j], low[j], factor, 0.0)
        vh, vl = _add(vh, vl, ah, al)
    return vh + vl


@njit(cache=True)
def _rises(high, low, order, t):
    """Whether that derivative is above 0: by plain doubles where they are sure of it."""
    value, size = 0.0, 0.0
    for j in range(high.size - 1, order - 1, -1):
        factor = 1.0
        for i in range(order):
            factor = factor * (j - i) / (i + 1)
        value = value * t + factor * high[j]
        size = size * t + factor * abs(high[j])
    if abs(value) > _SURE * size:
        return value > 0.0
    return _value(high, low, order, t) > 0.0


@njit(cache=True)
def _stops(high, low, end, stops, count):
    """Turning points and roots in (0, end) into stops[count:]; how many there are then."""
    degree = high.size - 1
    while degree > 0 and high[degree] == 0.0:
        degree -= 1
    found, former = np.empty(10), np.empty(10)
    size = 0
    for order in range(degree - 1, -1, -1):
        former[:size] = found[:size]
        brackets, size = size, 0
        a = 0.0
        fa = _rises(high, low, order, a)
        for k in range(brackets + 1):
            b = former[k] if k < brackets else end
            fb = _rises(high, low, order, b)
            if fa != fb:
                x, y = a, b
                for _i in range(_HALVINGS):
                    m = 0.5 * (x + y)
                    if not x < m < y or y - x < _SMALLEST:
                        break
                    if _rises(high, low, order, m) == fa:
                        x = m
                    else:
                        y = m
                found[size] = y
                size += 1
            a, fa = b, fb
        if order <= 1:
            for k in range(size):
                stops[count] = found[k]
                count += 1
    return count


@njit(cache=True)
def _horizon(high, low):
    """A time after which no polynomial has a root (Cauchy), as far as times go."""
    far = 1.0
    for k in range(high.shape[0]):
        degree = high.shape[1] - 1
        while degree > 0 and high[k, degree] == 0.0:
            degree -= 1
        for j in range(degree):
            far = max(far, 1.0 + abs(high[k, j] / high[k, degree]))
    return min(far, 1e20)


@register_jitable
def rows_of(kind, values):
    """The levels that decide, each above 0 outside of the admissible part, from those of the polynomials."""
    if kind == 0:
        # A cavity: outside of any wall
        return values
    if kind == 1:
        # A solid: inside of all parts
        values[0] = values.min()
    else:
        # A capsule: the tube, and the spheres above and below its ends
        values[0] = values[1] if values[3] > 0.0 else values[2] if values[4] > 0.0 else values[0]
    return values[:1]


@njit(cache=True)
def _level(kind, high, low, terms, t, values):
    """The levels that decide, relative to the size of their terms."""
    for k in range(high.shape[0]):
        size = 0.0
        for j in range(terms.shape[1] - 1, -1, -1):
            size = size * t + terms[k, j]
        values[k] = _value(high[k], low[k], 0, t) / size
    return rows_of(kind, values)


@njit(cache=True)
def course_of(kind, high, low, terms, time, stops, levels, middles):
    """The stops of one flight, and the levels (rows, stops) there and half way to the next; how many of both."""
    values = np.zeros(5)[: high.shape[0]]
    end = 1.0000001 * time + 1e-7 if time < math.inf else _horizon(high, low)
    stops[0], stops[1], count = 0.0, end, 2
    if time < math.inf:
        stops[2], count = time, 3
    for k in range(high.shape[0]):
        count = _stops(high[k], low[k], end, stops, count)
    stops[:count].sort()
    rows = high.shape[0] if kind == 0 else 1
    for i in range(count):
        levels[:rows, i] = _level(kind, high, low, terms, stops[i], values)
    for i in range(count - 1):
        middles[:rows, i] = _level(kind, high, low, terms, 0.5 * (stops[i] + stops[i + 1]), values)
    return rows, count


# --- Judgement -------------------------------------------------------------------------------------------

EXACT, TOUCHED, MISSED, EARLY = range(4)


@njit(cache=True)
def _exits(stops, levels, middles, time, close):
    """How far the time is from the nearest exit, and the highest level before it after an exit that is not `close`."""
    error, deepest, outside, leaving = math.inf, 0.0, False, 0.0
    for i in range(stops.size):
        if i + 1 == stops.size or middles[i] <= 0.0:
            outside = False
            continue
        if not outside:
            leaving, outside = stops[i], True
            if time < math.inf:
                error = min(error, abs(time - leaving))
        if leaving < time - close and stops[i] <= time:
            # Between two stops the level of each polynomial is monotone, and the time itself is a stop.
            deepest = max(deepest, levels[i])
            if stops[i + 1] <= time:
                deepest = max(deepest, middles[i], levels[i + 1])
    return error, deepest


@njit(cache=True)
def judge(stops, levels, middles, time, found, near, touch):
    """(verdict, error of the time, residual) of a time at which a flight is said to leave, or be free until then.

    EXACT: the flight leaves at that time, to `near` of it or of the unit, and has not left before. TOUCHED: it is on
    the wall at that time to `touch` of the terms of the level, but leaves elsewhere or not. MISSED: it was outside by
    more than `touch` before. EARLY: it is still inside, by more than that.
    """
    close = near * max(time, 1.0) if found and time < math.inf else 0.0
    error, deepest, here = math.inf, 0.0, -math.inf
    for row in range(levels.shape[0]):
        row_error, row_deepest = _exits(stops, levels[row], middles[row], time, close)
        error, deepest = min(error, row_error), max(deepest, row_deepest)
        for i in range(stops.size):
            if stops[i] == time:
                here = max(here, levels[row, i])
    if not time >= 0.0 or deepest > touch:
        return MISSED, 0.0, deepest
    if not found or not time < math.inf:
        return EXACT, 0.0, deepest
    if error <= close:
        return EXACT, error / max(time, 1.0), deepest
    verdict = TOUCHED if abs(here) <= touch else EARLY if here < 0.0 else MISSED
    return verdict, error / max(time, 1.0), max(deepest, abs(here))


@njit(cache=True, nogil=True)
def judge_all(kind, high, low, terms, times, found, near, touch, verdicts, errors, residuals):
    """`judge` for every flight."""
    stops, levels, middles = np.empty(_STOPS), np.empty((5, _STOPS)), np.empty((5, _STOPS))
    for i in range(times.size):
        rows, n = course_of(kind, high[i], low[i], terms[i], times[i], stops, levels, middles)
        verdicts[i], errors[i], residuals[i] = judge(
            stops[:n], levels[:rows, :n], middles[:rows, :n], times[i], found[i], near, touch
        )


# --- Roots, exactly --------------------------------------------------------------------------------------


def exact_roots(parts, end):
    """Roots in (0, end) of a polynomial of fractions: its sign changes, to 1e-20 of the end or better.

    By Bernstein's form on [0, end], in whole numbers: no change of sign among its coefficients is no root, one is one
    root; halved until it is one of these.
    """
    degree = len(parts) - 1
    scaled = [part * end**k for k, part in enumerate(parts)]
    common = math.lcm(*(part.denominator for part in scaled))
    whole = [int(part * common) for part in scaled]
    binomials = [math.comb(degree, k) for k in range(degree + 1)]
    common = math.lcm(*binomials)
    bernstein = [
        sum(math.comb(k, j) * (common // binomials[j]) * whole[j] for j in range(k + 1)) for k in range(degree + 1)
    ]
    found, open_ = [], [(bernstein, 0, 0)]
    while open_:
        form, index, depth = open_.pop()
        signs = [part > 0 for part in form if part]
        changes = sum(a != b for a, b in itertools.pairwise(signs))
        if changes == 0:
            continue
        if depth >= 110 or (changes == 1 and depth >= 70 and index > 1 << (depth - 40)):
            found.append(end * Fraction(2 * index + 1, 1 << (depth + 1)))
            continue
        # De Casteljau at the middle, times 2^degree
        left, right, row = [], [], form
        for k in range(degree + 1):
            left.append(row[0] << (degree - k))
            right.append(row[-1] << (degree - k))
            row = [a + b for a, b in itertools.pairwise(row)]
        open_ += [(right[::-1], 2 * index + 1, depth + 1), (left, 2 * index, depth + 1)]
    return found


def exact_course(kind, polynomials, terms, time):
    """`course_of` in exact arithmetic, rounded at the end."""
    end = Fraction(time) * Fraction(10000001, 10000000) + Fraction(1, 10**7)
    stops = {Fraction(0), end, Fraction(time)}
    for parts in polynomials:
        stops.update(exact_roots(parts, end))
        stops.update(exact_roots([k * part for k, part in enumerate(parts)][1:] or [Fraction(0)], end))
    stops = sorted(stops)

    def level(t):
        values = []
        for parts, sizes in zip(polynomials, terms, strict=True):
            total = Fraction(0)
            for part in parts[::-1]:
                total = total * t + part
            values.append(float(total) / float(np.polynomial.polynomial.polyval(float(t), sizes)))
        return rows_of(kind, np.array(values))

    levels = [level(stop) for stop in stops]
    middles = [level((a + b) / 2) for a, b in itertools.pairwise(stops)] + [levels[-1]]
    return np.array([float(stop) for stop in stops]), np.array(levels).T.copy(), np.array(middles).T.copy()

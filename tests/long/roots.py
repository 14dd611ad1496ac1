"""Levels along many flights at once: polynomials with 32 digits, and their roots. See tests/exact.py for one flight."""

import math
from fractions import Fraction

import numpy as np
from exact import Course, judge, rows_of
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


class Courses(Course):
    """Polynomials of time of many flights."""

    number = staticmethod(Double.of)


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


@njit(cache=True, nogil=True)
def judge_all(kind, high, low, terms, times, found, near, touch, verdicts, errors, residuals):
    """`judge` for every flight."""
    stops, levels, middles = np.empty(_STOPS), np.empty((5, _STOPS)), np.empty((5, _STOPS))
    for i in range(times.size):
        rows, n = course_of(kind, high[i], low[i], terms[i], times[i], stops, levels, middles)
        verdicts[i], errors[i], residuals[i] = judge(
            stops[:n], levels[:rows, :n], middles[:rows, :n], times[i], found[i], near, touch
        )

"""First hits in exact arithmetic: the level along a flight as polynomials of time, its roots, a verdict on an answer.

A level is built by the surface's own formula from the doubles that the kernels take. The same code runs with fractions
and with the magnitudes of its terms, and in tests/long/roots.py with many flights at once.
"""

import functools
import itertools
import math
import operator
from fractions import Fraction

import numpy as np
from numba.extending import register_jitable

from swarm.kernel.vector import vec
from swarm.surfaces.rotation import Rotated
from swarm.surfaces.shapes.capsule import CapsuleNumbers
from swarm.surfaces.shapes.solid import SolidNumbers
from swarm.surfaces.shapes.torus import TorusNumbers

# Tolerances: of a time, relative to itself or to the unit of time; of a level, relative to the magnitude of its terms.
NEAR, TOUCH = 1e-12, 1e-14


# --- Polynomials of time ---------------------------------------------------------------------------------


class Course:
    """A polynomial of time, by its coefficients: fractions here."""

    __array_ufunc__ = None
    number = staticmethod(Fraction)

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

    def __truediv__(self, number):
        return self * (1 / Fraction(number))

    def __pow__(self, exponent):
        return functools.reduce(operator.mul, [self] * exponent)

    __radd__, __rmul__ = __add__, __mul__


class Terms(Course):
    """The magnitudes of its terms: nothing cancels."""

    number = staticmethod(lambda number: abs(float(number)) if isinstance(number, Fraction) else np.abs(number))

    def __neg__(self):
        return self


# --- The level along a flight ----------------------------------------------------------------------------


def levels(walls, kind, position, velocity, half_pull=None):
    """How the polynomials of a surface's walls make its level (see `rows_of`), and these, as courses of `kind`."""
    rows = [position, velocity] if half_pull is None else [position, velocity, half_pull]
    path = vec(kind([kind.number(row[i]) for row in rows]) for i in range(3))
    wall = walls[0]
    body = wall.body if isinstance(wall, Rotated) else wall
    if isinstance(body, SolidNumbers):
        return 1, [part.level_of(part.inner(path)) for part in body.parts]
    if isinstance(body, (TorusNumbers, CapsuleNumbers)):
        path = wall.vector_in(path) if isinstance(wall, Rotated) else path
        return (_torus if isinstance(body, TorusNumbers) else _capsule)(body, *(path - body.center))
    return 0, [wall.level_of(wall.inner(path)) for wall in walls]


def _torus(body, x, y, z):
    # (|r|^2 + R^2 - a^2)^2 - 4 R^2 rho^2
    major, minor = Fraction(body.major), Fraction(body.radius)
    both = x * x + y * y + z * z + (major**2 - minor**2)
    return 0, [body.side * (both * both - 4 * major**2 * (x * x + y * y))]


def _capsule(body, x, y, z):
    up, down = z - body.half, z + body.half
    across = x * x + y * y - Fraction(body.radius) ** 2
    return 2, [body.side * across, body.side * (across + up * up), body.side * (across + down * down), up, -down]


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


def end_of(polynomials, time):
    """A little after the time; if that is infinite, a time after which no polynomial has a root (Cauchy), to 1e20."""
    if time < math.inf:
        return Fraction(time) * Fraction(10000001, 10000000) + Fraction(1, 10**7)
    far = [1 + max(map(abs, parts[:-1])) / abs(parts[-1]) for parts in map(_trimmed, polynomials) if len(parts) > 1]
    return min(max(far, default=Fraction(1)), Fraction(10**20))


def _trimmed(parts):
    """Without leading coefficients that are 0."""
    return parts[: max((k + 1 for k, part in enumerate(parts) if part), default=1)]


def exact_course(kind, polynomials, terms, time):
    """The stops of a flight, and the levels (rows, stops) there and half way to the next: exact, rounded at the end.

    Stops are 0, the time, a little later, roots and turning points. Levels are relative to their terms' magnitude.
    """
    stops = {Fraction(0), end_of(polynomials, time)}
    if time < math.inf:
        stops.add(Fraction(time))
    end = max(stops)
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


# --- Judgement -------------------------------------------------------------------------------------------

EXACT, TOUCHED, MISSED, EARLY, ENTERING = range(5)


@register_jitable
def nearest_exit(stops, levels, middles, time, close):
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


@register_jitable
def judge(stops, levels, middles, time, found, near, touch):
    """(verdict, error of the time, residual) of an answer: a hit at that time, or free flight until then.

    EXACT: the flight leaves at that time, to `near` of it or of the unit, and has not left before. TOUCHED: it is on
    the wall at that time to `touch` of the terms of the level, but leaves elsewhere or not. MISSED: it was outside by
    more than `touch` before. EARLY: it is still inside, by more than that.
    """
    close = near * max(time, 1.0) if found and time < math.inf else 0.0
    error, deepest, here = math.inf, 0.0, -math.inf
    for row in range(levels.shape[0]):
        row_error, row_deepest = nearest_exit(stops, levels[row], middles[row], time, close)
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


# --- One flight ------------------------------------------------------------------------------------------


# A unit of time [s] longer than every flight in the tests, whose powers are still numbers.
_LONGEST = 2.0**100


class Flight:
    """The exact level of a surface's walls along one flight. Times are in seconds."""

    def __init__(self, walls, position, velocity, pull=(0.0, 0.0, 0.0)):
        rows = [[Fraction(float(part)) for part in row] for row in (position, velocity, pull)]
        rows[2] = [part / 2 for part in rows[2]]
        rows = rows if any(rows[2]) else rows[:2]
        self.kind, polynomials = levels(walls, Course, *rows)
        terms = levels(walls, Terms, *([abs(float(part)) for part in row] for row in rows))[1]
        # The time in which the flight changes the terms by as much as they are
        times = [
            (float(one.parts[0]) / float(part)) ** (1.0 / k)
            for one in terms
            for k, part in enumerate(one.parts)
            if k and part > 0.0 and one.parts[0] > 0.0
        ]
        self.unit = 2.0 ** round(math.log2(min(*times, _LONGEST) if times else 1.0))
        self.polynomials = [
            [part * Fraction(self.unit) ** k for k, part in enumerate(one.parts)] for one in polynomials
        ]
        self.terms = [[part * self.unit**k for k, part in enumerate(one.parts)] for one in terms]

    def course(self, time):
        """`exact_course` to this time, in the flight's own unit of time."""
        return exact_course(self.kind, self.polynomials, self.terms, float(time) / self.unit)

    def highest(self, time):
        """The largest level until then, relative to the magnitude of its terms."""
        stops, levels, _middles = self.course(time)
        return levels[:, stops <= float(time) / self.unit].max()

    def exits(self, time=math.inf):
        """The times at which it leaves."""
        stops, _levels, middles = self.course(time)
        outside = np.concatenate([[False], (middles > 0.0).any(axis=0)[:-1]])
        return [float(stop) * self.unit for k, stop in enumerate(stops[:-1]) if outside[k + 1] and not outside[k]]

    def judge(self, time, found, near=NEAR, touch=TOUCH):
        """The verdict of `judge`, or ENTERING for a hit on the wall where the flight comes in."""
        verdict = judge(*self.course(time), float(time) / self.unit, found, near, touch)[0]
        return ENTERING if verdict == TOUCHED and self._comes_in(float(time) / self.unit, touch) else verdict

    def _comes_in(self, time, touch):
        """Whether the levels that are 0 at that time fall, by more than at a double root that is missed by `touch`."""
        levels, terms = (
            [np.polynomial.Polynomial([float(part) for part in parts]) for parts in rows]
            for rows in (self.polynomials, self.terms)
        )
        if self.kind == 2:
            levels = levels[1:2] if levels[3](time) > 0.0 else levels[2:3] if levels[4](time) > 0.0 else levels[:1]
        for level, size in zip(levels, terms, strict=False):
            bend = max(abs(level.deriv(2)(0.0)), abs(level.deriv(2)(time)))
            graze = 4.0 * math.sqrt(bend * touch * size(time)) + touch * size.deriv()(time)
            if abs(level(time)) <= 2.0 * touch * size(time) and level.deriv()(time) >= -graze:
                return False
        return True

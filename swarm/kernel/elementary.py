"""Elementary functions from sums, products and one quotient: calls of a library would end a lane loop.

The errors of exponentials and logarithms are below 2 ulp, also of powers up to 8. In Python the functions also take
arrays, for which they call NumPy.
"""

import math
from typing import Any

import numpy as np

from .jit import allocating, select

# Adding and subtracting it rounds to the nearest whole number.
_WHOLE = 1.5 * 2.0**52
# pi in three parts, of which the first two leave room for a whole number of 25 bits: up to 1e8 rad their product with
# it is exact. Beyond, the error is that of rounding the angle.
_PI = (3.141592651605606, 1.9841871479187034e-09, 1.1442377452219664e-17)
_INVERSE_PI = 0.3183098861837907
# The minimax polynomials of fdlibm on |y| <= pi/4: (sin y - y)/y^3 and (cos y - 1 + y^2/2)/y^4 in powers of y^2
_SINE = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)  # fmt: skip
_COSINE = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
)  # fmt: skip
_INVERSE_LN2 = 1.4426950408889634
# ln 2 in two parts: the first has 32 bits, so that its product with an exponent is exact.
_LN2_HIGH, _LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
# Between these the power of 2 in e^a is a normal number; beyond them e^a counts as 0 or as infinite.
_LEAST, _MOST = -708.0, 709.0
# 1 - y coth(y/2)/2 and similar in powers of y^2: the minimax polynomial of fdlibm on |y| <= ln(2)/2
_EXPONENTIAL = (
    4.13813679705723846039e-08, -1.65339022054652515390e-06, 6.61375632143793436117e-05,
    -2.77777777770155933842e-03, 1.66666666666666019037e-01,
)  # fmt: skip
# 2/3, 2/5, ...: the terms of 2 artanh(s) after the first, in reverse order.
_ARTANH = tuple(2.0 / n for n in range(21, 1, -2))
_HALF_ROOT = 0.7071067811865476  # sqrt(1/2)
_POWERS = tuple(1 << k for k in range(9, -1, -1))
# 2^27 + 1, which splits a number of 53 bits into halves.
_SPLITS = 134217729.0
# Beyond it tanh is 1 to round-off.
_FLAT = 40.0


def sine_and_versine(angle):
    """Return (sin a, 1 - cos a), the second without cancellation."""
    return sine_and_versine_of(*reduced(angle))


def sine_and_versine_of(y, odd):
    """Return (sin a, 1 - cos a) of a `reduced` angle."""
    return _doubled(odd, *_of_half(y))


def _doubled(odd, sine, cosine):
    """Return (sin a, 1 - cos a) from (sin y, cos y) of a `reduced` angle."""
    # sin a = +-2 sin y cos y and 1 - cos a = 2 sin^2 y if n is even, 2 cos^2 y if it is odd
    is_odd = odd != 0.0
    twice, one = 2.0 * (sine * cosine), select(is_odd, cosine, sine)
    return select(is_odd, -twice, twice), 2.0 * (one * one)


def nearly_sine_and_versine_of(y, odd):
    """Return (sin a, 1 - cos a) with an error of about 1e-7, for a guess: half the operations."""
    z = y * y
    sine = y + (y * z) * (-1.0 / 6.0 + z * (1.0 / 120.0 - z * (1.0 / 5040.0)))
    cosine = 1.0 - z * (0.5 - z * (1.0 / 24.0 - z * (1.0 / 720.0 - z * (1.0 / 40320.0))))
    return _doubled(odd, sine, cosine)


def sine_and_cosine(angle):
    """Return (sin a, cos a), each with an error of 2 ulp of 1; in Python also for arrays."""
    y, odd = reduced(angle)
    sine, cosine = _of_half(y)
    sign = 1.0 - 4.0 * abs(odd)
    return sign * (2.0 * (sine * cosine)), sign * ((cosine - sine) * (cosine + sine))


def reduced(angle):
    """Return y of an angle a = n pi + 2 y, and +-1/2 if n is odd, 0 if it is even."""
    n = (angle * _INVERSE_PI + _WHOLE) - _WHOLE
    return 0.5 * (((angle - n * _PI[0]) - n * _PI[1]) - n * _PI[2]), _odd(n)


def _of_half(y):
    """Return (sin y, cos y) for |y| up to pi/4."""
    z = y * y
    a, b, c, d, e, f = _SINE
    sine = y + (y * z) * (a + z * (b + z * (c + z * (d + z * (e + z * f)))))
    a, b, c, d, e, f = _COSINE
    return sine, 1.0 - (0.5 * z - z * z * (a + z * (b + z * (c + z * (d + z * (e + z * f))))))


def _odd(n):
    """Return +-1/2 for an odd number, 0 for an even one."""
    half = 0.5 * n
    return (half + _WHOLE) - _WHOLE - half


def _split(a):
    """Return (2^n, e^y - 1) for a = n ln 2 + y."""
    n = (a * _INVERSE_LN2 + _WHOLE) - _WHOLE
    high, low = a - n * _LN2_HIGH, n * _LN2_LOW
    y = high - low
    z, even = y * y, 0.0
    for coefficient in _EXPONENTIAL:
        even = z * (coefficient + even)
    c = y - even
    left, power = abs(n), 1.0
    for k in _POWERS:
        has = left >= k
        left = select(has, left - k, left)
        power = select(has, power * select(n < 0.0, 2.0**-k, 2.0**k), power)
    return power, high - (low - (y * c) / (2.0 - c))


def _exponential(a):
    inner = select(a > _LEAST, select(a < _MOST, a, _MOST), _LEAST)
    power, rest = _split(inner)
    value = select(a > _MOST, math.inf, select(a < _LEAST, 0.0, power + power * rest))
    return select(a == a, value, a)


def _less_one(a):
    """Return e^a - 1 without cancellation, for a from -40 to 709."""
    power, rest = _split(a)
    return power * rest + (power - 1.0)


def _hyperbolic(a):
    size = abs(a)
    less = _less_one(select(size < _MOST, size, _MOST))
    whole = less + 1.0
    inverse = 1.0 / whole
    sine, cosine = 0.5 * (less + less * inverse), 0.5 * (whole + inverse)
    beyond = not size <= _MOST
    sine, cosine = select(beyond, size + math.inf, sine), select(beyond, size + math.inf, cosine)
    return select(a < 0.0, -sine, sine), cosine


def _tangent(a):
    size = abs(a)
    less = _less_one(2.0 * select(size < _FLAT, size, _FLAT))
    value = less / (less + 2.0)
    return select(a == a, select(a < 0.0, -value, value), a)


def _logarithm(u):
    value = logarithm_of(*_scaled(u))
    value = select(u > 0.0, select(u < math.inf, value, u), math.nan)
    return select(u == 0.0, -math.inf, value)


def _scaled(u):
    """Return (v, e) with u = 2^e v, v between 1/2 and 1."""
    is_large, e, left = u >= 1.0, 0.0, u
    for k in _POWERS:
        moved = left * select(is_large, 2.0**-k, 2.0**k)
        moves = is_large == (moved >= 1.0)
        left, e = select(moves, moved, left), e + select(moves, select(is_large, float(k), -float(k)), 0.0)
    return select(is_large, 0.5 * left, left), select(is_large, e + 1.0, e)


def logarithm_of(u, e):
    """Return ln(2^e u) for u in [1/2, 1], to one unit in the last place."""
    e, f, less = _near_one(u, e)
    return e * _LN2_HIGH - ((less - e * _LN2_LOW) - f)


def _near_one(u, e):
    """Return (k, f, f - ln(1 + f)) for 2^e u = 2^k (1 + f) with 1 + f within sqrt(1/2)..sqrt(2).

    ln(1 + f) = 2 artanh(s) for s = f/(2 + f): with 2 s = f - s f that is f - s (f - R), R = 2 s^2/3 + 2 s^4/5 + ...,
    |s| < 0.172; its rounding is small beside f. The neglected terms are 2 s^22/23 < 2e-18 of R.
    """
    small = u < _HALF_ROOT
    f, e = select(small, u + u, u) - 1.0, select(small, e - 1.0, e)
    s = f / (2.0 + f)
    z = s * s
    rest = 0.0
    for coefficient in _ARTANH:
        rest = z * (coefficient + rest)
    return e, f, s * (f - rest)


def _power(u, c):
    # ln u = a + b and c ln u = p + q, b and q of the order of round-off: e^(c ln u) has the digits of both.
    e, f, less = _near_one(*_scaled(u))
    top = e * _LN2_HIGH
    above = top + f
    below = (f - (above - top)) - (less - e * _LN2_LOW)
    a = above + below
    b = below - (a - above)
    (a_high, a_low), (c_high, c_low), p = _halves(a), _halves(c), a * c
    q = (((a_high * c_high - p) + a_high * c_low) + a_low * c_high) + a_low * c_low
    value = _exponential(p)
    value = value + value * (q + b * c)
    return select(u > 0.0, select(u < math.inf, value, u), select(u == 0.0, 0.0, math.nan))


def _halves(a):
    """Return two numbers of 26 bits with the sum a (Veltkamp): their products are exact."""
    moved = _SPLITS * a
    high = moved - (moved - a)
    return high, a - high


def _of_numbers(of_one: Any, of_arrays: Any, meaning: str) -> Any:
    """Return a function of a number, which in Python also takes arrays."""

    def in_python(a, *more):
        return of_one(a, *more) if np.ndim(a) == 0 else of_arrays(a, *more)

    in_python.__doc__ = meaning
    return allocating(in_python, of_one)


exponential = _of_numbers(_exponential, np.exp, "e^a: 0 below a = -708, infinite above 709.")
hyperbolic = _of_numbers(_hyperbolic, lambda a: (np.sinh(a), np.cosh(a)), "(sinh a, cosh a), infinite beyond 709.")
hyperbolic_tangent = _of_numbers(_tangent, np.tanh, "tanh a")
logarithm = _of_numbers(_logarithm, np.log, "ln u, of a normal number.")
power = _of_numbers(_power, np.power, "u^c for a normal number u, c above 0; 12 ulp at c = 64.")

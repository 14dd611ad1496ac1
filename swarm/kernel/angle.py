"""The sine, the cosine and the versine of an angle, of sums and products alone: a library's sine ends a lane loop."""

import math

from .jit import select

# The sum with it, less it again, is the nearest whole number.
_WHOLE = 6755399441055744.0  # 1.5 2^52
# pi in three parts, of which the first two leave room for a whole number of 25 bits: up to 1e8 rad their product with
# it is exact. Beyond, the error is that of the rounding of the angle.
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


def sine_and_versine(angle):
    """(sin a, 1 - cos a), the second without cancellation."""
    return _doubled(*_of_half(angle))


def _doubled(n, sine, cosine):
    """(sin a, 1 - cos a) from (n, sin y, cos y) for a = n pi + 2 y."""
    # sin a = +-2 sin y cos y and 1 - cos a = 2 sin^2 y where n is even, 2 cos^2 y where it is odd
    is_odd = _odd(n) != 0.0
    twice, one = 2.0 * (sine * cosine), select(is_odd, cosine, sine)
    return select(is_odd, -twice, twice), 2.0 * (one * one)


def nearly_sine_and_versine(angle):
    """The same with an error of some 1e-7, for a guess: half the operations."""
    n = (angle * _INVERSE_PI + _WHOLE) - _WHOLE
    y = 0.5 * (angle - n * math.pi)
    z = y * y
    sine = y + (y * z) * (-1.0 / 6.0 + z * (1.0 / 120.0 - z * (1.0 / 5040.0)))
    cosine = 1.0 - z * (0.5 - z * (1.0 / 24.0 - z * (1.0 / 720.0 - z * (1.0 / 40320.0))))
    return _doubled(n, sine, cosine)


def sine_and_cosine(angle):
    """(sin a, cos a), each with an error of 2 ulp of 1; in Python also of arrays."""
    n, sine, cosine = _of_half(angle)
    sign = 1.0 - 4.0 * abs(_odd(n))
    return sign * (2.0 * (sine * cosine)), sign * ((cosine - sine) * (cosine + sine))


def _of_half(angle):
    """(n, sin y, cos y) for a = n pi + 2 y."""
    n = (angle * _INVERSE_PI + _WHOLE) - _WHOLE
    y = 0.5 * (((angle - n * _PI[0]) - n * _PI[1]) - n * _PI[2])
    z = y * y
    a, b, c, d, e, f = _SINE
    sine = y + (y * z) * (a + z * (b + z * (c + z * (d + z * (e + z * f)))))
    a, b, c, d, e, f = _COSINE
    return n, sine, 1.0 - (0.5 * z - z * z * (a + z * (b + z * (c + z * (d + z * (e + z * f))))))


def _odd(n):
    """+-1/2 of an odd number, 0 of an even one."""
    half = 0.5 * n
    return (half + _WHOLE) - _WHOLE - half

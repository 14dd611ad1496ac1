"""Vectors of three numbers, with the operators of Python: the same definitions in kernels and in plain Python.

Numba has them too: a function that cannot be traced may use them.
"""

from typing import Any, NamedTuple

import numpy as np

from .jit import Array, inlined, select

# The factor that restores the square of a velocity is 1 within round-off, unless next to nothing is left of it.
_NEAR = 1e-6
# Makes a vector in C: the name of the class would call a function of Python, a quarter of the time of an operator.
_new = tuple.__new__


class Vec(NamedTuple):
    """A vector. In plain Python its components may be arrays of the same shape."""

    x: Any
    y: Any
    z: Any

    def __add__(a, b: Any) -> "Vec":  # type: ignore[override]  # noqa: N805
        return _new(Vec, (a.x + b.x, a.y + b.y, a.z + b.z))

    def __sub__(a, b: "Vec") -> "Vec":  # noqa: N805
        return _new(Vec, (a.x - b.x, a.y - b.y, a.z - b.z))

    def __mul__(a, b: Any) -> "Vec":  # type: ignore[override]  # noqa: N805
        return _new(Vec, (a.x * b, a.y * b, a.z * b))

    def __rmul__(b, a: Any) -> "Vec":  # type: ignore[override]  # noqa: N805
        return _new(Vec, (a * b.x, a * b.y, a * b.z))

    def __truediv__(a, b: Any) -> "Vec":  # noqa: N805
        return _new(Vec, (a.x / b, a.y / b, a.z / b))


# Without it NumPy takes a vector for an array of three: np.float64(2.0) * v would be an array.
Vec.__array_ufunc__ = None  # type: ignore[attr-defined]

ZERO = Vec(0.0, 0.0, 0.0)


class Symmetric(NamedTuple):
    """A symmetric matrix."""

    xx: Any
    yy: Any
    zz: Any
    xy: Any
    yz: Any
    zx: Any


def vec(values: Any) -> Vec:
    """Return three numbers, or the three rows of an array, as a vector."""
    x, y, z = values
    return _new(Vec, (x, y, z))


@inlined
def dot(a, b):
    """a.b"""
    return a.x * b.x + a.y * b.y + a.z * b.z


@inlined
def square(a):
    """|a|^2"""
    return a.x * a.x + a.y * a.y + a.z * a.z


@inlined
def with_square(v, speed2):
    """Return a velocity with the square speed2, from within round-off, without a bias, which 1e8 collisions would show.

    By one Newton step of the square root, as a sum: a factor 1 + x rounds x up and down by different steps.
    """
    now = square(v)
    miss = speed2 - now
    near = (abs(miss) <= _NEAR * now) & (now > 0.0)
    return v + select(near, 0.5 * miss / select(near, now, 1.0), 0.0) * v


@inlined
def norm(a):
    """|a|"""
    # NumPy's root, so that in plain Python too 1/|0| is an infinity.
    return np.sqrt(a.x * a.x + a.y * a.y + a.z * a.z)


@inlined
def times(a, b):
    """Return the products of the components: the diagonal matrix a times b."""
    return _new(Vec, (a.x * b.x, a.y * b.y, a.z * b.z))


@inlined
def cross(a, b):
    """a x b"""
    return _new(Vec, (a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x))


@inlined
def absolute(a):
    """Return the magnitudes of the components."""
    return _new(Vec, (abs(a.x), abs(a.y), abs(a.z)))


@inlined
def total(a):
    """Return the sum of the components."""
    return a.x + a.y + a.z


@inlined
def largest(a):
    """Return the largest magnitude of a component."""
    return max(abs(a.x), abs(a.y), abs(a.z))


@inlined
def lowest(a, b):
    """Return the smaller of each pair of components."""
    return _new(Vec, (min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)))


@inlined
def highest(a, b):
    """Return the larger of each pair of components."""
    return _new(Vec, (max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)))


@inlined
def either(condition, a, b):
    """`select` of vectors."""
    return _new(Vec, (select(condition, a.x, b.x), select(condition, a.y, b.y), select(condition, a.z, b.z)))


@inlined
def moves(a):
    """Whether a vector is not 0."""
    return a.x != 0.0 or a.y != 0.0 or a.z != 0.0


@inlined
def column(rows: Array, row, i):
    """Return the vector in three rows of a column."""
    return _new(Vec, (rows[row, i], rows[row + 1, i], rows[row + 2, i]))


@inlined
def put(rows: Array, row, i, a):
    """Store a vector into three rows of a column."""
    rows[row, i], rows[row + 1, i], rows[row + 2, i] = a.x, a.y, a.z


@inlined
def vector_at(rows: Array, i, k):
    """Return the vector in three columns of a row."""
    return _new(Vec, (rows[i, k], rows[i, k + 1], rows[i, k + 2]))


@inlined
def set_vector(rows: Array, i, k, a):
    """Store a vector into three columns of a row."""
    rows[i, k], rows[i, k + 1], rows[i, k + 2] = a.x, a.y, a.z

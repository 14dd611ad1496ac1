"""A tricubic B-spline on a regular grid: its coefficients from samples, and its value, gradient and second derivatives.

Its pieces are polynomials, one a cell, that join with continuous second derivatives (C2).
"""

from typing import Any, NamedTuple

import numpy as np

from ...kernel.fours import Four, over_block, sum_of
from ...kernel.grid import MARGIN
from ...kernel.jit import Array, outlined
from ...kernel.limits import TINY
from ...kernel.record import Record
from ...kernel.vector import Symmetric, Vec, absolute, norm, times
from ...state import Floats

# The least number of samples along each axis: the ends of the spline take four.
LEAST = 4


# --- Coefficients ----------------------------------------------------------------------------------------


def coefficients(values: Floats) -> Floats:
    """Return the coefficients of the spline through samples, along each axis."""
    found = values
    for axis in range(3):
        found = along(found, axis)
    return np.ascontiguousarray(found)


def along(values: Floats, axis: int) -> Floats:
    """Return the coefficients of the splines along one axis; the outermost two cells share one polynomial.

    (c[i] + 4 c[i+1] + c[i+2])/6 = f[i]; with c[0] - 4 c[1] + 6 c[2] - 4 c[3] + c[4] = 0 the third derivative has no
    jump next to the end ("not a knot"), and the error is of order 4 up to it.
    """
    f = np.moveaxis(values, axis, 0)
    n = len(f)
    c = np.empty((n + 2, *f.shape[1:]))
    # Both rows of the end together give its third coefficient.
    c[2] = (8.0 * f[1] - f[0] - f[2]) / 6.0
    c[n - 1] = (8.0 * f[n - 2] - f[n - 1] - f[n - 3]) / 6.0
    # Between them a tridiagonal system, by elimination: c[i+1] = g[i] - p[i] c[i+2]
    p = 0.0
    factors = np.zeros(n + 2)
    for i in range(3, n - 1):
        p = 1.0 / (4.0 - p)
        factors[i] = p
        c[i] = p * (6.0 * f[i - 1] - c[i - 1])
    for i in range(n - 2, 2, -1):
        c[i] -= factors[i] * c[i + 1]
    c[1] = 6.0 * f[1] - 4.0 * c[2] - c[3]
    c[0] = 6.0 * f[0] - 4.0 * c[1] - c[2]
    c[n] = 6.0 * f[n - 2] - 4.0 * c[n - 1] - c[n - 2]
    c[n + 1] = 6.0 * f[n - 1] - 4.0 * c[n] - c[n - 1]
    return np.moveaxis(c, 0, axis)


class SplinePlace(NamedTuple):
    """The cell of a point, its place in the cell from 0 to 1, and its distance outside of the grid along each axis."""

    x: Any
    y: Any
    z: Any
    at: Vec
    off: Vec


def _within(u, count):
    # As far as a flight passes beyond a cell that it leaves
    return np.minimum(np.maximum(u, -MARGIN), count + MARGIN)


def _whole(u, count):
    return np.maximum(np.minimum(np.floor(u), count - 1.0), 0.0)


# --- Values ----------------------------------------------------------------------------------------------


def basis(t):
    """Return the basis functions at a place in the cell."""
    s = 1.0 - t
    sixth = 1.0 / 6.0
    return Four(
        sixth * s * s * s,
        sixth * (4.0 - 3.0 * t * t * (2.0 - t)),
        sixth * (4.0 - 3.0 * s * s * (2.0 - s)),
        sixth * t * t * t,
    )


def _slopes(t):
    """Return the derivatives of the basis functions."""
    s = 1.0 - t
    return Four(-0.5 * s * s, 0.5 * t * (3.0 * t - 4.0), 0.5 * s * (4.0 - 3.0 * s), 0.5 * t * t)


def _bends(t):
    """Return the second derivatives of the basis functions."""
    s = 1.0 - t
    return Four(s, t - 2.0 * s, s - 2.0 * t, t)


def _steps(t0, t1, d):
    """Return the basis functions at t1 less those at t0, without cancellation; d is t1 - t0."""
    s0, s1 = 1.0 - t0, 1.0 - t1
    sixth = 1.0 / 6.0
    squares, cubes = t0 + t1, t1 * t1 + t1 * t0 + t0 * t0
    back, third = s0 + s1, s1 * s1 + s1 * s0 + s0 * s0
    return Four(
        -sixth * d * third,
        -sixth * d * (6.0 * squares - 3.0 * cubes),
        sixth * d * (6.0 * back - 3.0 * third),
        sixth * d * cubes,
    )


class Spline(Record):
    """Coefficients of cells from `low` on, two more along each axis than there are samples."""

    low: Vec
    width: Vec  # of a cell
    inverse: Vec  # 1/width
    shape: Vec  # the number of cells along x, y, z
    steepness: float  # the slope of phi outside of the grid, with the distance from it
    coefficients: Array

    def place(self, r):
        """Return the `SplinePlace` of a point, or of the nearest point of the grid."""
        u, n = times(r - self.low, self.inverse), self.shape
        c = Vec(_within(u.x, n.x), _within(u.y, n.y), _within(u.z, n.z))
        cell = Vec(_whole(c.x, n.x), _whole(c.y, n.y), _whole(c.z, n.z))
        # In plain Python a point may be an array of points.
        return SplinePlace(np.int64(cell.x), np.int64(cell.y), np.int64(cell.z), c - cell, times(u - c, self.width))

    def value_and_slope(self, r):
        """Return phi and its gradient."""
        place, table, k = self.place(r), self.coefficients, self.inverse
        x, y, z = basis(place.at.x), basis(place.at.y), basis(place.at.z)
        column, across = over_block(table, place, x, y), over_block(table, place, _slopes(place.at.x), y)
        sideways = over_block(table, place, x, _slopes(place.at.y))
        # Outside of the grid phi is its value at the border, plus a rise with the distance.
        away, inside = norm(place.off), Vec(place.off.x == 0.0, place.off.y == 0.0, place.off.z == 0.0)
        further = (place.off / np.maximum(away, TINY)) * self.steepness
        slope = Vec(
            inside.x * k.x * sum_of(z, across) + further.x,
            inside.y * k.y * sum_of(z, sideways) + further.y,
            inside.z * k.z * sum_of(_slopes(place.at.z), column) + further.z,
        )
        return sum_of(z, column) + self.steepness * away, slope

    @outlined
    def value(self, r):
        """Return phi alone."""
        place = self.place(r)
        column = over_block(self.coefficients, place, basis(place.at.x), basis(place.at.y))
        return sum_of(basis(place.at.z), column) + self.steepness * norm(place.off)

    @outlined
    def half_bend(self, r):
        """Return H = grad grad phi/2."""
        place, table, k = self.place(r), self.coefficients, self.inverse
        x, y, z = basis(place.at.x), basis(place.at.y), basis(place.at.z)
        dx, dy, dz = _slopes(place.at.x), _slopes(place.at.y), _slopes(place.at.z)
        return Symmetric(
            0.5 * k.x * k.x * sum_of(z, over_block(table, place, _bends(place.at.x), y)),
            0.5 * k.y * k.y * sum_of(z, over_block(table, place, x, _bends(place.at.y))),
            0.5 * k.z * k.z * sum_of(_bends(place.at.z), over_block(table, place, x, y)),
            0.5 * k.x * k.y * sum_of(z, over_block(table, place, dx, dy)),
            0.5 * k.y * k.z * sum_of(dz, over_block(table, place, x, dy)),
            0.5 * k.z * k.x * sum_of(dz, over_block(table, place, dx, y)),
        )

    @outlined
    def difference(self, r0, r1):
        """Return phi(r1) - phi(r0), without cancellation where both are in one cell."""
        a, b = self.place(r0), self.place(r1)
        same = a.x == b.x and a.y == b.y and a.z == b.z
        inside = norm(a.off) == 0.0 and norm(b.off) == 0.0
        if not (same and inside):
            return self.value(r1) - self.value(r0)
        # x1 y1 z1 - x0 y0 z0 = (x1 - x0) y1 z1 + x0 (y1 - y0) z1 + x0 y0 (z1 - z0)
        table, x0, y0 = self.coefficients, basis(a.at.x), basis(a.at.y)
        y1, z1, d = basis(b.at.y), basis(b.at.z), times(r1 - r0, self.inverse)
        along_x = sum_of(z1, over_block(table, a, _steps(a.at.x, b.at.x, d.x), y1))
        along_y = sum_of(z1, over_block(table, a, x0, _steps(a.at.y, b.at.y, d.y)))
        return along_x + along_y + sum_of(_steps(a.at.z, b.at.z, d.z), over_block(table, a, x0, y0))

    def coordinates(self, r):
        """The magnitudes that round a point: its coordinates in the scene and, larger near its origin, in the grid."""
        return absolute(r) + absolute(r - self.low)

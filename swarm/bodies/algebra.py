"""Linear algebra with sums in a fixed order: the last bits of BLAS and LAPACK depend on the processor."""

import numpy as np

from ..kernel.limits import EPSILON
from ..state import Floats

# The most sweeps of Jacobi's method over a matrix of three rows; six suffice, as convergence is quadratic.
_SWEEPS = 12


def product(rows: Floats, matrix: Floats) -> Floats:
    """Return the product (m, n) of `rows` (m, k) and a matrix (k, n); entries of `rows` that are 0 take no time."""
    found = np.zeros((len(rows), matrix.shape[1]))
    for k, entries in enumerate(rows.T):
        some = np.flatnonzero(entries)
        found[some] += entries[some, None] * matrix[k]
    return found


def determinants(matrices: Floats) -> Floats:
    """Return the determinants (...) of matrices (..., 3, 3), a.(b x c) of their rows."""
    a, b, c = (matrices[..., k, :] for k in range(3))
    return np.asarray((a * np.cross(b, c)).sum(axis=-1))


def modes_of_three(matrix: Floats) -> tuple[Floats, Floats]:
    """Return the eigenvalues (3,) and eigenvectors, columns of (3, 3), of a symmetric matrix, by Jacobi's rotations."""
    rest, axes, least = matrix.copy(), np.eye(3), 0.25 * EPSILON * np.abs(matrix).max()
    for _sweep in range(_SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            # An entry below round-off needs no rotation; each rotation costs the axes a last bit.
            if abs(rest[p, q]) <= least:
                continue
            # The smaller of the two tangents of angles that make the entry 0.
            apart, twice = rest[q, q] - rest[p, p], 2.0 * rest[p, q]
            tangent = twice / (apart + np.copysign(np.sqrt(apart * apart + twice * twice), apart))
            cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
            sine, off = tangent * cosine, tangent * rest[p, q]
            rest[p, p], rest[q, q] = rest[p, p] - off, rest[q, q] + off
            rest[p, q] = rest[q, p] = 0.0
            k = 3 - p - q
            rest[k, p], rest[k, q] = cosine * rest[k, p] - sine * rest[k, q], sine * rest[k, p] + cosine * rest[k, q]
            rest[p, k], rest[q, k] = rest[k, p], rest[k, q]
            axes[:, p], axes[:, q] = cosine * axes[:, p] - sine * axes[:, q], sine * axes[:, p] + cosine * axes[:, q]
    return np.diagonal(rest), axes


def inverse(matrix: Floats) -> Floats:
    """Return the inverse of a symmetric, positive definite matrix; the inverse of a diagonal matrix is exact."""
    # The units are powers of two, so that scaling rounds nothing.
    unit = np.ldexp(1.0, -(np.frexp(np.diagonal(matrix))[1] // 2))
    scaled = unit[:, None] * matrix * unit
    return np.asarray(unit[:, None] * solved(scaled[:, :, None], np.eye(len(matrix))) * unit)


def solved(system: Floats, wanted: Floats) -> Floats:
    """Return the solutions (m, n) of n symmetric systems (m, m, n), or of one (m, m, 1); 0 in a dependent row.

    The diagonals of the systems are about 1.
    """
    upper, x, rows = system.copy(), wanted.copy(), len(wanted)
    least = 8.0 * rows * EPSILON
    for k in range(rows):
        pivot = np.where(upper[k, k] > least, upper[k, k], np.inf)
        below = k + 1 + np.flatnonzero(upper[k, k + 1 :].any(axis=1))
        part = upper[k, below] / pivot
        upper[np.ix_(below, below)] -= part[:, None] * upper[k, below]
        x[below] -= part * x[k]
        upper[k, below], x[k] = part, x[k] / pivot
    for k in reversed(range(rows)):
        for later in k + 1 + np.flatnonzero(upper[k, k + 1 :].any(axis=1)):
            x[k] -= upper[k, later] * x[later]
    return x

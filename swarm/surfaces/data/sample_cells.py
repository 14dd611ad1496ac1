"""The cells of a spline that the surface is in, its distance from all others, and bounds of phi's bend near it.

In a cell a cubic is between the least and the largest of its Bernstein coefficients, and so are its derivatives: their
coefficients are differences of these. These are bounds that hold, not samples.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ...kernel.grid import MARGIN
from ...kernel.jit import Array
from ...kernel.limits import COEFFICIENT
from ...kernel.record import Record
from ...state import Floats
from ..curvature import matrices_of

Mask = NDArray[np.bool_]
Places = NDArray[np.int64]

# From the B-spline coefficients of a cell to its Bernstein coefficients, along one axis.
_BERNSTEIN = np.array([[1.0, 4.0, 1.0, 0.0], [0.0, 4.0, 2.0, 0.0], [0.0, 2.0, 4.0, 0.0], [0.0, 1.0, 4.0, 1.0]]) / 6.0
# Cells with Bernstein coefficients that are computed together
_BATCH = 16_384
# The clearance is known up to this many cells: a flight through empty space takes a step for each.
_FARTHEST = 63
# The columns of `bends`: the entries of a matrix in the order of `Symmetric`, and the bound of its distance from H.
SPREAD, _COLUMNS = 6, 8
# The two axes of each entry of a symmetric matrix.
_SECOND = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


# The clearance of a cell is kept in this part of the width of a cell.
_PARTS = 4.0


class SampleCells(Record):
    """Each cell in few bytes: a flight passes through many."""

    clear: Array  # uint8 (cells along x, y, z): 0 if the surface may be in it, else 1 + the clearance/unit
    unit: float  # [m]
    row: Array  # int32 (cells along x, y, z): where the surface may be, the row of
    bends: Array  # float32 (rows, 8): the bend H = grad grad phi/2 in the cell and all around it


def cells_of(coefficients: Floats, width: Floats) -> SampleCells:
    """Return the `SampleCells` of a spline with these coefficients and this width (3,) of a cell [m]."""
    near = _near(coefficients)
    around = _grown(near)
    low, high = _bends(coefficients, width, around)
    rows = np.argwhere(near)
    unit = float(width.min()) / _PARTS
    # Slightly less, for round-off; in C's order, as after a pickle, so that kernels are compiled once.
    clear = 1 + np.floor(_distance(around, width) * ((1.0 - 1e-5) / unit)).astype(np.uint8, order="C")
    clear[near] = 0
    row = np.zeros(near.shape, np.int32)
    row[near] = np.arange(len(rows))
    return SampleCells(clear, unit, row, _rows(low, high, rows))


def _near(c: Floats) -> Mask:
    """Return the cells that the surface may be in."""
    low, high = c, c
    for axis in range(3):
        low, high = _window(low, axis, np.minimum), _window(high, axis, np.maximum)
    found = _holds_zero(low, high)
    for places in _batches(np.argwhere(found)):
        b = bernstein(c, places).reshape(len(places), -1)
        found[tuple(places.T)] = _holds_zero(b.min(axis=1), b.max(axis=1))
    return found


def _holds_zero(low: Floats, high: Floats) -> Mask:
    """Whether 0 may be between these bounds in a cell or, by a slope of nine times their range at most, next to it."""
    room = 9.0 * MARGIN * (high - low) + COEFFICIENT * np.maximum(np.abs(low), np.abs(high))
    return np.asarray((low <= room) & (high >= -room))


def _window(values: Floats, axis: int, which: np.ufunc) -> Floats:
    """Return the least or the largest of four neighbours along an axis."""
    v = np.moveaxis(values, axis, 0)
    return np.moveaxis(which(which(v[:-3], v[1:-2]), which(v[2:-1], v[3:])), 0, axis)


def _batches(places: Places) -> list[Places]:
    return [places[i : i + _BATCH] for i in range(0, len(places), _BATCH)]


def bernstein(c: Floats, places: Places) -> Floats:
    """Return the Bernstein coefficients (cells, 4, 4, 4) of the cells at these places (cells, 3)."""
    four = np.arange(4)
    i, j, k = (places[:, axis, None] + four for axis in range(3))
    found = c[i[:, :, None, None], j[:, None, :, None], k[:, None, None, :]]
    for axis in (1, 2, 3):
        found = np.moveaxis(np.moveaxis(found, axis, -1) @ _BERNSTEIN.T, -1, axis)
    return np.asarray(found)


def least_at_border(c: Floats, axis: int, end: int) -> float:
    """Return a lower bound of phi where the grid begins along an axis (end 0) or ends (-1)."""
    layer = np.zeros([n - 3 for n in c.shape], np.bool_)
    layer[(slice(None),) * axis + (end,)] = True
    found = (np.take(bernstein(c, places), end, axis=1 + axis).min() for places in _batches(np.argwhere(layer)))
    return float(min(found))


def _bends(c: Floats, width: Floats, of: Mask) -> tuple[Floats, Floats]:
    """Return bounds of the entries of H in these cells, (6, cells along x, y, z) each; undefined in all other cells."""
    low, high = np.full((6, *of.shape), np.inf), np.full((6, *of.shape), -np.inf)
    for places in _batches(np.argwhere(of)):
        index = (slice(None), *places.T)
        low[index], high[index] = _bends_at(c, width, places)
    return low, high


def _bends_at(c: Floats, width: Floats, places: Places) -> tuple[Floats, Floats]:
    """Return the bounds of the cells at these places, (6, cells) each."""
    b = bernstein(c, places)
    low, high = np.empty((2, 6, len(places)))
    noise = 8.0 * COEFFICIENT * np.abs(b).reshape(len(places), -1).max(axis=1)
    for n, (i, j) in enumerate(_SECOND):
        # 3 (b[i+1] - b[i]) along each of two axes, or 6 (b[i+2] - 2 b[i+1] + b[i]) along one
        second = np.diff(np.diff(b, axis=1 + i), axis=1 + j).reshape(len(places), -1)
        factor = (6.0 if i == j else 9.0) * 0.5 / (width[i] * width[j])
        low[n], high[n] = factor * (second.min(axis=1) - noise), factor * (second.max(axis=1) + noise)
    return low, high


def _rows(low: Floats, high: Floats, places: Places) -> NDArray[np.float32]:
    """Return `SampleCells.bends` of the cells at these places: bounds of each with its neighbours."""
    all_low, all_high = low, high
    for axis in (1, 2, 3):
        all_low, all_high = _neighbours(all_low, axis, np.minimum), _neighbours(all_high, axis, np.maximum)
    index = (slice(None), *places.T)
    least, most = all_low[index].T, all_high[index].T
    # From one side of a cell to its opposite side H changes by no more than its range.
    room = 4.0 * MARGIN * (most - least)
    least, most = least - room, most + room
    table = np.zeros((len(places), _COLUMNS), np.float32)
    table[:, :6] = 0.5 * (least + most)
    # |E| is at most the largest sum of a row.
    off = matrices_of(np.maximum(most - table[:, :6], table[:, :6] - least).T)
    table[:, SPREAD] = off.sum(axis=2).max(axis=1) * (1.0 + 1e-6)
    return table


def eigenvalues(cells: SampleCells) -> tuple[float, float]:
    """Return a lower bound of the least and an upper bound of the largest eigenvalue of H where the surface is."""
    bends = cells.bends.astype(np.float64)
    values, spread = np.linalg.eigvalsh(matrices_of(bends.T)), bends[:, SPREAD] * (1.0 + COEFFICIENT)
    return float((values[:, 0] - spread).min()), float((values[:, 2] + spread).max())


def most_bent_within(
    coefficients: Floats, width: Floats, cells: SampleCells, side: float, steepness: float
) -> tuple[float, float, float]:
    """The numbers that make the largest balls certain: (m, `known` of `ByFoot`, the smallest radius of curvature).

    For a spline, side 1 or -1, where |grad phi| on the surface is as large as the steepness: side H is at most m up to
    twice `known` from the surface. Cells are searched from the surface outwards, as far as a larger radius is possible.
    """
    found, most = (0.0, 0.0, 0.0), 0.0
    layer = np.maximum(cells.clear.astype(np.float64) - 1.0, 0.0) // _PARTS
    for k in range(int(layer.max()) + 1):
        for places in _batches(np.argwhere(layer == k)):
            most = max(most, _largest_bend(*_bends_at(coefficients, width, places), side))
        known = math.inf if k == layer.max() else 0.5 * (k + 1.0) * _PARTS * cells.unit
        radius = 0.5 * steepness / most if most > 0.0 else math.inf
        if min(known, radius) > found[2]:
            found = most, known, min(known, radius)
        if radius <= known:
            break
    return found


def _largest_bend(low: Floats, high: Floats, side: float) -> float:
    """Return an upper bound of the largest eigenvalue of side H, by bounds of its entries in cells; not below 0."""
    middle, off = map(matrices_of, (0.5 * (low + high), 0.5 * (high - low)))
    # |E| is at most the largest sum of a row.
    values = np.linalg.eigvalsh(side * middle)[:, 2] + off.sum(axis=2).max(axis=1)
    return float(values.max(initial=0.0)) * (1.0 + COEFFICIENT)


def _neighbours(values: Floats, axis: int, which: np.ufunc) -> Floats:
    """Return the least or the largest of each cell and its two neighbours along an axis."""
    v = np.moveaxis(values, axis, 0)
    found = v.copy()
    which(found[1:], v[:-1], out=found[1:])
    which(found[:-1], v[1:], out=found[:-1])
    return np.moveaxis(found, 0, axis)


def _grown(cells: Mask) -> Mask:
    """Return these cells and all around them."""
    for axis in range(3):
        cells = _neighbours(cells, axis, np.logical_or)  # type: ignore[arg-type, assignment]
    return cells


def _distance(grown: Mask, width: Floats) -> NDArray[np.float32]:
    """A lower bound of the distance of each cell from the cells before `grown`: that of its centre from `grown`."""
    farthest = float(_FARTHEST * width.min())
    squares = np.where(grown, np.float32(0.0), np.float32(farthest * farthest))
    for axis in range(3):
        before = np.moveaxis(squares, axis, 0)
        after = before.copy()
        most = float(before.max())
        for step in range(1, min(_FARTHEST, len(before) - 1) + 1):
            way = np.float32((step * width[axis]) ** 2)
            if way >= most:
                break
            np.minimum(after[step:], before[:-step] + way, out=after[step:])
            np.minimum(after[:-step], before[step:] + way, out=after[:-step])
        squares = np.moveaxis(after, 0, axis)
    return np.sqrt(squares)

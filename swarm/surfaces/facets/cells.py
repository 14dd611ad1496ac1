"""The grid of facets: what is in each cell, and how far it is from each empty one to the next that is not.

The facets of a mesh are on a surface, so most cells are empty: a flight leaps through blocks of these.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ...kernel import cache
from ...kernel.arrays import index
from ...kernel.jit import Array, kernel, outlined, select
from ...kernel.record import Record
from ...kernel.vector import Vec, vec
from ..course import rise_time
from ..fields.grid import MARGIN
from ..fields.members import gathered

# Of the width of a cell the square is so many times the mean area of a facet: a wider one has more facets, of finer
# ones more are crossed. For each facet there are at most so many cells, which take 5 bytes each.
_AREA, _CELLS_EACH, _MOST_CELLS = 3.0, 12.0, 40_000_000
# Cells of few facets.
_LEAST_CELLS = 64
# The farthest leap, in cells.
_FARTHEST = 120
# So few facets are entered in plain Python.
_SOME = 60

Floats = NDArray[np.float64]


class Cells(Record):
    """A `Grid` of facets."""

    low: Vec
    width: Vec
    inverse: Vec
    margin: Vec
    shape: Vec
    first: Array
    entries: Array
    leap: Array  # int8, how many cells away the next one with facets is, 0 in such a one


def cells_around(like, table: Floats, corners: Floats) -> Cells:
    """The cells of the facets of a table.

    Args:
        like: one of them.
        table: their numbers, one in each row.
        corners: of each its three (T, 3, 3) [m].
    """
    low, high = corners.min(axis=1).T, corners.max(axis=1).T
    shape, first, width = _shape(corners, low.min(axis=1), high.max(axis=1))
    count = int(shape.prod())
    numbers = (first, width, 1.0 / width, MARGIN * width, shape)
    starts, nothing = np.zeros(count + 2, np.int32), np.empty(0, np.int32)
    grid = Cells(*(vec(row.tolist()) for row in numbers), starts, nothing, np.empty(0, np.int8))
    enter = cache.in_python(_enter) if len(table) <= _SOME else _enter
    bounds = np.ascontiguousarray(low), np.ascontiguousarray(high)
    enter(like, table, bounds, grid, starts[1:], nothing)
    np.cumsum(starts, out=starts)
    entries = np.empty(starts[-1], np.int32)
    enter(like, table, bounds, grid, starts[:-1].copy(), entries)
    empty = np.diff(starts[:-1]) == 0
    return grid._replace(entries=entries, leap=_leaps(empty.reshape(shape.astype(int))))


def _shape(corners: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """How many cells there are along each axis, the corner of the first, and how wide they are."""
    a, b, c = np.moveaxis(corners, 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / len(corners)
    extent = high - low
    # A flat mesh has room before and behind it.
    extent = np.maximum(extent, 1e-3 * extent.max())
    most = min(max(_CELLS_EACH * len(corners), _LEAST_CELLS), _MOST_CELLS)
    side = max(math.sqrt(_AREA * area), (extent.prod() / most) ** (1.0 / 3.0))
    shape = np.maximum(np.ceil(extent / side), 1.0)
    room = 4.0 * MARGIN * extent
    middle = 0.5 * (low + high)
    width = (extent + 2.0 * room) / shape
    return shape, middle - 0.5 * shape * width, width


def _leaps(empty: NDArray[np.bool_]) -> NDArray[np.int8]:
    """Of every cell how many cells away the next one is that is not empty, along the axis where it is farthest."""
    from scipy.ndimage import distance_transform_cdt

    # What is beyond the border is empty too.
    found = distance_transform_cdt(empty, "chessboard")
    return np.minimum(found, _FARTHEST).astype(np.int8).ravel()


@kernel
def _enter(like, table, bounds, grid, place, entries):
    """Write every facet to the place of each cell that it reaches into; count them where there are no `entries`."""
    low, high = bounds
    n, margin = grid.shape, Vec(2.0 * grid.margin.x, 2.0 * grid.margin.y, 2.0 * grid.margin.z)
    for m in range(table.shape[0]):
        facet = gathered(like, table, index(m), 0)
        x, x_end = _layers(low[0, m] - margin.x - grid.low.x, high[0, m] + margin.x - grid.low.x, grid.width.x, n.x)
        y, y_end = _layers(low[1, m] - margin.y - grid.low.y, high[1, m] + margin.y - grid.low.y, grid.width.y, n.y)
        z, z_end = _layers(low[2, m] - margin.z - grid.low.z, high[2, m] + margin.z - grid.low.z, grid.width.z, n.z)
        for i in range(x, x_end):
            for j in range(y, y_end):
                for k in range(z, z_end):
                    near = grid.low + Vec(i * grid.width.x, j * grid.width.y, k * grid.width.z)
                    far = grid.low + Vec((i + 1.0) * grid.width.x, (j + 1.0) * grid.width.y, (k + 1.0) * grid.width.z)
                    if facet.may_reach(near - margin, far + margin):
                        cell = int((i * n.y + j) * n.z + k)
                        if entries.size > 0:
                            entries[place[cell]] = m
                        place[cell] += 1


def _layers(begin, end, width, count):
    """The layers of cells between two places, from the first to the one after the last."""
    first, last = np.floor(begin / width), np.floor(end / width)
    return int(min(max(first, 0.0), count - 1.0)), int(min(max(last, 0.0), count - 1.0)) + 1


# --- Where a flight leaves cells -------------------------------------------------------------------------


def until_out(gravity, cells, place, leap, r, v):
    """When a flight from a cell has left all cells that are nearer to it than `leap`, and itself."""
    back = select(leap > 1.0, leap - 1.0, 0.0)
    x = _along(gravity, 0, cells.low.x, cells.width.x, cells.margin.x, (place.x - back, place.x + back + 1.0), r.x, v.x)
    y = _along(gravity, 1, cells.low.y, cells.width.y, cells.margin.y, (place.y - back, place.y + back + 1.0), r.y, v.y)
    z = _along(gravity, 2, cells.low.z, cells.width.z, cells.margin.z, (place.z - back, place.z + back + 1.0), r.z, v.z)
    return min(x, min(y, z))


def _along(gravity, axis, low, width, margin, layers, x, v):
    """When it leaves these layers of cells."""
    below, above = low + layers[0] * width - margin, low + layers[1] * width + margin
    if gravity is None:
        return select(v == 0.0, math.inf, (select(v > 0.0, above, below) - x) / v)
    pull = gravity.x if axis == 0 else gravity.y if axis == 1 else gravity.z
    if pull == 0.0:
        return math.inf if v == 0.0 else ((above if v > 0.0 else below) - x) / v
    return min(rise_time(x - above, 0.5 * v, 0.5 * pull), rise_time(below - x, -0.5 * v, -0.5 * pull))

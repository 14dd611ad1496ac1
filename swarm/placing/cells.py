"""Balls in lists by cells, where each finds those that it overlaps, for any sizes.

Balls of one size up to twice that size are in cells of one level, as wide as the largest of them. A ball that is no
larger than the smallest of a level finds all balls of the level that it overlaps in the 27 cells around its own.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernel import cache
from ..kernel.arrays import index
from ..kernel.grid import layer_of, number_of, wrapped
from ..kernel.jit import Array, kernel, outlined, select
from ..kernel.vector import column, put, vector_at
from ..state import Floats

# Up to this number of places are tested in plain Python, before a compiler would be done.
_FEW = 300


class CellLists(NamedTuple):
    """The lists: balls enter them in the order of their sizes, from the largest on."""

    position: Array  # (3, N) positions of the balls that have entered
    radius: Array  # (N,)
    level: Array  # (N,)
    first: Array  # (cells,) the last ball that has entered, or -1
    others: Array  # (N,) the next ball in the list of the cell, or -1
    begin: Array  # (levels,) the number of the first cell
    shape: Array  # (levels, 3) cells along each axis
    inverse: Array  # (levels, 3) 1/width of a cell
    low: Array  # (3,) the lowest corner
    period: Array  # (3,) the period of a periodic direction, else 0
    repeats: Array  # (3,) 1/period, or 0


def order_of(radius: Floats) -> NDArray[np.int64]:
    """Return the numbers of balls from the largest to the smallest."""
    return np.argsort(-radius, kind="stable")


def empty_cells(low: Floats, high: Floats, period: tuple[float | None, ...] | None, radius: Floats) -> CellLists:
    """Return empty lists for balls of these radii in a box."""
    sizes = np.unique(np.floor(np.log2(radius.max() / radius)).astype(np.int64), return_inverse=True)
    level, n = np.asarray(sizes[1]), radius.size
    lengths = np.array([length or 0.0 for length in period or (None,) * 3])
    extent = np.maximum(np.where(lengths > 0.0, lengths, high - low), 0.0)
    begin, shapes, inverses, cells = [], [], [], 0
    for k in range(len(sizes[0])):
        mine = radius[level == k]
        # Not many more cells than balls: with few balls in a large volume most would be empty.
        width = np.full(3, 2.0 * mine.max())
        wide = extent > width
        room = float(np.prod(extent[wide] / width[wide])) / max(2.0 * mine.size, 64.0)
        width[wide] *= max(1.0, room) ** (1.0 / max(1, int(wide.sum())))
        shape = np.maximum(1, np.floor(np.minimum(extent / width, 2.0**20))).astype(np.int64)
        begin.append(cells)
        shapes.append(shape)
        inverses.append(shape / np.where(extent > 0.0, extent, 1.0))
        cells += int(shape.prod())
    return CellLists(
        np.zeros((3, n)), radius, level, np.full(cells, -1, np.int64), np.full(n, -1, np.int64), np.array(begin),
        np.array(shapes), np.array(inverses), np.where(lengths > 0.0, 0.0, low), lengths,
        np.where(lengths > 0.0, 1.0 / np.where(lengths > 0.0, lengths, 1.0), 0.0),
    )  # fmt: skip


# --- Kernels ---------------------------------------------------------------------------------------------


def _layer(cells, level, axis, x):
    """Return the layer of cells of a coordinate."""
    return int(layer_of((x - cells.low[axis]) * cells.inverse[level, axis], cells.shape[level, axis]))


def _around(cells, level, axis, x):
    """Return the layers around that of x, from the first to the end; they may continue beyond a period."""
    count, middle = cells.shape[level, axis], _layer(cells, level, axis, x)
    repeats = (cells.period[axis] > 0.0) & (count > 2)
    return select(repeats, middle - 1, max(middle - 1, 0)), select(repeats, middle + 2, min(middle + 2, count))


def _apart(cells, axis, x):
    """Return a difference of coordinates, of the nearest images."""
    return x - cells.period[axis] * np.floor(x * cells.repeats[axis] + 0.5)


@outlined
def _met(cells, r, radius, stops):
    """Return (the number of overlaps with a ball at r, the deepest ball or -1, its overlap).

    With `stops` the search ends at the first one.
    """
    count, deepest, most = 0, -1, 0.0
    for k in range(cells.begin.size):
        level = index(k)
        shape = vector_at(cells.shape, level, 0)
        (x, x_end), (y, y_end), (z, z_end) = (_around(cells, level, axis, one) for axis, one in enumerate(r))
        for i in range(x, x_end):
            for j in range(y, y_end):
                row = number_of(shape, wrapped(i, shape.x), wrapped(j, shape.y), cells.begin[level])
                for layer in range(z, z_end):
                    m = cells.first[index(row + wrapped(layer, shape.z))]
                    while m >= 0:
                        at = index(m)
                        dx = _apart(cells, 0, cells.position[0, at] - r.x)
                        dy = _apart(cells, 1, cells.position[1, at] - r.y)
                        dz = _apart(cells, 2, cells.position[2, at] - r.z)
                        wide = cells.radius[at] + radius
                        square = dx * dx + dy * dy + dz * dz
                        if square < wide * wide:
                            count += 1
                            depth = wide - math.sqrt(square)
                            if depth > most:
                                deepest, most = m, depth
                            if stops:
                                return count, deepest, most
                        m = cells.others[at]
    return count, deepest, most


def _enter(cells, i, r):
    """Enter ball i at r."""
    level = index(cells.level[i])
    x, y, z = _layer(cells, level, 0, r.x), _layer(cells, level, 1, r.y), _layer(cells, level, 2, r.z)
    shape = vector_at(cells.shape, level, 0)
    cell = index(number_of(shape, x, y, z + cells.begin[level]))
    put(cells.position, 0, i, r)
    cells.others[i] = cells.first[cell]
    cells.first[cell] = i


@kernel
def _find_free(cells, points, radius, free):
    """Set `free` to whether balls at points (3, n) would overlap none that has entered."""
    for i in range(points.shape[1]):
        count, _deepest, _most = _met(cells, column(points, 0, i), radius[i], True)
        free[i] = count == 0


@kernel
def _enter_free(cells, points, numbers, done):
    """Enter balls with these numbers at points (3, n) where they overlap none, unless they are `done`."""
    for i in range(points.shape[1]):
        number = index(numbers[i])
        if not done[number]:
            r = column(points, 0, i)
            count, _deepest, _most = _met(cells, r, cells.radius[number], True)
            if count == 0:
                _enter(cells, number, r)
                done[number] = True


@kernel
def _enter_all(cells, points, order, found):
    """Enter all balls in this order; set `found` to the number of overlapping pairs, the deepest pair, its overlap."""
    for i in range(order.size):
        number = index(order[i])
        r = column(points, 0, number)
        count, deepest, most = _met(cells, r, cells.radius[number], False)
        found[0] += count
        if most > found[3]:
            found[1], found[2], found[3] = order[i], deepest, most
        _enter(cells, number, r)


# --- In arrays -------------------------------------------------------------------------------------------


class Overlaps(NamedTuple):
    """The pairs of balls that overlap."""

    number: int
    pair: tuple[int, int]  # the deepest pair, the smaller number first
    depth: float  # its overlap [m]


def find_free(cells: CellLists, points: Floats, radius: Floats) -> NDArray[np.bool_]:
    """Return whether balls at points (3, n) would overlap none that has entered."""
    free = np.empty(points.shape[1], np.bool_)
    _tier(_find_free, points)(cells, points, radius, free)
    return free


def enter_free(cells: CellLists, points: Floats, numbers: NDArray[np.int64], done: NDArray[np.bool_]) -> None:
    """Enter balls with these numbers, which may repeat, at points (3, n) where they overlap none.

    `done` marks the balls that have entered; no ball may be larger than they are.
    """
    _tier(_enter_free, points)(cells, points, numbers, done)


def overlaps_of(position: Floats, radius: Floats, period: tuple[float | None, ...] | None = None) -> Overlaps | None:
    """Return the overlaps of balls at positions (3, N), and with images if periodic, or None without overlaps."""
    low, high = position.min(axis=1), position.max(axis=1)
    cells, found = empty_cells(low, high, period, radius), np.zeros(4)
    _tier(_enter_all, position)(cells, position, order_of(radius), found)
    if found[0] == 0.0:
        return None
    first, second = sorted((int(found[1]), int(found[2])))
    return Overlaps(int(found[0]), (first, second), float(found[3]))


def _tier(kernel: Any, points: Floats) -> Any:
    return cache.in_python(kernel) if points.shape[1] <= _FEW else kernel

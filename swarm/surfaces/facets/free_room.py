"""The free blocks around the cells of a grid of facets: most cells are empty, and a flight leaps through these.

Each row of `FacetCells.room` is eight whole numbers. For an empty cell: how many cells before and behind it along x,
y, z are empty too, all together a block, and whether it is admissible. For a cell with facets: a cone of their
normals, and the number of its spare entries.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import index
from ...kernel.jit import kernel, outlined, select
from ...kernel.record import Record
from ...kernel.vector import Vec, dot, norm

# The place of the kind of a cell (it holds facets, is admissible, or is not), of the sine of a cone, and of the number
# of spare entries of a cell with facets.
KIND, SINE, _SPARE = 6, 7, 3
FULL, FREE, CLOSED = 0, 1, -1
_FULL = 127.0
# A sine that no cone has: normals in all directions. Other sines are enlarged a little, for whole numbers.
_WIDEST, _MORE = 126.0, 3.0
# The sine of a cone that every flight leaves, for any change of its velocity.
_LEFT = -2.0 * _FULL
# The farthest leap, in cells, and the longest step of a block that grows.
_FARTHEST, _LONGEST = 120, 64


class FreeCells(Record):
    """The cells around a cell that a flight may leap through, along x, y, z."""

    back: Vec
    ahead: Vec


class NormalCone(Record):
    """A cone of normals: its axis, and the sine of its half-angle, both in units of 1/`_FULL`."""

    axis: Vec
    sine: float

    def is_left(self, v, change=0.0):
        """Whether a flight surely moves away from facets with these normals, while v changes by at most `change`."""
        return dot(self.axis, v) + _FULL * change < -self.sine * (norm(v) + change)


def room_of(rows, cell):
    """Return the free cells around a cell, none around one with facets."""
    free = 1.0 if rows[cell, KIND] != FULL else 0.0
    return FreeCells(
        free * Vec(float(rows[cell, 0]), float(rows[cell, 2]), float(rows[cell, 4])),
        free * Vec(float(rows[cell, 1]), float(rows[cell, 3]), float(rows[cell, 5])),
    )


def cone_of(rows, cell):
    """Return the cone of the normals of a cell; without facets one that every flight leaves."""
    is_full = rows[cell, KIND] == FULL
    axis = Vec(float(rows[cell, 0]), float(rows[cell, 1]), float(rows[cell, 2]))
    return NormalCone(select(is_full, 1.0, 0.0) * axis, select(is_full, float(rows[cell, SINE]), _LEFT))


def spare_of(rows, cell):
    """Return the number of spare entries of a cell."""
    return select(rows[cell, KIND] == FULL, int(rows[cell, _SPARE]), 0)


def rows_of(counts: NDArray[np.int32], places: NDArray[np.int32]) -> NDArray[np.int8]:
    """Return the rows of cells with `counts` entries in `places` places: empty cells have no block."""
    rows = np.zeros((len(counts), 8), np.int8)
    rows[:, KIND] = np.where(counts > 0, FULL, FREE)
    rows[:, _SPARE] = places - counts
    return rows


def without_entries(rows: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return the rows for cells without entries."""
    rows = rows.copy()
    rows[rows[:, KIND] == FULL, _SPARE] = 0
    return rows


def with_cones(rows: NDArray[np.int8], normals: NDArray[Any], entries: NDArray[Any], first: NDArray[Any]) -> None:
    """Write the cones of the cells with facets.

    Args:
        rows: the rows of all cells.
        normals: (T, 3) of the facets.
        entries: the entries of all cells.
        first: where the entries of each cell begin.
    """
    full = np.flatnonzero(rows[:, KIND] == FULL)
    counts = (first[1:] - first[:-1])[full] - rows[full, _SPARE]
    starts = np.concatenate([[0], np.cumsum(counts)])
    places = np.arange(starts[-1]) + np.repeat(first[full] - starts[:-1], counts)
    normals, first = normals[entries[places]], starts[:-1]
    axis = np.add.reduceat(normals, first, axis=0)
    length = np.linalg.norm(axis, axis=1)
    axis /= np.maximum(length, 1e-300)[:, None]
    cosine = np.minimum.reduceat((normals * np.repeat(axis, counts, axis=0)).sum(axis=1), first)
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    sine = np.where((cosine > 0.1) & (length > 0.1), np.minimum(np.ceil(_FULL * sine) + _MORE, _FULL), _FULL)
    rows[full, :3] = np.rint(axis * _WIDEST)
    rows[full, SINE] = sine


def with_blocks(rows: NDArray[np.int8], held: NDArray[np.bool_]) -> None:
    """Write the blocks of the free cells."""
    from scipy.ndimage import distance_transform_cdt

    sums = np.zeros(tuple(n + 1 for n in held.shape), np.int32)
    sums[1:, 1:, 1:] = held.cumsum(axis=0, dtype=np.int32).cumsum(axis=1).cumsum(axis=2)
    leaps = np.minimum(distance_transform_cdt(~held, "chessboard"), _FARTHEST).astype(np.int8)
    if not held.any():
        leaps[:] = 1
    _grow(rows, sums, leaps)


@kernel
def _grow(rows, sums, leaps):
    """Grow a block around every free cell, in all directions by turns."""
    nx, ny, nz = leaps.shape
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                cell = index((x * ny + y) * nz + z)
                if rows[cell, KIND] == FREE:
                    _grow_one(rows, cell, sums, (x, y, z), int(leaps[x, y, z]) - 1)


@outlined
def _grow_one(rows, cell, sums, place, leap):
    x, y, z = place
    nx, ny, nz = sums.shape[0] - 1, sums.shape[1] - 1, sums.shape[2] - 1
    x0, x1 = max(x - leap, 0), min(x + leap, nx - 1) + 1
    y0, y1 = max(y - leap, 0), min(y + leap, ny - 1) + 1
    z0, z1 = max(z - leap, 0), min(z + leap, nz - 1) + 1
    step, shrinks = 1, False
    while step > 0:
        low, high = max(x0 - step, max(x - _FARTHEST, 0)), min(x1 + step, min(x + _FARTHEST, nx - 1) + 1)
        x0 = low if _sum(sums, low, x0, y0, y1, (z0, z1)) == 0 else x0
        x1 = high if _sum(sums, x1, high, y0, y1, (z0, z1)) == 0 else x1
        low, high = max(y0 - step, max(y - _FARTHEST, 0)), min(y1 + step, min(y + _FARTHEST, ny - 1) + 1)
        y0 = low if _sum(sums, x0, x1, low, y0, (z0, z1)) == 0 else y0
        y1 = high if _sum(sums, x0, x1, y1, high, (z0, z1)) == 0 else y1
        low, high = max(z0 - step, max(z - _FARTHEST, 0)), min(z1 + step, min(z + _FARTHEST, nz - 1) + 1)
        z0 = low if _sum(sums, x0, x1, y0, y1, (low, z0)) == 0 else z0
        z1 = high if _sum(sums, x0, x1, y0, y1, (z1, high)) == 0 else z1
        shrinks = shrinks or step >= _LONGEST
        step = step // 2 if shrinks else 2 * step
    rows[cell, 0], rows[cell, 1] = x - x0, x1 - 1 - x
    rows[cell, 2], rows[cell, 3] = y - y0, y1 - 1 - y
    rows[cell, 4], rows[cell, 5] = z - z0, z1 - 1 - z


def _sum(sums, x0, x1, y0, y1, along_z):
    """Return the number of cells of a block that hold facets."""
    z0, z1 = along_z
    a, b, c, d = index(x0), index(x1), index(y0), index(y1)
    e, f = index(z0), index(z1)
    over = int(sums[b, d, f]) - int(sums[a, d, f]) - int(sums[b, c, f]) + int(sums[a, c, f])
    under = int(sums[b, d, e]) - int(sums[a, d, e]) - int(sums[b, c, e]) + int(sums[a, c, e])
    return over - under

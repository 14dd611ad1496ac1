"""Which bodies reach into which cells: how the grid of a field is made."""

from typing import Any

import numpy as np

from ...kernel import cache
from ...kernel.arrays import index
from ...kernel.jit import kernel
from ...kernel.vector import Vec, vec
from .grid import MARGIN, Floats, Grid, cells_of
from .members import gathered

# So many bodies are entered in plain Python: to compile what does it takes a second.
_SOME = 2000


def grid_of(
    like: Any, table: Floats, bounds: tuple[Floats, Floats], repeated: tuple[Floats, Floats] | None = None
) -> Grid:
    """The grid of the bodies of a table.

    Args:
        like: the numbers of one of them.
        table: those of all, one in each row.
        bounds: lowest and highest corner of each body (3, n), infinite where it has no end [m].
        repeated: the corners (3,) of the cell of the scene that repeats, infinite where it does not; None: none does.
    """
    corner, shape, width = cells_of(*bounds, repeated)
    low, wide, inverse, margin, along = (
        vec(row.tolist()) for row in (corner, width, 1.0 / width, MARGIN * width, shape)
    )
    first, nothing = np.zeros(int(shape.prod()) + 2, np.int32), np.empty(0, np.int32)
    grid = Grid(low, wide, inverse, margin, along, first, nothing)
    enter = cache.in_python(_enter) if len(table) <= _SOME else _enter
    # Each body counts in the cell after its own, so that the sums are where the entries of a cell begin.
    enter(like, table, bounds, grid, first[1:], nothing)
    np.cumsum(first, out=first)
    entries = np.empty(first[-1], np.int32)
    enter(like, table, bounds, grid, first[:-1].copy(), entries)
    return grid._replace(entries=entries)


@kernel
def _enter(like, table, bounds, grid, place, entries):
    """Write every body to the place of each cell that it reaches into; count them where there are no `entries`."""
    low, high = bounds
    n, margin = grid.shape, Vec(2.0 * grid.margin.x, 2.0 * grid.margin.y, 2.0 * grid.margin.z)
    for m in range(table.shape[0]):
        body = gathered(like, table, index(m), 0)
        x, x_end = _layers(low[0, m] - margin.x - grid.low.x, high[0, m] + margin.x - grid.low.x, grid.width.x, n.x)
        y, y_end = _layers(low[1, m] - margin.y - grid.low.y, high[1, m] + margin.y - grid.low.y, grid.width.y, n.y)
        z, z_end = _layers(low[2, m] - margin.z - grid.low.z, high[2, m] + margin.z - grid.low.z, grid.width.z, n.z)
        for i in range(x, x_end):
            for j in range(y, y_end):
                for k in range(z, z_end):
                    near = grid.low + Vec(i * grid.width.x, j * grid.width.y, k * grid.width.z)
                    far = grid.low + Vec((i + 1.0) * grid.width.x, (j + 1.0) * grid.width.y, (k + 1.0) * grid.width.z)
                    if body.may_reach(near - margin, far + margin):
                        cell = int((i * n.y + j) * n.z + k)
                        if entries.size > 0:
                            entries[place[cell]] = m
                        place[cell] += 1


def _layers(begin, end, width, count):
    """The layers of cells between two places, from the first to the one after the last."""
    first, last = np.floor(begin / width), np.floor(end / width)
    return int(min(max(first, 0.0), count - 1.0)), int(min(max(last, 0.0), count - 1.0)) + 1

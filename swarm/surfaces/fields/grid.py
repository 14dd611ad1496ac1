"""The grid of many bodies: the width of its cells, and the bodies that reach into each."""

from functools import partial
from typing import Any

import numpy as np

from ...kernel import cache
from ...kernel.arrays import index
from ...kernel.grid import ENDLESS, MARGIN, Grid, filled_grid, layer_of, number_of
from ...kernel.jit import kernel
from ...kernel.limits import TINY
from ...kernel.vector import Vec
from ...state import Floats
from .members import gathered

# Cells for each body: a flight through more cells tests fewer bodies in each.
_CELLS_EACH = 1.0
# The least extent along an axis, as a part of the largest.
_FLAT = 1e-3
# Up to this number of bodies are entered in plain Python: compiling the kernel takes a second.
_SOME = 2000


def cells_of(low: Floats, high: Floats, repeated: tuple[Floats, Floats] | None) -> tuple[Floats, Floats, Floats]:
    """Return the corner of the grid, the number of its cells along each axis, and their widths."""
    first, last, bodies = low.min(axis=1), high.max(axis=1), low.shape[1]
    if repeated is not None:
        first, last = np.maximum(first, repeated[0]), np.minimum(last, repeated[1])
        middle = 0.5 * (low + high)
        bodies = (
            ((middle >= repeated[0][:, None]) & (middle < repeated[1][:, None]) | np.isnan(middle)).all(axis=0).sum()
        )
    endless = ~((first > -0.5 * ENDLESS) & (last < 0.5 * ENDLESS))
    extent = np.where(endless, 1.0, last - first)
    # Flat bodies in one plane have cells before and behind them.
    extent = np.where(endless, 1.0, np.maximum(extent, _FLAT * np.where(endless, 0.0, extent).max()))
    each = extent[~endless].prod() / (_CELLS_EACH * max(1, bodies))
    side = each ** (1.0 / max(1, (~endless).sum()))
    if repeated is not None:
        # Cells begin and end at the faces, if bodies are near: a thin layer in front of a face is one more to cross.
        first = np.where(first - repeated[0] < side, repeated[0], first)
        last = np.where(repeated[1] - last < side, repeated[1], last)
        extent = np.where(endless, 1.0, last - first)
    shape = np.where(endless, 1.0, np.maximum(np.rint(extent / max(side, TINY)), 1.0))
    # A little wider than the bodies, so that a flight from outside enters the grid before it meets one.
    room = 4.0 * MARGIN * extent
    before = behind = room
    if repeated is not None:
        before, behind = np.where(first > repeated[0], room, 0.0), np.where(last < repeated[1], room, 0.0)
    width = np.where(endless, ENDLESS, (extent + before + behind) / shape)
    return np.where(endless, -0.5 * ENDLESS, first - before), shape, width


def grid_of(
    like: Any, table: Floats, bounds: tuple[Floats, Floats], repeated: tuple[Floats, Floats] | None = None
) -> Grid:
    """Return the grid of the bodies of a table.

    Args:
        like: the numbers of one body.
        table: the numbers of all bodies, one body in each row.
        bounds: lowest and highest corner of each body (3, n), infinite along an axis on which it has no end [m].
        repeated: the corners (3,) of the periodic cell of the scene, infinite along axes without a period, or None.
    """
    enter = cache.in_python(enter_bodies) if len(table) <= _SOME else enter_bodies
    return filled_grid(*cells_of(*bounds, repeated), partial(enter, like, table, bounds))


@kernel
def enter_bodies(like, table, bounds, grid, place, entries):
    """Write every body to the place of each cell that it reaches into; count the bodies if there are no `entries`."""
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
                        cell = int(number_of(n, i, j, k))
                        if entries.size > 0:
                            entries[place[cell]] = m
                        place[cell] += 1


def _layers(begin, end, width, count):
    """Return the layers of cells between two places, from the first to the one after the last."""
    return int(layer_of(begin / width, count)), int(layer_of(end / width, count)) + 1

"""A uniform grid of cells around many bodies, and which of them reach into each."""

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import index
from ...kernel.jit import Array, select
from ...kernel.record import Record
from ...kernel.vector import Vec
from ..time_of_impact.course import rise_time
from ..time_of_impact.rising import Bounds

# A flight ends this part of a cell beyond the cell's wall, where no round-off takes it back; what reaches into a cell
# is what comes nearer to it than twice that.
MARGIN = 1e-6
# Cells for each body: a flight through more of them looks at fewer bodies in each.
_CELLS_EACH = 1.0
# An endless direction is one cell of this width, and a body without end has bounds beyond half of it.
_ENDLESS = 1e200

# Bytes of a line of the cache.
_LINE = 64

Floats = NDArray[np.float64]


class Grid(Record):
    """Cells from `low` on, numbered along z first; the one after the last stands for all that is outside."""

    low: Vec
    width: Vec
    inverse: Vec  # 1/width
    margin: Vec
    shape: Vec  # how many cells along x, y, z
    first: Array  # int32, where the entries of a cell begin
    entries: Array  # int32, the bodies


class GridCell(Record):
    """The cell of a point: its number, its place along x, y, z, and whether it is one of the grid."""

    number: int
    place: Vec
    inside: bool


# --- Where a flight is -----------------------------------------------------------------------------------


def cell_of(grid, r):
    """The `GridCell` of a point."""
    n, d = grid.shape, r - grid.low
    x = _place(d.x, grid.inverse.x, n.x)
    y = _place(d.y, grid.inverse.y, n.y)
    z = _place(d.z, grid.inverse.z, n.z)
    inside = (x >= 0.0) & (x < n.x) & (y >= 0.0) & (y < n.y) & (z >= 0.0) & (z < n.z)
    return GridCell(int(select(inside, (x * n.y + y) * n.z + z, n.x * n.y * n.z)), Vec(x, y, z), inside)


def _place(d, inverse, count):
    """The layer of cells, the outermost ones a little wider: where a flight leaves the grid it goes farther.

    What is before the first is -1, and beyond the last `count`: layers without end, whose other wall is like any other.
    """
    place = d * inverse
    layer, last = np.floor(place), count - 1.0
    layer = select(layer < 0.0, 0.0, select(layer > last, last, layer))
    return select(place < -0.5 * MARGIN, -1.0, select(place >= count + 0.5 * MARGIN, count, layer))


class Block(Record):
    """Cells from one place on, so many along x, y, z."""

    x: int
    y: int
    z: int
    along_x: int
    along_y: int
    along_z: int


def block_of(grid, low, high):
    """The cells of the grid that a box with these corners reaches into."""
    first, last = cell_of(grid, low).place, cell_of(grid, high).place
    x, y, z = int(max(first.x, 0.0)), int(max(first.y, 0.0)), int(max(first.z, 0.0))
    return Block(
        x, y, z,
        int(min(last.x, grid.shape.x - 1.0)) - x + 1,
        int(min(last.y, grid.shape.y - 1.0)) - y + 1,
        int(min(last.z, grid.shape.z - 1.0)) - z + 1,
    )  # fmt: skip


def over_block(grid, block, found, ask, *given):
    """`found` after ask(found, m, *given) for each body m of the cells of a block."""
    for k in range(max(block.along_x, 0) * max(block.along_y, 0) * max(block.along_z, 0)):
        x, y, z = k // (block.along_z * block.along_y), k // block.along_z % block.along_y, k % block.along_z
        number = ((block.x + x) * grid.shape.y + block.y + y) * grid.shape.z + block.z + z
        for entry in range(grid.first[index(int(number))], grid.first[index(int(number)) + 1]):
            found = ask(found, grid.entries[entry], *given)
    return found


def until_next(gravity, grid, cell, r, v):
    """When a flight is beyond the wall of its cell; from outside, until when it surely does not come into the grid."""
    p, n = cell.place, grid.shape
    x = _along(gravity, 0, (grid.low.x, grid.width.x, grid.margin.x, n.x), p.x, r.x, v.x)
    y = _along(gravity, 1, (grid.low.y, grid.width.y, grid.margin.y, n.y), p.y, r.y, v.y)
    z = _along(gravity, 2, (grid.low.z, grid.width.z, grid.margin.z, n.z), p.z, r.z, v.z)
    leaves = select(y < x, y, x)
    in_x, in_y, in_z = _comes(x, p.x, n.x), _comes(y, p.y, n.y), _comes(z, p.z, n.z)
    enters = select(in_y > in_x, in_y, in_x)
    return select(cell.inside, select(z < leaves, z, leaves), select(in_z > enters, in_z, enters))


def _comes(time, place, count):
    """When a flight comes into the layers of cells, 0 where it is in them."""
    return select((place >= 0.0) & (place < count), 0.0, time)


def _along(gravity, axis, cells, place, x, v):
    """When a flight leaves its layer of cells, (low, width, margin, how many) of which are given.

    Of a flight beside them, before when it does not come in. Where of its acceleration there is only a bound, at the
    soonest.
    """
    low, width, margin, count = cells
    if gravity is None:
        ahead = v > 0.0
        edge = low + (place + select(ahead, 1.0, 0.0)) * width + select(ahead, margin, -margin)
        never = (v == 0.0) | select(ahead, place >= count, place < 0.0)
        return select(never, np.inf, (edge - x) / v)
    among, below = (place >= 0.0) & (place < count), place < 0.0
    sign, face = select(below, 1.0, -1.0), select(below, low + margin, low + count * width - margin)
    b = 0.5 * v
    if isinstance(gravity, Bounds):
        # Whatever its direction
        ahead = towards = back = 0.5 * gravity.acceleration
    else:
        a = 0.5 * (gravity.x if axis == 0 else gravity.y if axis == 1 else gravity.z)
        ahead, towards, back = a, sign * a, -a
    up = rise_time(
        select(among, x - (low + (place + 1.0) * width + margin), sign * (x - face)),
        select(among, b, sign * b),
        select(among, ahead, towards),
    )
    down = rise_time(low + place * width - margin - x, -b, back)
    return select(among & (down < up), down, up)


# --- How it is made --------------------------------------------------------------------------------------


def one_cell(bodies: int) -> Grid:
    """The grid of so many bodies that all are looked at."""
    low, width, margin = (Vec(*3 * [size]) for size in (-0.5 * _ENDLESS, _ENDLESS, MARGIN * _ENDLESS))
    entries, first = np.arange(bodies, dtype=np.int32), np.array([0, bodies, bodies], np.int32)
    return Grid(low, width, Vec(*3 * [1.0 / _ENDLESS]), margin, Vec(1.0, 1.0, 1.0), first, entries)


def cells_of(low: Floats, high: Floats, repeated: tuple[Floats, Floats] | None) -> tuple[Floats, Floats, Floats]:
    """The corner of the grid, how many cells it has along each axis, and how wide they are."""
    first, last, bodies = low.min(axis=1), high.max(axis=1), low.shape[1]
    if repeated is not None:
        first, last = np.maximum(first, repeated[0]), np.minimum(last, repeated[1])
        middle = 0.5 * (low + high)
        bodies = (
            ((middle >= repeated[0][:, None]) & (middle < repeated[1][:, None]) | np.isnan(middle)).all(axis=0).sum()
        )
    endless = ~((first > -0.5 * _ENDLESS) & (last < 0.5 * _ENDLESS))
    extent = np.where(endless, 1.0, last - first)
    each = extent[~endless].prod() / (_CELLS_EACH * max(1, bodies))
    side = each ** (1.0 / max(1, (~endless).sum()))
    if repeated is not None:
        # Cells begin and end at the faces, if bodies are near: a thin layer in front of a face is one more to cross.
        first = np.where(first - repeated[0] < side, repeated[0], first)
        last = np.where(repeated[1] - last < side, repeated[1], last)
        extent = np.where(endless, 1.0, last - first)
    shape = np.where(endless, 1.0, np.maximum(np.rint(extent / max(side, np.finfo(np.float64).tiny)), 1.0))
    # A little wider than the bodies, so that a flight from outside comes in before it meets one.
    room = 4.0 * MARGIN * extent
    before, behind = (room, room) if repeated is None else _room_up_to(repeated, first, last, room)
    width = np.where(endless, _ENDLESS, (extent + before + behind) / shape)
    return np.where(endless, -0.5 * _ENDLESS, first - before), shape, width


def _room_up_to(repeated: tuple[Floats, Floats], first: Floats, last: Floats, room: Floats) -> tuple[Floats, Floats]:
    """The room before and behind the bodies, none at the faces of a cell that repeats."""
    return np.where(first > repeated[0], room, 0.0), np.where(last < repeated[1], room, 0.0)


def aligned(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """A copy of a table that begins with a line of the cache."""
    memory = np.empty(rows.nbytes + _LINE, np.uint8)
    first = -memory.ctypes.data % _LINE
    copy = memory[first : first + rows.nbytes].view(np.float64).reshape(rows.shape)
    copy[:] = rows
    return copy

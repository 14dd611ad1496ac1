"""A uniform grid of cells: which cell a point is in, what is in a cell, and when a flight is in the next one.

The entries of a cell are `entries[first[cell]:first[cell + 1]]`, in the order in which they were entered; where more
is known of cells, without the last of these, of which it says how many are `spare`.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..state import Floats
from .arrays import index
from .gravity import NEVER, Quotient, rise_quotient, rise_time
from .jit import Array, select
from .record import Record
from .vector import Vec, vec

# A flight ends this part of a cell beyond the cell's wall, where no round-off takes it back; what reaches into a cell
# is what comes nearer to it than twice that.
MARGIN = 1e-6
# An endless direction is one cell of this width, and what has no end has bounds beyond half of it.
ENDLESS = 1e200


class Grid(Record):
    """Cells from `low` on, numbered along z first; the one after the last stands for all that is outside."""

    low: Vec
    width: Vec
    inverse: Vec  # 1/width
    margin: Vec
    shape: Vec  # how many cells along x, y, z
    first: Array  # int32, where the entries of a cell begin
    entries: Array  # int32
    known: Any = None  # a record of what else is known of the cells


class GridCell(Record):
    """The cell of a point: its number, its place along x, y, z, and whether it is one of the grid."""

    number: int
    place: Vec
    inside: bool


class MostPull(Record):
    """Of an acceleration along an axis the most that it is, and that it is the other way."""

    up: Any
    down: Any


# --- The cell of a point ---------------------------------------------------------------------------------


def cell_of(grid, r):
    """The `GridCell` of a point."""
    n, d = grid.shape, r - grid.low
    x = _place(d.x, grid.inverse.x, n.x)
    y = _place(d.y, grid.inverse.y, n.y)
    z = _place(d.z, grid.inverse.z, n.z)
    inside = (x >= 0.0) & (x < n.x) & (y >= 0.0) & (y < n.y) & (z >= 0.0) & (z < n.z)
    return GridCell(int(select(inside, number_of(n, x, y, z), n.x * n.y * n.z)), Vec(x, y, z), inside)


def number_of(shape, x, y, z):
    """The number of the cell at a place."""
    return (x * shape.y + y) * shape.z + z


def layer_of(place, count):
    """The layer of cells that a coordinate, in cells from the first on, is in; the outermost layers have no end."""
    layer, last = np.floor(place), count - 1.0
    return select(layer < 0.0, 0.0, select(layer > last, last, layer))


def wrapped(layer, count):
    """The layer of cells along a periodic axis that one beside its ends is."""
    return select(layer < 0, layer + count, select(layer >= count, layer - count, layer))


def _place(d, inverse, count):
    """The layer of cells, the outermost ones a little wider: where a flight leaves the grid it goes farther.

    What is before the first is -1, and beyond the last `count`: layers without end; their other wall is like any other.
    """
    place = d * inverse
    outside = select(place >= count + 0.5 * MARGIN, count, layer_of(place, count))
    return select(place < -0.5 * MARGIN, -1.0, outside)


# --- What is in cells ------------------------------------------------------------------------------------


def entries_of(grid, number):
    """The begin and the end of the entries of the cell with this number."""
    cell = index(number)
    begin, end = grid.first[cell], grid.first[cell + index(1)]
    return begin, end if grid.known is None else end - grid.known.spare(cell)


def entries_at(grid, r):
    """The begin and the end of the entries of the cell of a point."""
    return entries_of(grid, cell_of(grid, r).number)


class Block(Record):
    """Cells from one place on, so many along each axis."""

    place: Vec
    along: Vec


def block_of(grid, low, high):
    """The cells of the grid that a box with these corners reaches into."""
    first, last = cell_of(grid, low).place, cell_of(grid, high).place
    place = Vec(*(int(max(one, 0.0)) for one in first))
    ends = zip(place, last, grid.shape, strict=True)
    return Block(place, Vec(*(int(min(one, count - 1.0)) - begin + 1 for begin, one, count in ends)))


def over_entries(grid, block, found, ask, *given):
    """`found` after ask(found, m, *given) for each entry m of the cells of a block."""
    place, along = block
    for k in range(max(along.x, 0) * max(along.y, 0) * max(along.z, 0)):
        x, y, z = k // (along.z * along.y), k // along.z % along.y, k % along.z
        begin, end = entries_of(grid, int(number_of(grid.shape, place.x + x, place.y + y, place.z + z)))
        for entry in range(begin, end):
            found = ask(found, grid.entries[entry], *given)
    return found


# --- From cell to cell -----------------------------------------------------------------------------------


def until_next(gravity, grid, cell, r, v):
    """When a flight is beyond the wall of its cell; from outside, until when it surely does not come into the grid.

    Of its acceleration along each axis there may be a `MostPull` only.
    """
    pulls = 3 * (None,) if gravity is None else gravity
    layers = zip(grid.low, grid.width, grid.margin, grid.shape, strict=True)
    flight = zip(layers, cell.place, r, v, pulls, strict=True)
    x, y, z = (_until_next_layer(*one) for one in flight)
    p, n, leaves = cell.place, grid.shape, select(y < x, y, x)
    in_x, in_y, in_z = _comes(x, p.x, n.x), _comes(y, p.y, n.y), _comes(z, p.z, n.z)
    enters = select(in_y > in_x, in_y, in_x)
    return select(cell.inside, select(z < leaves, z, leaves), select(in_z > enters, in_z, enters))


def _comes(time, place, count):
    """When a flight comes into the layers of cells, 0 where it is in them."""
    return select((place >= 0.0) & (place < count), 0.0, time)


def _until_next_layer(layers, place, x, v, pull):
    """When a flight leaves its layer of cells (low, width, margin, count); beside them, before when it is in none.

    Where of its acceleration there is only a bound, at the soonest.
    """
    low, width, margin, count = layers
    if pull is None:
        never = select(v > 0.0, place >= count, place < 0.0)
        return select(never, np.inf, _until_edge((low, width, margin), place, place, x, v))
    among, below = (place >= 0.0) & (place < count), place < 0.0
    sign, face = select(below, 1.0, -1.0), select(below, low + margin, low + count * width - margin)
    b = 0.5 * v
    if isinstance(pull, MostPull):
        ahead, back = 0.5 * pull.up, 0.5 * pull.down
        towards = select(below, ahead, back)
    else:
        ahead, towards, back = 0.5 * pull, sign * (0.5 * pull), -(0.5 * pull)
    up = rise_time(
        select(among, x - (low + (place + 1.0) * width + margin), sign * (x - face)),
        select(among, b, sign * b),
        select(among, ahead, towards),
    )
    down = rise_time(low + place * width - margin - x, -b, back)
    return select(among & (down < up), down, up)


def until_out(gravity, grid, first, last, r, v):
    """When a flight among the cells from one place to another one has left these."""
    layers = zip(grid.low, grid.width, grid.margin, strict=True)
    pulls = 3 * (None,) if gravity is None else gravity
    x, y, z = (_until_out_of_layers(*one) for one in zip(layers, first, last, r, v, pulls, strict=True))
    return x.sooner(y).sooner(z).time()


def _until_out_of_layers(layers, first, last, x, v, pull):
    """When a flight leaves layers of cells, and a margin, as a `Quotient`. Branch-free, and with one root only.

    Where of its acceleration there is only a bound, at the soonest.
    """
    low, width, margin = layers
    if pull is None:
        return _edge_quotient(layers, first, last, x, v)
    below, above = low + first * width - margin, low + (last + 1.0) * width + margin
    if isinstance(pull, MostPull):
        up = rise_quotient(x - above, 0.5 * v, 0.5 * pull.up)
        return up.sooner(rise_quotient(below - x, -0.5 * v, 0.5 * pull.down))
    # Towards the side to which it is pulled it leaves, unless it leaves before through the other one.
    turned = pull < 0.0
    a, b = 0.5 * abs(pull), 0.5 * select(turned, -v, v)
    ahead, behind = select(turned, x - below, above - x), select(turned, above - x, x - below)
    backwards = (b < 0.0) & (b * b >= a * behind)
    # NaN, and no error in plain Python, of a flight that is outside of these layers, of which nothing is asked.
    root = np.sqrt(b * b + a * select(backwards, -behind, ahead))
    over = select(backwards, behind, select(b > 0.0, ahead, root - b))
    under = select(backwards, root - b, select(b > 0.0, root + b, a))
    return Quotient(*select(under > 0.0, (over, under), tuple(NEVER)))


def _edge_quotient(layers, first, last, x, v):
    """When a straight flight leaves layers of cells, and a margin, as a `Quotient`."""
    way = _edge(layers, first, last, v) - x
    return Quotient(*select(v == 0.0, tuple(NEVER), (select(v > 0.0, way, -way), abs(v))))


def _until_edge(layers, first, last, x, v):
    """The same as a time, where it is that of one axis."""
    return select(v == 0.0, np.inf, (_edge(layers, first, last, v) - x) / v)


def _edge(layers, first, last, v):
    """Where a straight flight leaves them."""
    (low, width, margin), ahead = layers, v > 0.0
    return low + select(ahead, last + 1.0, first) * width + select(ahead, margin, -margin)


# --- How it is made --------------------------------------------------------------------------------------


def one_cell(count: int) -> Grid:
    """The grid of so many entries that all are looked at."""
    low, width, margin = (Vec(*3 * [size]) for size in (-0.5 * ENDLESS, ENDLESS, MARGIN * ENDLESS))
    entries, first = np.arange(count, dtype=np.int32), np.array([0, count, count], np.int32)
    return Grid(low, width, Vec(*3 * [1.0 / ENDLESS]), margin, Vec(1.0, 1.0, 1.0), first, entries)


def filled_grid(
    low: Floats, shape: Floats, width: Floats, enter: Callable[[Grid, Any, Any], None], margin: float = MARGIN
) -> Grid:
    """The grid of cells from a corner on, filled by a counting sort.

    Args:
        low: the corner of the first cell (3,) [m].
        shape: how many cells there are along each axis.
        width: how wide they are [m].
        enter: `enter(grid, place, entries)` writes each entry to the place of each cell that it is in, which is then
            one more; where `entries` has no room it only counts.
        margin: the part of a cell that a flight ends beyond its wall.
    """
    first, nothing = np.zeros(int(shape.prod()) + 2, np.int32), np.empty(0, np.int32)
    grid = Grid(*(vec(row.tolist()) for row in (low, width, 1.0 / width, margin * width, shape)), first, nothing)
    # What is in a cell counts in the one after it, so that the sums are where the entries of a cell begin.
    enter(grid, first[1:], nothing)
    np.cumsum(first, out=first)
    entries = np.empty(first[-1], np.int32)
    enter(grid, first[:-1].copy(), entries)
    return grid._replace(entries=entries)

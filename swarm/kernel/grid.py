"""A uniform grid of cells: the cell of a point, the entries of a cell, and the time until a flight is in the next cell.

The entries of a cell are `entries[first[cell]:first[cell + 1]]`, in the order in which they were entered; if `known` is
set, without the last `spare` entries of the cell.
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

# A flight ends this part of a cell beyond the cell's wall, so that round-off does not take it back; the entries of a
# cell are all things nearer to it than twice this.
MARGIN = 1e-6
# An endless direction has one cell of this width, and endless things have bounds beyond half of it.
ENDLESS = 1e200


class Grid(Record):
    """Cells from `low` on, numbered along z first; the cell after the last one stands for all outside."""

    low: Vec
    width: Vec
    inverse: Vec  # 1/width
    margin: Vec
    shape: Vec  # the number of cells along x, y, z
    first: Array  # int32, the first entry of each cell
    entries: Array  # int32
    known: Any = None  # a record of further data of the cells


class GridCell(Record):
    """The cell of a point: its number, its place along x, y, z, and whether it is a cell of the grid."""

    number: int
    place: Vec
    inside: bool


class MostPull(Record):
    """Bounds of an acceleration along an axis: its largest value, and its largest value in the opposite direction."""

    up: Any
    down: Any


# --- The cell of a point ---------------------------------------------------------------------------------


def cell_of(grid, r):
    """Return the `GridCell` of a point."""
    n, d = grid.shape, r - grid.low
    x = _place(d.x, grid.inverse.x, n.x)
    y = _place(d.y, grid.inverse.y, n.y)
    z = _place(d.z, grid.inverse.z, n.z)
    inside = (x >= 0.0) & (x < n.x) & (y >= 0.0) & (y < n.y) & (z >= 0.0) & (z < n.z)
    return GridCell(int(select(inside, number_of(n, x, y, z), n.x * n.y * n.z)), Vec(x, y, z), inside)


def number_of(shape, x, y, z):
    """Return the number of the cell at a place."""
    return (x * shape.y + y) * shape.z + z


def layer_of(place, count):
    """Return the layer of cells of a coordinate, in cells from the first on; the outermost layers have no end."""
    layer, last = np.floor(place), count - 1.0
    return select(layer < 0.0, 0.0, select(layer > last, last, layer))


def wrapped(layer, count):
    """Return the layer of cells along a periodic axis for a layer next to its ends."""
    return select(layer < 0, layer + count, select(layer >= count, layer - count, layer))


def _place(d, inverse, count):
    """Return the layer of cells; the outermost ones are a little wider, as a flight that leaves the grid goes farther.

    A place before the first layer is -1, one beyond the last `count`: these layers have no end outwards.
    """
    place = d * inverse
    outside = select(place >= count + 0.5 * MARGIN, count, layer_of(place, count))
    return select(place < -0.5 * MARGIN, -1.0, outside)


# --- The entries of cells --------------------------------------------------------------------------------


def entries_of(grid, number):
    """Return the first entry of the cell with this number, and the end of its entries."""
    cell = index(number)
    begin, end = grid.first[cell], grid.first[cell + index(1)]
    return begin, end if grid.known is None else end - grid.known.spare(cell)


def entries_at(grid, r):
    """Return the first entry of the cell of a point, and the end of its entries."""
    return entries_of(grid, cell_of(grid, r).number)


class Block(Record):
    """A block of cells: the first one, and their number along each axis."""

    place: Vec
    along: Vec


def block_of(grid, low, high):
    """Return the cells of the grid that a box with these corners reaches."""
    first, last = cell_of(grid, low).place, cell_of(grid, high).place
    place = Vec(*(int(max(one, 0.0)) for one in first))
    ends = zip(place, last, grid.shape, strict=True)
    return Block(place, Vec(*(int(min(one, count - 1.0)) - begin + 1 for begin, one, count in ends)))


def over_entries(grid, block, found, ask, *given):
    """Return `found`, replaced by ask(found, m, *given) for each entry m of the cells of a block."""
    place, along = block
    for k in range(max(along.x, 0) * max(along.y, 0) * max(along.z, 0)):
        x, y, z = k // (along.z * along.y), k // along.z % along.y, k % along.z
        begin, end = entries_of(grid, int(number_of(grid.shape, place.x + x, place.y + y, place.z + z)))
        for entry in range(begin, end):
            found = ask(found, grid.entries[entry], *given)
    return found


# --- From cell to cell -----------------------------------------------------------------------------------


def until_next(gravity, grid, cell, r, v):
    """Return the time until a flight is beyond the wall of its cell; outside, until it surely stays out of the grid.

    The acceleration along each axis may be a bound, `MostPull`.
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
    """Return the time at which a flight enters the layers of cells, 0 if it is in them."""
    return select((place >= 0.0) & (place < count), 0.0, time)


def _until_next_layer(layers, place, x, v, pull):
    """Return the time at which a flight leaves its layer (low, width, margin, count); outside, until it may enter one.

    With a bound of the acceleration it is the earliest possible time.
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
    """Return the time at which a flight has left the cells from one place to another."""
    layers = zip(grid.low, grid.width, grid.margin, strict=True)
    pulls = 3 * (None,) if gravity is None else gravity
    x, y, z = (_until_out_of_layers(*one) for one in zip(layers, first, last, r, v, pulls, strict=True))
    return x.sooner(y).sooner(z).time()


def _until_out_of_layers(layers, first, last, x, v, pull):
    """Return the time at which a flight leaves layers of cells and a margin, as a `Quotient`, branch-free.

    With a bound of the acceleration it is the earliest possible time.
    """
    low, width, margin = layers
    if pull is None:
        return _edge_quotient(layers, first, last, x, v)
    below, above = low + first * width - margin, low + (last + 1.0) * width + margin
    if isinstance(pull, MostPull):
        up = rise_quotient(x - above, 0.5 * v, 0.5 * pull.up)
        return up.sooner(rise_quotient(below - x, -0.5 * v, 0.5 * pull.down))
    # It leaves on the side to which it is pulled, unless it leaves earlier on the other side.
    turned = pull < 0.0
    a, b = 0.5 * abs(pull), 0.5 * select(turned, -v, v)
    ahead, behind = select(turned, x - below, above - x), select(turned, above - x, x - below)
    backwards = (b < 0.0) & (b * b >= a * behind)
    # NaN, without an error in plain Python, for a flight outside of these layers, where the result is not used.
    root = np.sqrt(b * b + a * select(backwards, -behind, ahead))
    over = select(backwards, behind, select(b > 0.0, ahead, root - b))
    under = select(backwards, root - b, select(b > 0.0, root + b, a))
    return Quotient(*select(under > 0.0, (over, under), tuple(NEVER)))


def _edge_quotient(layers, first, last, x, v):
    """Return the time at which a straight flight leaves layers of cells and a margin, as a `Quotient`."""
    way = _edge(layers, first, last, v) - x
    return Quotient(*select(v == 0.0, tuple(NEVER), (select(v > 0.0, way, -way), abs(v))))


def _until_edge(layers, first, last, x, v):
    """Return the time at which a straight flight leaves layers of cells, along one axis."""
    return select(v == 0.0, np.inf, (_edge(layers, first, last, v) - x) / v)


def _edge(layers, first, last, v):
    """Return the place where a straight flight leaves layers of cells."""
    (low, width, margin), ahead = layers, v > 0.0
    return low + select(ahead, last + 1.0, first) * width + select(ahead, margin, -margin)


# --- Construction ----------------------------------------------------------------------------------------


def one_cell(count: int) -> Grid:
    """Return a grid of one cell with `count` entries, which are all tested."""
    low, width, margin = (Vec(*3 * [size]) for size in (-0.5 * ENDLESS, ENDLESS, MARGIN * ENDLESS))
    entries, first = np.arange(count, dtype=np.int32), np.array([0, count, count], np.int32)
    return Grid(low, width, Vec(*3 * [1.0 / ENDLESS]), margin, Vec(1.0, 1.0, 1.0), first, entries)


def filled_grid(
    low: Floats, shape: Floats, width: Floats, enter: Callable[[Grid, Any, Any], None], margin: float = MARGIN
) -> Grid:
    """Return the grid of cells from a corner on, filled by a counting sort.

    Args:
        low: the corner of the first cell (3,) [m].
        shape: the number of cells along each axis.
        width: their width [m].
        enter: `enter(grid, place, entries)` writes each entry to the place of each cell that it is in, and increases
            the place by one; if `entries` has no room it only counts.
        margin: the fraction of a cell at which a flight ends beyond its wall.
    """
    first, nothing = np.zeros(int(shape.prod()) + 2, np.int32), np.empty(0, np.int32)
    grid = Grid(*(vec(row.tolist()) for row in (low, width, 1.0 / width, margin * width, shape)), first, nothing)
    # The entries of a cell are counted in the next one, so that the sums are the first entries of the cells.
    enter(grid, first[1:], nothing)
    np.cumsum(first, out=first)
    entries = np.empty(first[-1], np.int32)
    enter(grid, first[:-1].copy(), entries)
    return grid._replace(entries=entries)

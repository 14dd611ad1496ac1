"""The first hits of all lanes with the facets of a mesh: each lane goes from cell to cell until it meets one.

A mesh that moves takes the same lanes through its cells in its own frame, in_moving_cells.py.

All lanes take a step together, in loops of which those without branches vectorise; then those that have come into a
cell with facets look at these. One lane after the other would wait for each number that it looks up: 4 times as long.
"""

import numpy as np

from ..kernel.arrays import fetch, index, unwritten
from ..kernel.gravity import accelerated, displacement
from ..kernel.grid import cell_of, entries_of, until_next, until_out
from ..kernel.jit import Array, outlined, select
from ..kernel.record import Record
from ..kernel.vector import column, put
from ..surfaces.facets.facet_cells import BLOCK, from_middle, here_in, passes
from ..surfaces.facets.free_room import NormalCone, cone_of, room_of
from ..surfaces.fields.members import member
from ..surfaces.time_of_impact import flights
from .table import STRIDE, marked_lanes

# The hit of a lane, in rows of `course`.
_TIME, _WALL = 0, 1
# So many blocks of entries are looked at together; so many a lane has usually.
_BLOCKS, _USUAL = 256, 2
# So many facets are looked at together.
ROOM = _BLOCKS * BLOCK
# Steps of a lane after which its flight is said to be free so far.
MOST = 4000


class UnderWay(Record):
    """The lanes that are under way, closed up."""

    rows: Array  # `own` rows of a flight at its start, where it is now, and what is known of its cell
    time: Array  # how far it has come
    until: Array  # how far it comes in this step, up to its hit
    wall: Array  # the facet of that hit, or -1
    cell: Array  # int64
    inside: Array  # bool, whether it is in the grid
    owner: Array  # int64, the lane
    last: Array  # the time after which no hit counts

    own = 6

    def begin(self, i, lane, found):
        """A lane with its hit so far at its start."""
        put(self.rows, _START, i, lane.r)
        put(self.rows, _SPEED, i, lane.v)
        self.time[i], self.owner[i] = 0.0, i
        self.last[i] = select(lane.remaining < found, lane.remaining, found)

    def move(self, source, target):
        """One lane into the place of another one."""
        for k in range(self.own):
            self.rows[k, target] = self.rows[k, source]
        self.time[target], self.owner[target] = self.time[source], self.owner[source]
        self.last[target] = self.last[source]

    def until_in(self, gravity, mesh, i):
        """Until when a lane that is outside of the grid surely does not come into it."""
        raise NotImplementedError

    def keep(self, course, i, time, wall):
        """Keep the hit of a lane, if it is the first so far."""
        owner = index(self.owner[i])
        if time < course[_TIME, owner]:
            course[_TIME, owner], course[_WALL, owner] = time, wall

    def go_on(self, gravity, mesh, before, course, n):
        """Every lane to the next cell, or to its hit: how many are under way still."""
        left = 0
        for i in range(index(n)):
            until, wall = self.until[i], self.wall[i]
            if not self.inside[i]:
                until = self.until_in(gravity, mesh, i)
            if wall >= 0.0 or not until < self.last[i]:
                self.keep(course, i, until, select(wall < 0.0, -1.0, wall + before))
                continue
            self.time[i] = until
            if left < i:
                self.move(i, index(left))
            left += 1
        return left


def under_way(kind, rows):
    """Room for lanes that are under way, of that kind with so many rows."""
    return kind(
        unwritten((rows, STRIDE), np.float64), unwritten(STRIDE, np.float64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.float64), unwritten(STRIDE, np.int64),
        unwritten(STRIDE, np.bool_), unwritten(STRIDE, np.int64), unwritten(STRIDE, np.float64),
    )  # fmt: skip


class Under(UnderWay):
    """Those that fly straight or fall, past facets at rest."""

    def now(self, gravity, i):
        """The position and the velocity of a lane now."""
        r, v, t = column(self.rows, _START, i), column(self.rows, _SPEED, i), self.time[i]
        return r + displacement(gravity, v, t), accelerated(gravity, v, t)

    def until_in(self, gravity, mesh, i):
        """As of `UnderWay`."""
        return _until_in(gravity, mesh.grid, self, i)


class Maybe(Record):
    """The facets that lanes may meet in their cells.

    All are looked up before one is looked at: so they are on their way from memory together.
    """

    lane: Array  # int64
    entry: Array  # int64
    facet: Array  # int64

    def look_up(self, facets, some):
        """Look up so many."""
        for j in range(some):
            self.facet[j] = facets.grid.entries[index(self.entry[j])]
            ask_for(facets.table, self.facet[j], facets.table.shape[1])


def maybe_met():
    """Room for them."""
    return Maybe(unwritten(ROOM, np.int64), unwritten(ROOM, np.int64), unwritten(ROOM, np.int64))


class Looks(Record):
    """Blocks of entries, each of which a lane looks at."""

    lane: Array  # int64
    block: Array  # int64

    def take(self, planes, j, lane, block):
        """A look, of which the block is on its way from memory then."""
        self.lane[j], self.block[j] = lane, block
        ask_for(planes, block, planes.shape[1] * planes.shape[2])


def ask_for(table, row, size):
    """Ask for both lines of the cache that a row of a table, of so many numbers, is in."""
    fetch(table, row * size)
    fetch(table, row * size + size // 2)


# Of its rows
_START, _SPEED, _PLACE, _BACK, _AHEAD, _AXIS, _SINE, _PLACES = 0, 3, 6, 9, 12, 15, 18, 19
# Where it is from the middle of its cell, when what is behind it is not asked for any more
_MIDDLE = _BACK


@outlined
def go_through(gravity, facets, before, lanes, live):
    """The first hits of every live lane with facets that have so many walls before them, or that found before."""
    course, under, maybe = lanes.course, under_way(Under, _PLACES), maybe_met()
    looks = Looks(unwritten(_BLOCKS, np.int64), unwritten(_BLOCKS, np.int64))
    for i in range(index(live)):
        under.begin(i, lanes.lane(i), course[_TIME, i])
    n = int(live)
    for _step in range(MOST):
        _find_cells(gravity, facets.grid, under, lanes, n)
        _look(gravity, facets, under, (looks, maybe), lanes.order, marked_lanes(lanes, n))
        n = under.go_on(gravity, facets, before, course, n)
        if n == 0:
            return
    for i in range(index(n)):
        under.keep(course, i, under.time[i], -1.0)


def _find_cells(gravity, cells, under, lanes, n):
    """The cell that every lane is in, how far it comes from there, and whether it may meet a facet on this way."""
    for i in range(index(n)):
        place, _pace = under.now(gravity, i)
        cell = cell_of(cells, place)
        put(under.rows, _PLACE, i, cell.place)
        under.cell[i], under.inside[i] = cell.number, cell.inside
    # What is outside of the grid is in the cell after its last, which holds nothing.
    for i in range(index(n)):
        cell = index(under.cell[i])
        room, cone = room_of(cells.known.room, cell), cone_of(cells.known.room, cell)
        put(under.rows, _BACK, i, room.back)
        put(under.rows, _AHEAD, i, room.ahead)
        put(under.rows, _AXIS, i, cone.axis)
        under.rows[_SINE, i] = cone.sine
    for i in range(index(n)):
        place, pace = under.now(gravity, i)
        at, back, ahead = (column(under.rows, row, i) for row in (_PLACE, _BACK, _AHEAD))
        out = until_out(gravity, cells, at - back, at + ahead, place, pace)
        under.until[i], under.wall[i] = under.time[i] + out, -1.0
        put(under.rows, _MIDDLE, i, from_middle(cells, at, place))
    for i in range(index(n)):
        lanes.marked[i] = _may_meet(gravity, under, i)


def _may_meet(gravity, under, i):
    """Whether a lane may move towards a facet of its cell, at the start of its way through it or at the end."""
    v, cone = column(under.rows, _SPEED, i), NormalCone(column(under.rows, _AXIS, i), under.rows[_SINE, i])
    if gravity is None:
        return not cone.is_left(v)
    now, then = accelerated(gravity, v, under.time[i]), accelerated(gravity, v, under.until[i])
    return not (cone.is_left(now) & cone.is_left(then))


def _look(gravity, facets, under, found, order, n):
    """So many lanes at the facets in their cells, by their planes first."""
    planes, (looks, _maybe), blocks = facets.grid.known.planes, found, index(0)
    for j in range(n):
        i = order[j]
        first, stop = entries_of(facets.grid, under.cell[i])
        begin, end = first // BLOCK, (stop + BLOCK - 1) // BLOCK
        if blocks > _BLOCKS - _USUAL:
            _look_into(gravity, facets, under, found, blocks)
            blocks = index(0)
        # Those that are not its own the next lane writes over: how many there are no processor foresees.
        for k in range(_USUAL):
            looks.take(planes, blocks + index(k), i, begin + k)
        blocks += index(select(end - begin < _USUAL, end - begin, _USUAL))
        for block in range(begin + _USUAL, end):
            if blocks == _BLOCKS:
                _look_into(gravity, facets, under, found, blocks)
                blocks = index(0)
            looks.take(planes, blocks, i, block)
            blocks += index(1)
    _look_into(gravity, facets, under, found, blocks)


@outlined
def _look_into(gravity, facets, under, found, blocks):
    """Lanes each at a block of entries in their cells, then at the facets of which they may pass the planes."""
    (looks, maybe), cells, some = found, facets.grid, index(0)
    marked = unwritten((_BLOCKS, BLOCK), np.bool_)
    for j in range(blocks):
        i, block, time = index(looks.lane[j]), looks.block[j], under.time[index(looks.lane[j])]
        v, at = accelerated(gravity, column(under.rows, _SPEED, i), time), column(under.rows, _MIDDLE, i)
        here, (first, stop) = here_in(gravity, cells, at, v, under.until[i] - time), entries_of(cells, under.cell[i])
        for k in range(BLOCK):
            is_own = (block * BLOCK + k >= first) & (block * BLOCK + k < stop)
            marked[j, k] = is_own & passes(cells, index(block), index(k), here)
    for j in range(blocks):
        for k in range(BLOCK):
            maybe.entry[some] = looks.block[j] * BLOCK + k
            maybe.lane[some] = looks.lane[j]
            some += index(marked[j, k])
    _look_at(gravity, facets, under, maybe, some)


def _look_at(gravity, facets, under, maybe, some):
    """So many lanes each at a facet."""
    maybe.look_up(facets, some)
    for n in range(some):
        i, m = index(maybe.lane[n]), index(maybe.facet[n])
        r, v = column(under.rows, _START, i), column(under.rows, _SPEED, i)
        time, _hits = flights.hit(gravity, member(facets, m), r, v)
        sooner = time < under.until[i]
        under.until[i] = select(sooner, time, under.until[i])
        under.wall[i] = select(sooner, float(maybe.facet[n]), under.wall[i])


@outlined
def _until_in(gravity, cells, under, i):
    """Until when a lane that is outside of the grid surely does not come into it."""
    place, pace = under.now(gravity, i)
    return under.time[i] + until_next(gravity, cells, cell_of(cells, place), place, pace)

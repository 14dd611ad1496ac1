"""Find the first hits of all lanes with the facets of a mesh: each lane goes from cell to cell until it meets one.

Lanes go through the cells of a moving mesh in the same way, as curves in its frame: in_moving_cells.py.

All lanes take a step together, in loops of which those without branches vectorise; then the lanes that have come into
a cell with facets look at these. Lane by lane, each would wait for every number from memory: 4 times as long.
"""

import numpy as np

from ..kernel.arrays import fetch, index, unwritten
from ..kernel.gravity import accelerated, displacement
from ..kernel.grid import cell_of, until_next, until_out
from ..kernel.jit import Array, outlined, select
from ..kernel.record import Record
from ..kernel.vector import column, put
from ..surfaces.facets.facet_cells import BLOCK, blocks_of, flight_in, from_middle, passes
from ..surfaces.facets.free_room import NormalCone, cone_of, room_of
from ..surfaces.facets.members import hit_of
from .table import STRIDE, marked_lanes, whole_eights

# The hit of a lane, in rows of `course`.
_TIME, _WALL = 0, 1
# The number of blocks of entries that are tested together, and the usual number for a lane.
_BLOCKS, _USUAL = 256, 2
# Steps of a lane after which the rest of its flight is left to the next pass.
_MOST = 4000
# The rows of a lane that is under way: first its flight at its start, in at most _OWN rows; then its place, the room of
# its cell, and a cone of the normals there. Rows of a moving mesh follow them.
START, SPEED, _OWN = 0, 3, 8
PLACE, _BACK, _AHEAD, _AXIS, _SINE, ROWS = _OWN, _OWN + 3, _OWN + 6, _OWN + 9, _OWN + 12, _OWN + 13
# The place relative to the middle of the cell replaces the room behind the lane, which is not needed any more.
MIDDLE = _BACK


class UnderWay(Record):
    """The lanes that are under way, in columns without gaps: they fly straight or fall, past facets at rest."""

    rows: Array  # the rows of each lane
    time: Array  # the time of its flight so far
    until: Array  # the end of this step, at most its hit
    wall: Array  # the facet of that hit, or -1
    cell: Array  # int64
    inside: Array  # bool, whether it is in the grid
    owner: Array  # int64, the lane
    last: Array  # the time after which no hit counts

    # The number of rows, and of the rows of the flight at its start.
    width, own = ROWS, 6

    def begin(self, i, lane, found):
        """Put lane i at its start, with its hit so far."""
        put(self.rows, START, i, lane.r)
        put(self.rows, SPEED, i, lane.v)
        self.time[i], self.owner[i] = 0.0, i
        self.last[i] = select(lane.remaining < found, lane.remaining, found)

    # --- The difference for a moving mesh ---

    def facets(self, mesh):
        """The facets of the mesh."""
        return mesh

    def look_up(self, mesh, n):
        """Look up the numbers that `see` needs, for n lanes."""

    def see(self, gravity, mesh, i):
        """Look where a lane is now in the frame of the mesh; return its place."""
        return self.now(gravity, i)[0]

    def now(self, gravity, i):
        """Return the position and the velocity of a lane in the frame of the mesh, from the last `see`."""
        r, v, t = column(self.rows, START, i), column(self.rows, SPEED, i), self.time[i]
        return r + displacement(gravity, v, t), accelerated(gravity, v, t)

    def until_out(self, gravity, mesh, i, first, last):
        """Return a time for which a lane surely stays among the cells from one place to another."""
        place, pace = self.now(gravity, i)
        return until_out(gravity, mesh.grid, first, last, place, pace)

    def until_in(self, gravity, mesh, i):
        """Return a time until which a lane outside of the grid surely does not come into it."""
        return _until_in(gravity, mesh.grid, self, i)

    def may_meet(self, gravity, mesh, i, cone):
        """Whether a lane may move towards a facet with a normal in this cone on its way through its cell."""
        v = column(self.rows, SPEED, i)
        if gravity is None:
            return not cone.is_left(v)
        now, then = accelerated(gravity, v, self.time[i]), accelerated(gravity, v, self.until[i])
        return not (cone.is_left(now) & cone.is_left(then))

    def keep_way(self, gravity, mesh, i):
        """Keep the result of `way`, if it is long to compute: a lane may look at many blocks of facets."""

    def way(self, gravity, mesh, i):
        """Return the way of a lane through its cell, as `FlightInCell`."""
        v, time = column(self.rows, SPEED, i), self.time[i]
        at, pace = column(self.rows, MIDDLE, i), accelerated(gravity, v, time)
        return flight_in(mesh.grid, at, pace, gravity, self.until[i] - time)

    def meet(self, gravity, mesh, maybe, some):
        """Take the hits of lanes with the `some` facets that they may meet."""
        for n in range(some):
            i = index(maybe.lane[n])
            r, v = column(self.rows, START, i), column(self.rows, SPEED, i)
            self.take(i, hit_of(mesh, gravity, r, v, index(maybe.facet[n])))

    # --- From step to step ---

    def move(self, source, target):
        """Copy lane `source` to the place `target`."""
        for k in range(self.own):
            self.rows[k, target] = self.rows[k, source]
        self.time[target], self.owner[target] = self.time[source], self.owner[source]
        self.last[target] = self.last[source]

    def in_eights(self, n):
        """Fill n lanes up to whole vectors with copies of the last one: one lane alone takes as long as eight."""
        count = whole_eights(n)
        for i in range(index(n), count):
            self.move(index(n - 1), i)
        return count

    def take(self, i, met):
        """Take a `Hit` of a lane if it is the first on its way; with wall -1, a time until which it meets no wall."""
        sooner = met.time < self.until[i]
        self.until[i] = select(sooner, met.time, self.until[i])
        self.wall[i] = select(sooner, met.wall, self.wall[i])

    def keep(self, course, i, time, wall):
        """Keep the hit of a lane, if it is the first so far."""
        owner = index(self.owner[i])
        if time < course[_TIME, owner]:
            course[_TIME, owner], course[_WALL, owner] = time, wall

    def go_on(self, gravity, mesh, before, course, n):
        """Move every lane to its next cell, or end it at its hit; return the number of lanes still under way."""
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


def under_way(kind):
    """Allocate the arrays of lanes that are under way, of class `kind`."""
    return kind(
        unwritten((kind.width, STRIDE), np.float64), unwritten(STRIDE, np.float64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.float64), unwritten(STRIDE, np.int64),
        unwritten(STRIDE, np.bool_), unwritten(STRIDE, np.int64), unwritten(STRIDE, np.float64),
    )  # fmt: skip


class Maybe(Record):
    """The facets that lanes may meet in their cells.

    All are looked up before one is tested, so that they are fetched from memory together.
    """

    place: Array  # int64, the place among the entries of all blocks that are tested
    lane: Array  # int64
    facet: Array  # int64

    def look_up(self, facets, looks, some):
        """Look up `some` facets."""
        for n in range(some):
            j, k = index(self.place[n] // BLOCK), index(self.place[n] % BLOCK)
            self.lane[n], self.facet[n] = looks.lane[j], facets.grid.entries[index(looks.block[j] * BLOCK) + k]
            facets.ask_for(index(self.facet[n]))
        for n in range(some):
            facets.ask_for_corners(index(self.facet[n]))


def maybe_met():
    """Allocate the arrays of `Maybe`."""
    room = _BLOCKS * BLOCK
    return Maybe(unwritten(room, np.int64), unwritten(room, np.int64), unwritten(room, np.int64))


class Looks(Record):
    """Blocks of entries, and the lane that looks at each."""

    lane: Array  # int64
    block: Array  # int64

    def take(self, planes, j, lane, block):
        """Add a look, and fetch its block from memory."""
        self.lane[j], self.block[j] = lane, block
        ask_for(planes, block, planes.shape[1] * planes.shape[2])


def ask_for(table, row, size):
    """Fetch both cache lines of a row of a table with `size` numbers a row."""
    fetch(table, row * size)
    fetch(table, row * size + size // 2)


@outlined
def go_through(gravity, facets, before, lanes, live):
    """Find the first hit of every live lane with facets that have `before` walls before them; keep an earlier one."""
    go_from_cell_to_cell(under_way(UnderWay), gravity, facets, before, lanes, live)


def go_from_cell_to_cell(under, gravity, mesh, before, lanes, live):
    """Find first hits as `go_through`, with the lanes `under` and any mesh that they support."""
    course, maybe = lanes.course, maybe_met()
    looks = Looks(unwritten(_BLOCKS, np.int64), unwritten(_BLOCKS, np.int64))
    for i in range(index(live)):
        under.begin(i, lanes.lane(i), course[_TIME, i])
    n = int(live)
    for _step in range(_MOST):
        _find_cells(gravity, mesh, under, lanes, under.in_eights(n))
        _look(gravity, mesh, under, (looks, maybe), lanes.order, marked_lanes(lanes, n))
        n = under.go_on(gravity, mesh, before, course, n)
        if n == 0:
            return
    for i in range(index(n)):
        under.keep(course, i, under.time[i], -1.0)


def _find_cells(gravity, mesh, under, lanes, n):
    """Find the cell of every lane, how far the lane comes in this step, and whether it may meet a facet on this way."""
    cells, rows = under.facets(mesh).grid, under.rows
    under.look_up(mesh, n)
    for i in range(index(n)):
        cell = cell_of(cells, under.see(gravity, mesh, i))
        put(rows, PLACE, i, cell.place)
        under.cell[i], under.inside[i] = cell.number, cell.inside
    # Lanes outside of the grid are in the cell after its last, which is empty.
    for i in range(index(n)):
        cell = index(under.cell[i])
        room, cone = room_of(cells.known.room, cell), cone_of(cells.known.room, cell)
        put(rows, _BACK, i, room.back)
        put(rows, _AHEAD, i, room.ahead)
        put(rows, _AXIS, i, cone.axis)
        rows[_SINE, i] = cone.sine
    for i in range(index(n)):
        place, _pace = under.now(gravity, i)
        at, back, ahead = (column(rows, row, i) for row in (PLACE, _BACK, _AHEAD))
        out = under.until_out(gravity, mesh, i, at - back, at + ahead)
        under.until[i], under.wall[i] = under.time[i] + out, -1.0
        put(rows, MIDDLE, i, from_middle(cells, at, place))
    for i in range(index(n)):
        cone = NormalCone(column(rows, _AXIS, i), rows[_SINE, i])
        lanes.marked[i] = under.may_meet(gravity, mesh, i, cone)
        under.keep_way(gravity, mesh, i)


def _look(gravity, mesh, under, found, order, n):
    """Let n lanes look at the facets in their cells, by their planes first."""
    cells, (looks, _maybe), blocks = under.facets(mesh).grid, found, index(0)
    for j in range(n):
        i = order[j]
        begin, end = blocks_of(cells, under.cell[i])
        if blocks > _BLOCKS - _USUAL:
            _look_into(gravity, mesh, under, found, blocks)
            blocks = index(0)
        # The next lane overwrites blocks that are not its own: without a branch, as no processor foresees their number.
        for k in range(_USUAL):
            looks.take(cells.known.planes, blocks + index(k), i, begin + k)
        blocks += index(select(end - begin < _USUAL, end - begin, _USUAL))
        for block in range(begin + _USUAL, end):
            if blocks == _BLOCKS:
                _look_into(gravity, mesh, under, found, blocks)
                blocks = index(0)
            looks.take(cells.known.planes, blocks, i, block)
            blocks += index(1)
    _look_into(gravity, mesh, under, found, blocks)


@outlined
def _look_into(gravity, mesh, under, found, blocks):
    """Let each lane look at a block of entries in its cell, then at the facets with planes that it may pass."""
    (looks, maybe), cells, some = found, under.facets(mesh).grid, 0
    marked = unwritten((_BLOCKS, BLOCK), np.bool_)
    for j in range(blocks):
        block, way = index(looks.block[j]), under.way(gravity, mesh, index(looks.lane[j]))
        for k in range(BLOCK):
            marked[j, k] = passes(cells, block, index(k), way)
    for j in range(blocks):
        for k in range(BLOCK):
            maybe.place[index(some)] = j * BLOCK + k
            some += marked[j, k]
    _look_at(gravity, mesh, under, found, index(some))


def _look_at(gravity, mesh, under, found, some):
    """Let `some` lanes look each at a facet."""
    looks, maybe = found
    maybe.look_up(under.facets(mesh), looks, some)
    under.meet(gravity, mesh, maybe, some)


@outlined
def _until_in(gravity, cells, under, i):
    """Return a time until which a lane outside of the grid surely does not come into it."""
    place, pace = under.now(gravity, i)
    return under.time[i] + until_next(gravity, cells, cell_of(cells, place), place, pace)

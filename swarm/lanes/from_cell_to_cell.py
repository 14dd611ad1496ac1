"""The first hits of all lanes with the facets of a mesh: each lane goes from cell to cell until it meets one.

All lanes take a step together, in loops of which those without branches vectorise; then those that have come into a
cell with facets look at these. One lane after the other would wait for each number that it looks up: 4 times as long.
"""

import numpy as np

from ..kernel.arrays import index, unwritten
from ..kernel.gravity import accelerated, displacement
from ..kernel.grid import cell_of, entries_of, until_next, until_out
from ..kernel.jit import Array, outlined, select
from ..kernel.record import Record
from ..kernel.vector import column, put
from ..surfaces.facets.facet_cells import here_in, passes
from ..surfaces.facets.free_room import FULL, KIND, all_away, room_of
from ..surfaces.fields.members import member
from ..surfaces.time_of_impact import flights
from .table import STRIDE

# The hit of a lane, in rows of `course`.
_TIME, _WALL = 0, 1
# So many facets are looked at together; the column of one in the second line of the cache.
_ROOM, _SECOND = 1024, 8
# Entries of a cell in a line of the cache, and lines of a cell that are looked up together.
_PER_LINE, _LINES = 4, 4
# Steps of a lane after which its flight is said to be free so far.
_MOST = 4000


class Under(Record):
    """The lanes that are under way, closed up."""

    rows: Array  # position and velocity at the start, and where it is now
    time: Array  # how far it has come
    until: Array  # how far it comes in this step, up to its hit
    wall: Array  # the facet of that hit, or -1
    cell: Array  # int64
    inside: Array  # bool, whether it is in the grid
    owner: Array  # int64, the lane
    last: Array  # the time after which no hit counts
    first: Array  # int64, the first entry of its cell
    count: Array  # int64, how many it has

    def move(self, source, target):
        """One lane into the place of another one."""
        for k in range(6):
            self.rows[k, target] = self.rows[k, source]
        self.time[target], self.owner[target] = self.time[source], self.owner[source]
        self.last[target] = self.last[source]

    def now(self, gravity, i):
        """The position and the velocity of a lane now."""
        r, v, t = column(self.rows, _START, i), column(self.rows, _SPEED, i), self.time[i]
        return r + displacement(gravity, v, t), accelerated(gravity, v, t)


class Maybe(Record):
    """The facets that lanes may meet in their cells.

    All are looked up before one is looked at: so they are on their way from memory together.
    """

    lane: Array  # int64
    entry: Array  # int64
    facet: Array  # int64
    seen: Array  # what was looked up


# Of its rows
_START, _SPEED, _PLACE, _BACK, _AHEAD, _PLACES = 0, 3, 6, 9, 12, 15


@outlined
def go_through(gravity, facets, before, lanes, live):
    """The first hits of every live lane with facets that have so many walls before them, or that found before."""
    course = lanes.course
    under = Under(
        unwritten((_PLACES, STRIDE), np.float64), unwritten(STRIDE, np.float64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.float64), unwritten(STRIDE, np.int64),
        unwritten(STRIDE, np.bool_), unwritten(STRIDE, np.int64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.int64), unwritten(STRIDE, np.int64),
    )  # fmt: skip
    maybe = Maybe(
        unwritten(_ROOM, np.int64), unwritten(_ROOM, np.int64), unwritten(_ROOM, np.int64), unwritten(_ROOM, np.float64)
    )
    for i in range(index(live)):
        lane = lanes.lane(i)
        found, remaining = course[_TIME, i], lane.remaining
        put(under.rows, _START, i, lane.r)
        put(under.rows, _SPEED, i, lane.v)
        under.time[i], under.owner[i] = 0.0, i
        under.last[i] = select(remaining < found, remaining, found)
    n = int(live)
    for _step in range(_MOST):
        _find_cells(gravity, facets.grid, under, n)
        _look(gravity, facets, under, maybe, n)
        n = _go_on(gravity, facets.grid, before, course, under, n)
        if n == 0:
            return
    for i in range(index(n)):
        _keep(course, under, i, under.time[i], -1.0)


def _find_cells(gravity, cells, under, n):
    """The cell that every lane is in, and how far it comes from there."""
    for i in range(index(n)):
        place, _pace = under.now(gravity, i)
        cell = cell_of(cells, place)
        put(under.rows, _PLACE, i, cell.place)
        under.cell[i], under.inside[i] = cell.number, cell.inside
    # What is outside of the grid is in the cell after its last, which holds nothing.
    for i in range(index(n)):
        cell = index(under.cell[i])
        room = room_of(cells.known.room, cell)
        put(under.rows, _BACK, i, room.back)
        put(under.rows, _AHEAD, i, room.ahead)
    for i in range(index(n)):
        place, pace = under.now(gravity, i)
        at, back, ahead = (column(under.rows, row, i) for row in (_PLACE, _BACK, _AHEAD))
        out = until_out(gravity, cells, at - back, at + ahead, place, pace)
        under.until[i], under.wall[i] = under.time[i] + out, -1.0
    for i in range(index(n)):
        cell = index(under.cell[i])
        under.count[i] = 0
        if cells.known.room[cell, KIND] == FULL and _may_meet(gravity, cells, under, cell, i):
            first, stop = entries_of(cells, cell)
            under.first[i], under.count[i] = first, stop - first


def _may_meet(gravity, cells, under, cell, i):
    """Whether a lane may move towards a facet of its cell, at the start of its way through it or at the end."""
    v = column(under.rows, _SPEED, i)
    if gravity is None:
        return not all_away(cells.known.room, cell, v)
    now, then = accelerated(gravity, v, under.time[i]), accelerated(gravity, v, under.until[i])
    return not (all_away(cells.known.room, cell, now) and all_away(cells.known.room, cell, then))


def _look(gravity, facets, under, maybe, n):
    """Every lane at the facets in its cell, by their planes first."""
    cells, some = facets.grid, 0
    for line in range(_LINES):
        for i in range(index(n)):
            ahead = line * _PER_LINE
            if under.count[i] > ahead:
                maybe.seen[i] = float(cells.known.planes[index(under.first[i] + ahead), 0])
    for i in range(index(n)):
        if under.count[i] > 0:
            place, pace = under.now(gravity, i)
            span = under.until[i] - under.time[i]
            here = here_in(gravity, cells, column(under.rows, _PLACE, i), place, pace, span)
            for k in range(under.first[i], under.first[i] + under.count[i]):
                if passes(cells, index(k), here):
                    maybe.lane[some], maybe.entry[some] = i, k
                    some += 1
                    if some == _ROOM:
                        _look_at(gravity, facets, under, maybe, some)
                        some = 0
    _look_at(gravity, facets, under, maybe, some)


@outlined
def _look_at(gravity, facets, under, maybe, some):
    """So many lanes each at a facet."""
    table = facets.table
    for j in range(index(some)):
        maybe.facet[j] = facets.grid.entries[index(maybe.entry[j])]
    for j in range(index(some)):
        # Both lines of the cache that it is in
        m = index(maybe.facet[j])
        maybe.seen[j] = table[m, 0] + table[m, _SECOND]
    for j in range(index(some)):
        i, m = index(maybe.lane[j]), index(maybe.facet[j])
        r, v = column(under.rows, _START, i), column(under.rows, _SPEED, i)
        time, _hits = flights.hit(gravity, member(facets, m), r, v)
        if time < under.until[i]:
            under.until[i], under.wall[i] = time, float(maybe.facet[j])


def _go_on(gravity, cells, before, course, under, n):
    """Every lane to the next cell, or to its hit: how many are under way still."""
    left = 0
    for i in range(index(n)):
        until, wall = under.until[i], under.wall[i]
        if not under.inside[i]:
            until = _until_in(gravity, cells, under, i)
        if wall >= 0.0 or not until < under.last[i]:
            _keep(course, under, i, until, select(wall < 0.0, -1.0, wall + before))
            continue
        under.time[i] = until
        if left < i:
            under.move(i, index(left))
        left += 1
    return left


@outlined
def _until_in(gravity, cells, under, i):
    """Until when a lane that is outside of the grid surely does not come into it."""
    place, pace = under.now(gravity, i)
    return under.time[i] + until_next(gravity, cells, cell_of(cells, place), place, pace)


def _keep(course, under, i, time, wall):
    """Keep the hit of a lane, if it is the first so far."""
    owner = index(under.owner[i])
    if time < course[_TIME, owner]:
        course[_TIME, owner], course[_WALL, owner] = time, wall

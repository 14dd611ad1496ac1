"""Find the first hits of all lanes with the bodies of fields: each lane looks at the bodies of its cell.

The loops write to arrays on the stack. Of any other array the compiler cannot prove that it does not overlap the
tables of the bodies, and then it does not vectorise.
"""

from typing import Any

import numpy as np

from ..kernel.arrays import copy_row, index, unwritten
from ..kernel.grid import cell_of, entries_of, until_next
from ..kernel.jit import Array, outlined, select
from ..kernel.record import Record
from ..kernel.vector import column, put
from ..surfaces.facets.members import Facets
from ..surfaces.fields.foam import Foam
from ..surfaces.fields.members import gathered, member, width
from ..surfaces.periodic.period import on_time
from ..surfaces.time_of_impact import flights
from ..surfaces.time_of_impact.course import MORE_STEPS, SAFE_STEPS
from ..surfaces.walls import Walls
from .from_cell_to_cell import go_through
from .lane_arrays import Flying
from .table import STRIDE, marked_lanes

# All lanes take a safe step together if more than one in this number needs it.
_MANY = 8
# The flight of a lane, in rows of `course`: the time of its end, and the wall there, or -1.
_TIME, _WALL = 0, 1


class LaneFlights(Record):
    """The known parts of the flights of lanes, and the bodies near them."""

    owner: Array  # int64, the lane that each flight belongs to
    time: Array  # the end of the flight
    wall: Array  # the wall there, or -1
    first: Array  # int64, the first entry of the cell
    number: Array  # int64, the number of entries of the cell
    which: Array  # the number of body k
    body: Array  # (stride, width), the row of body k in the table

    def give_back(self, lanes, i):
        """Write the hit of a flight back to its lane."""
        owner = index(self.owner[i])
        lanes.course[_TIME, owner], lanes.course[_WALL, owner] = self.time[i], self.wall[i]


class MemberLook(Record):
    """A look of all lanes at body k of their cells."""

    seen: LaneFlights
    like: Any  # a body of the field
    gravity: Any
    lanes: Any
    before: Any  # the number of walls before these bodies
    k: int  # the place of the bodies in their cells
    row: int  # the first row of the flights in `lanes.rows`

    def flight(self, i):
        """Return the position and the velocity of a lane."""
        return column(self.lanes.rows, index(self.row), i), column(self.lanes.rows, index(self.row + 3), i)

    def one(self, i):
        """Return the body of a lane, as a scene of one wall."""
        return Walls((gathered(self.like, self.seen.body, i, 0),))

    def take(self, i, time, wall):
        """Take a hit of a lane with its body, if the lane has such a body and the hit is the first so far."""
        seen = self.seen
        sooner = (self.k < seen.number[i]) & (time < seen.time[i])
        seen.time[i] = select(sooner, time, seen.time[i])
        seen.wall[i] = select(sooner, wall, seen.wall[i])

    def step(self, course, i):
        """Make a safe step of a lane."""
        flights.step(self.one(i), self.gravity, course, 0, i, *self.flight(i))

    def goes_on(self, course, i):
        """Whether more safe steps may find a hit that is the first so far."""
        hit = flights.end(self.one(i), self.gravity, course, 0, i, self.flight(i))
        return (hit.wall < 0.0) & (hit.time < self.seen.time[i]) & (self.k < self.seen.number[i])

    @outlined
    def go_on(self, course, i, steps):
        """Make up to `steps` safe steps of one lane, while they may find a hit."""
        for _step in range(steps):
            self.step(course, i)
            if not self.goes_on(course, i):
                break


def keep_hit(lanes, i, hit, before):
    """Keep the `Hit` of a lane with walls that have `before` walls before them."""
    lanes.course[_TIME, i], lanes.course[_WALL, i] = hit.time, select(hit.wall < 0.0, -1.0, hit.wall + before)


def hit_of_lane(lanes, i):
    """Return the `Hit` that was found for a lane."""
    return flights.Hit(lanes.course[_TIME, i], lanes.course[_WALL, i])


def seek(walls, gravity, lanes, live):
    """Find the first hit of every live lane with the fields, unless its hit so far is earlier."""
    for before, field in reversed(walls.fields()):
        _seek(gravity, field.members, before, lanes, live)


@outlined
def _seek(gravity, members, before, lanes, live):
    """Find the first hits with one field that has `before` walls before it, as `seek`."""
    if isinstance(members, Facets):
        go_through(gravity, members, before, lanes, live)
    elif isinstance(members, Foam):
        _ask_for_each(gravity, members, before, lanes, live)
    elif members.few and gravity is None:
        _look_at_all(members, before, lanes, live)
    else:
        _look_at_near(gravity, members, before, lanes, live)


def _ask_for_each(gravity, members, before, lanes, live):
    """Find the hit of each lane with the field as a whole."""
    for i in range(index(live)):
        lane, found = lanes.lane(i), hit_of_lane(lanes, i)
        hit = flights.soonest(members.field_hit(gravity, lane.r, lane.v), before, found)
        lanes.course[_TIME, i], lanes.course[_WALL, i] = hit.time, hit.wall


def _look_at_all(members, before, lanes, live):
    """Find the first hits of straight flights of all lanes with all bodies of a field."""
    course = lanes.course
    for m in range(members.table.shape[0]):
        body, number = member(members, index(m)), before + m
        for i in range(index(live)):
            lane = lanes.lane(i)
            time, hits = body.first_hit(lane.r, lane.v)
            sooner = time < course[_TIME, i]
            course[_TIME, i] = select(sooner, time, course[_TIME, i])
            course[_WALL, i] = select(sooner, select(hits, number, -1.0), course[_WALL, i])


def _look_at_near(gravity, members, before, lanes, live):
    """Find the first hits of all lanes with the bodies near them: the bodies of the cell, or all."""
    course, grid, columns = lanes.course, members.grid, width(members.like)
    seen = LaneFlights(
        unwritten(STRIDE, np.int64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.float64), unwritten(STRIDE, np.int64), unwritten(STRIDE, np.int64),
        unwritten(STRIDE, np.float64), unwritten((STRIDE, columns), np.float64),
    )  # fmt: skip
    for i in range(index(live)):
        seen.owner[i], seen.time[i], seen.wall[i] = i, course[_TIME, i], course[_WALL, i]
    _find_near(members, gravity, lanes, live, seen)
    most, n, row = 0, live, 0
    for i in range(index(live)):
        most = max(most, seen.number[i])
    for k in range(most):
        some = _close_up(seen, k, lanes, n, row)
        n, row = some, select(some < n, Flying.CLOSED_UP, row)
        for i in range(index(n)):
            seen.which[i] = grid.entries[index(select(k < seen.number[i], seen.first[i] + k, 0))]
            copy_row(seen.body, i, members.table, index(int(seen.which[i])), columns)
        _look(MemberLook(seen, members.like, gravity, lanes, before, k, row), n)
    if n == live:
        for i in range(index(live)):
            course[_TIME, i], course[_WALL, i] = seen.time[i], seen.wall[i]
    else:
        for i in range(index(n)):
            seen.give_back(lanes, i)


def _find_near(members, gravity, lanes, live, seen):
    """Find the bodies near each lane, and the time for which they are known."""
    grid = members.grid
    for i in range(index(live)):
        lane = lanes.lane(i)
        r, v = lane.r, lane.v
        cell = cell_of(grid, r)
        until = until_next(gravity, grid, cell, r, v)
        # A cell lists the bodies up to twice the margin beyond its wall, and a flight ends one margin beyond it.
        until = on_time(lanes.period, gravity, (r, v), lane.remaining, until, 0.5 * grid.margin)
        sooner = until < seen.time[i]
        seen.time[i] = select(sooner, until, seen.time[i])
        seen.wall[i] = select(sooner, -1.0, seen.wall[i])
        seen.number[i] = cell.number
    # In a separate loop: in the loop above they take twice as long.
    for i in range(index(live)):
        first, stop = entries_of(grid, seen.number[i])
        seen.first[i], seen.number[i] = first, stop - first


def _close_up(seen, k, lanes, n, row):
    """Give back the lanes without a body k if these are most, close up the others, and return the number of lanes left.

    Without this an impact among 1000 balls at random, 3.6 in a cell and 11 in the fullest, takes a fifth longer. (Lanes
    one by one when few are left are no faster, and one more loop to compile.)
    """
    some, j = 0, index(0)
    for i in range(index(n)):
        some += select(k < seen.number[i], 1, 0)
    if 2 * some > n:
        return n
    for i in range(index(n)):
        seen.give_back(lanes, i)
        number = seen.number[i]
        put(lanes.rows, Flying.CLOSED_UP, j, column(lanes.rows, row, i))
        put(lanes.rows, Flying.CLOSED_UP + 3, j, column(lanes.rows, row + 3, i))
        seen.owner[j], seen.time[j], seen.wall[j] = seen.owner[i], seen.time[i], seen.wall[i]
        seen.number[j], seen.first[j] = number, seen.first[i]
        j += index(k < number)
    return some


def _look(look, live):
    """Find the hits of all lanes with their bodies, in closed form or by steps."""
    if look.gravity is None and not look.like.in_steps:
        seen = look.seen
        for i in range(index(live)):
            time, hits = gathered(look.like, seen.body, i, 0).first_hit(*look.flight(i))
            look.take(i, time, select(hits, seen.which[i] + look.before, -1.0))
    else:
        _look_by_steps(look, live)


def _look_by_steps(look, live):
    """Find the hits of all lanes with their bodies by safe steps."""
    marked, order, course = look.lanes.marked, look.lanes.order, unwritten((flights.COURSE, STRIDE), np.float64)
    for i in range(index(live)):
        flights.begin(look.one(i), look.gravity, course, 0, i, *look.flight(i))
    steps, some = SAFE_STEPS + MORE_STEPS, live
    while steps > 0 and some > 0:
        for i in range(index(live)):
            marked[i] = look.goes_on(course, i)
        some = marked_lanes(look.lanes, live)
        if some > live // _MANY:
            for i in range(index(live)):
                look.step(course, i)
            steps -= 1
        else:
            for j in range(some):
                look.go_on(course, index(order[j]), steps)
            some = 0
    for i in range(index(live)):
        hit = flights.end(look.one(i), look.gravity, course, 0, i, look.flight(i))
        look.take(i, hit.time, select(hit.wall < 0.0, -1.0, look.seen.which[i] + look.before))

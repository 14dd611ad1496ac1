"""The first hits of all lanes where walls are bodies of a field: each lane looks at the bodies of its cell.

The loops write to arrays on the stack. For any other array the compiler cannot prove that it does not overlap the
tables of the bodies, and then it vectorises nothing.
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

# Safe steps are for all lanes where more than this part of them needs one.
_MANY = 8
# The flight of a lane, in rows of `course`: when it ends, and at which wall, or -1.
_TIME, _WALL = 0, 1


class LaneFlights(Record):
    """The flights of lanes as far as they are known, and the bodies near them."""

    owner: Array  # int64, the body that each belongs to
    time: Array  # when the flight ends
    wall: Array  # where, or -1
    first: Array  # int64, the first entry of the cell
    number: Array  # int64, how many it has
    which: Array  # the number of body k
    body: Array  # (stride, width), its numbers

    def give_back(self, lanes, i):
        """Keep the hit that a lane has found."""
        owner = index(self.owner[i])
        lanes.course[_TIME, owner], lanes.course[_WALL, owner] = self.time[i], self.wall[i]


class MemberLook(Record):
    """A look of all lanes at the next of the bodies in their cells."""

    seen: LaneFlights
    like: Any  # a body
    gravity: Any
    lanes: Any
    before: Any  # how many walls are before these bodies
    k: int  # which bodies of the cells they are
    row: int  # of `lanes.rows`, from which on the flights are

    def flight(self, i):
        """The position and the velocity of a lane."""
        return column(self.lanes.rows, index(self.row), i), column(self.lanes.rows, index(self.row + 3), i)

    def one(self, i):
        """The body of a lane, as a scene of one wall."""
        return Walls((gathered(self.like, self.seen.body, i, 0),))

    def take(self, i, time, wall):
        """A hit of a lane with its body, if there is one and it is the first so far."""
        seen = self.seen
        sooner = (self.k < seen.number[i]) & (time < seen.time[i])
        seen.time[i] = select(sooner, time, seen.time[i])
        seen.wall[i] = select(sooner, wall, seen.wall[i])

    def step(self, course, i):
        """A safe step of a lane."""
        flights.step(self.one(i), self.gravity, course, 0, i, *self.flight(i))

    def goes_on(self, course, i):
        """Whether more safe steps may find a hit that is the first so far."""
        hit = flights.end(self.one(i), self.gravity, course, 0, i, self.flight(i))
        return (hit.wall < 0.0) & (hit.time < self.seen.time[i]) & (self.k < self.seen.number[i])

    @outlined
    def go_on(self, course, i, steps):
        """So many more steps of one lane, if need be."""
        for _step in range(steps):
            self.step(course, i)
            if not self.goes_on(course, i):
                break


def keep_hit(lanes, i, hit, before):
    """Keep the `Hit` that was found for a lane, with a wall that has so many walls before it."""
    lanes.course[_TIME, i], lanes.course[_WALL, i] = hit.time, select(hit.wall < 0.0, -1.0, hit.wall + before)


def hit_of_lane(lanes, i):
    """The `Hit` that was found for a lane."""
    return flights.Hit(lanes.course[_TIME, i], lanes.course[_WALL, i])


def seek(walls, gravity, lanes, live):
    """The first hits of every live lane with the fields, or one found."""
    for before, field in reversed(walls.fields()):
        _seek(gravity, field.members, before, lanes, live)


@outlined
def _seek(gravity, members, before, lanes, live):
    """The same with one field that has so many walls before it."""
    if isinstance(members, Facets):
        go_through(gravity, members, before, lanes, live)
    elif isinstance(members, Foam):
        _ask_for_each(gravity, members, before, lanes, live)
    elif members.few and gravity is None:
        _look_at_all(members, before, lanes, live)
    else:
        _look_at_near(gravity, members, before, lanes, live)


def _ask_for_each(gravity, members, before, lanes, live):
    """The hit of every lane by itself, as a whole."""
    for i in range(index(live)):
        lane, found = lanes.lane(i), hit_of_lane(lanes, i)
        hit = flights.soonest(members.field_hit(gravity, lane.r, lane.v), before, found)
        lanes.course[_TIME, i], lanes.course[_WALL, i] = hit.time, hit.wall


def _look_at_all(members, before, lanes, live):
    """Every lane with a straight flight, at all bodies of a field."""
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
    """Every lane at the bodies near it: those in its cell, or all."""
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
    """Which bodies are near each lane, and until when it knows that."""
    grid = members.grid
    for i in range(index(live)):
        lane = lanes.lane(i)
        r, v = lane.r, lane.v
        cell = cell_of(grid, r)
        until = until_next(gravity, grid, cell, r, v)
        # Bodies are known twice the margin beyond the cell's wall, and a flight ends one beyond it.
        until = on_time(lanes.period, gravity, (r, v), lane.remaining, until, 0.5 * grid.margin)
        sooner = until < seen.time[i]
        seen.time[i] = select(sooner, until, seen.time[i])
        seen.wall[i] = select(sooner, -1.0, seen.wall[i])
        seen.number[i] = cell.number
    # In a loop of their own: in that one they take twice as long.
    for i in range(index(live)):
        first, stop = entries_of(grid, seen.number[i])
        seen.first[i], seen.number[i] = first, stop - first


def _close_up(seen, k, lanes, n, row):
    """Give back the lanes that have no body k, where these are most, and close up the others: how many there are.

    Among 1000 balls at random, 3.6 in a cell and 11 in the fullest, an impact takes a fifth longer without. (Lanes one
    by one where few are left are no faster, and one more loop to compile.)
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
    """Every lane at its body: in closed form where flights are straight and none is met by steps."""
    if look.gravity is None and not look.like.in_steps:
        seen = look.seen
        for i in range(index(live)):
            time, hits = gathered(look.like, seen.body, i, 0).first_hit(*look.flight(i))
            look.take(i, time, select(hits, seen.which[i] + look.before, -1.0))
    else:
        _look_by_steps(look, live)


def _look_by_steps(look, live):
    """The same by safe steps."""
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

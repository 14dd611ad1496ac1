"""The first hits of all lanes where walls are bodies of a field: each lane looks at the bodies of its cell.

What the loops write is on the stack: of an array that comes from elsewhere the compiler cannot tell that it is none of
the tables, whose rows are looked up, and vectorises nothing.
"""

from typing import NamedTuple

import numpy as np

from ..kernel.gravity import Gravity, Nothing
from ..kernel.jit import Array, by_type, by_type_outlined, copy_row, index, inlined, outlined, scratch, select
from ..kernel.vector import column
from ..surfaces import contract, flights, fold
from ..surfaces.course import MORE_STEPS, SAFE_STEPS
from ..surfaces.fields.grid import cell_of, until_next
from ..surfaces.fields.members import Few, Members, gathered, member, width
from .arrays import STRIDE, R, V
from .marks import marked_lanes

# Safe steps are for all lanes where more than this part of them needs one.
_MANY = 8
# What a lane knows of its flight, in rows of `course`: when it ends, and at which wall, or -1.
_TIME, _WALL = 0, 1


class Seen(NamedTuple):
    """What lanes know of their flights so far, and of the bodies near them; they are at body k of these."""

    time: Array  # when the flight ends
    wall: Array  # where, or -1
    first: Array  # int64, the first entry of the cell
    number: Array  # int64, how many it has
    which: Array  # the number of body k
    body: Array  # (stride, width), its numbers
    k: int


@inlined
def keep_hit(lanes, i, hit, before):
    """Keep the `Hit` that was found for a lane, with a wall that has so many walls before it."""
    lanes.course[_TIME, i], lanes.course[_WALL, i] = hit.time, select(hit.wall < 0.0, -1.0, hit.wall + before)


@inlined
def hit_of_lane(lanes, i):
    """The `Hit` that was found for a lane."""
    return flights.Hit(lanes.course[_TIME, i], lanes.course[_WALL, i])


@by_type_outlined
def seek(chain, before, gravity, lanes, live):
    """The first hit of every live lane with the fields of a chain that has so many walls before it, or one found."""


@seek.register(fold.Field)
def _(chain, before, gravity, lanes, live):
    seek(chain.rest, before + fold.count(chain.first), gravity, lanes, live)
    _seek_among(chain.first, before, gravity, lanes, live)


@by_type
def _seek_among(members, before, gravity, lanes, live):
    """The first hits with the bodies of a field, where they are sooner than what is found already."""


@_seek_among.register(Few)
def _(members, before, gravity, lanes, live):
    _seek_among_few(gravity, members, before, lanes, live)


@by_type
def _seek_among_few(gravity, members, before, lanes, live):
    """The same where each lane looks at all of them."""


@_seek_among_few.register(Nothing)
def _(gravity, members, before, lanes, live):
    rows, course = lanes.rows, lanes.course
    for m in range(members.table.shape[0]):
        body, number = member(members, index(m)), before + m
        for i in range(index(live)):
            time, hits = contract.first_hit(body, column(rows, R, i), column(rows, V, i))
            sooner = time < course[_TIME, i]
            course[_TIME, i] = select(sooner, time, course[_TIME, i])
            course[_WALL, i] = select(sooner, select(hits, number, -1.0), course[_WALL, i])


@_seek_among_few.register(Gravity)
def _(gravity, members, before, lanes, live):
    _look_at_all(gravity, members, before, lanes, live, False)


@_seek_among.register(Members)
def _(members, before, gravity, lanes, live):
    _look_at_all(gravity, members, before, lanes, live, True)


@inlined
def _look_at_all(gravity, members, before, lanes, live, by_cells):
    """Every lane at the bodies near it: those in its cell, or all."""
    rows, course, grid = lanes.rows, lanes.course, members.grid
    time, wall, which = scratch(STRIDE, np.float64), scratch(STRIDE, np.float64), scratch(STRIDE, np.float64)
    first, number = scratch(STRIDE, np.int64), scratch(STRIDE, np.int64)
    body, most = scratch((STRIDE, width(members.like)), np.float64), 0
    for i in range(index(live)):
        time[i], wall[i] = course[_TIME, i], course[_WALL, i]
        first[i], number[i] = 0, members.table.shape[0]
    if by_cells:
        for i in range(index(live)):
            r = column(rows, R, i)
            cell = cell_of(grid, r)
            until = until_next(gravity, grid, cell, r, column(rows, V, i))
            sooner = until < time[i]
            time[i] = select(sooner, until, time[i])
            wall[i] = select(sooner, -1.0, wall[i])
            first[i] = grid.first[index(cell.number)]
            number[i] = grid.first[index(cell.number + 1)] - first[i]
    for i in range(index(live)):
        most = max(most, number[i])
    for k in range(most):
        seen = Seen(time, wall, first, number, which, body, k)
        for i in range(index(live)):
            which[i] = grid.entries[index(select(k < number[i], first[i] + k, 0))]
            copy_row(body, i, members.table, index(int(which[i])), width(members.like))
        _look(gravity, members.like, before, lanes, live, seen)
    for i in range(index(live)):
        course[_TIME, i], course[_WALL, i] = time[i], wall[i]


@by_type
def _look(gravity, like, before, lanes, live, seen):
    """Every lane at the next of these bodies."""


@_look.register(Nothing)
def _(gravity, like, before, lanes, live, seen):
    _look_straight(flights.in_steps(like), like, before, lanes, live, seen)


@_look.register(Gravity)
def _(gravity, like, before, lanes, live, seen):
    _look_by_steps(gravity, like, before, lanes, live, seen)


@by_type
def _look_straight(steps, like, before, lanes, live, seen):
    """The same without gravity, where a body is met by steps or in closed form."""
    _look_by_steps(None, like, before, lanes, live, seen)


@_look_straight.register(Nothing)
def _(steps, like, before, lanes, live, seen):
    rows = lanes.rows
    for i in range(index(live)):
        body = gathered(like, seen.body, i, 0)
        time, hits = contract.first_hit(body, column(rows, R, i), column(rows, V, i))
        _take(seen, i, time, select(hits, seen.which[i] + before, -1.0))


@inlined
def _look_by_steps(gravity, like, before, lanes, live, seen):
    rows, marked, order, course = lanes.rows, lanes.marked, lanes.order, scratch((flights.COURSE, STRIDE), np.float64)
    for i in range(index(live)):
        flights.begin(_one(like, seen, i), gravity, course, 0, i, column(rows, R, i), column(rows, V, i))
    steps, some = SAFE_STEPS + MORE_STEPS, live
    while steps > 0 and some > 0:
        for i in range(index(live)):
            marked[i] = _goes_on(like, course, seen, i)
        some = marked_lanes(lanes, live)
        if some > live // _MANY:
            for i in range(index(live)):
                flights.step(_one(like, seen, i), gravity, course, 0, i, column(rows, R, i), column(rows, V, i))
            steps -= 1
        else:
            for j in range(some):
                _go_on(like, gravity, rows, course, seen, index(order[j]), steps)
            some = 0
    for i in range(index(live)):
        hit = flights.end(_one(like, seen, i), course, 0, i)
        _take(seen, i, hit.time, select(hit.wall < 0.0, -1.0, seen.which[i] + before))


@inlined
def _one(like, seen, i):
    """The body of a lane, as a chain."""
    return fold.Chain(gathered(like, seen.body, i, 0), None)


@inlined
def _goes_on(like, course, seen, i):
    """Whether more safe steps may find a hit that is the first so far."""
    hit = flights.end(_one(like, seen, i), course, 0, i)
    return (hit.wall < 0.0) & (hit.time < seen.time[i]) & (seen.k < seen.number[i])


@outlined
def _go_on(like, gravity, rows, course, seen, i, steps):
    """So many more steps of one lane, if need be."""
    for _step in range(steps):
        flights.step(_one(like, seen, i), gravity, course, 0, i, column(rows, R, i), column(rows, V, i))
        if not _goes_on(like, course, seen, i):
            break


@inlined
def _take(seen, i, time, wall):
    """A hit with that body, if there is one and it is the first so far."""
    sooner = (seen.k < seen.number[i]) & (time < seen.time[i])
    seen.time[i] = select(sooner, time, seen.time[i])
    seen.wall[i] = select(sooner, wall, seen.wall[i])

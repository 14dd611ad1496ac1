"""The first hits of all lanes where walls are bodies of a field: each lane looks at the bodies of its cell.

What the loops write is on the stack: of an array that comes from elsewhere the compiler cannot tell that it is none of
the tables, whose rows are looked up, and vectorises nothing.
"""

from typing import NamedTuple

import numpy as np

from ..kernel.gravity import Gravity, Nothing, as_vector
from ..kernel.jit import Array, by_type, by_type_outlined, copy_row, index, inlined, scratch, select
from ..kernel.vector import column
from ..surfaces import contract, flights, fold
from ..surfaces.fields.grid import cell_of, until_next
from ..surfaces.fields.members import gathered, member, width
from .arrays import STRIDE, R, V

# What a lane knows of its flight, in rows of `course`: when it ends, and at which wall, or -1.
_TIME, _WALL = 0, 1


class Seen(NamedTuple):
    """What lanes know of their flights so far: when each ends and where, and of their cells; they are at body k."""

    time: Array
    wall: Array  # or -1
    first: Array  # int64, the first entry of the cell
    number: Array  # int64, how many it has
    k: int
    body: Array
    which: Array


@inlined
def hit_of_lane(lanes, i):
    """The `Hit` that was found for a lane."""
    return flights.Hit(lanes.course[_TIME, i], lanes.course[_WALL, i])


@by_type_outlined
def seek(chain, before, gravity, lanes, live):
    """The first hit of every live lane with the walls of a chain that has so many walls before it."""


@seek.register(fold.Chain)
def _(chain, before, gravity, lanes, live):
    rows, course = lanes.rows, lanes.course
    for i in range(index(live)):
        hit = flights.first_hit(chain, gravity, column(rows, R, i), column(rows, V, i))
        course[_TIME, i], course[_WALL, i] = hit.time, select(hit.wall < 0.0, -1.0, hit.wall + before)


@seek.register(Nothing)
def _(chain, before, gravity, lanes, live):
    course = lanes.course
    for i in range(index(live)):
        course[_TIME, i], course[_WALL, i] = flights.NEVER.time, -1.0


@seek.register(fold.Field)
def _(chain, before, gravity, lanes, live):
    rows, course, members = lanes.rows, lanes.course, chain.first
    seek(chain.rest, before + fold.count(members), gravity, lanes, live)
    time, wall = scratch(STRIDE, np.float64), scratch(STRIDE, np.float64)
    first, number = scratch(STRIDE, np.int64), scratch(STRIDE, np.int64)
    grid, most = members.grid, 0
    body, which = scratch((STRIDE, width(members.like)), np.float64), scratch(STRIDE, np.float64)
    for i in range(index(live)):
        r = column(rows, R, i)
        cell = cell_of(grid, r)
        until = until_next(gravity, grid, cell, r, column(rows, V, i))
        sooner = until < course[_TIME, i]
        time[i] = select(sooner, until, course[_TIME, i])
        wall[i] = select(sooner, -1.0, course[_WALL, i])
        first[i] = grid.first[index(cell.number)]
        number[i] = grid.first[index(cell.number + 1)] - first[i]
    for i in range(index(live)):
        most = max(most, number[i])
    for k in range(most):
        _look(gravity, members, before, lanes, live, Seen(time, wall, first, number, k, body, which))
    for i in range(index(live)):
        course[_TIME, i], course[_WALL, i] = time[i], wall[i]


@by_type
def _look(gravity, members, before, lanes, live, seen):
    """Every lane at the next body of its cell."""


@_look.register(Nothing)
def _(gravity, members, before, lanes, live, seen):
    rows, body, which = lanes.rows, seen.body, seen.which
    for i in range(index(live)):
        m = _entry(members, seen, i)
        which[i] = m
        copy_row(body, i, members.table, index(m), width(members.like))
    for i in range(index(live)):
        m = which[i]
        time, hits = contract.first_hit(gathered(members.like, body, i, 0), column(rows, R, i), column(rows, V, i))
        _take(seen, i, time, select(hits, m + before, -1.0))


@_look.register(Gravity)
def _(gravity, members, before, lanes, live, seen):
    # Most of them are surely not met in this cell, which is cheap to know.
    rows, marked = lanes.rows, lanes.marked
    for i in range(index(live)):
        body = member(members, index(_entry(members, seen, i)))
        safe = contract.safe_time(body, column(rows, R, i), column(rows, V, i), as_vector(gravity))
        marked[i] = (seen.k < seen.number[i]) & (safe < seen.time[i])
    for i in range(index(live)):
        if marked[i]:
            m = _entry(members, seen, i)
            body = member(members, index(m))
            time, hits = contract.falling_hit(body, column(rows, R, i), column(rows, V, i), as_vector(gravity))
            _take(seen, i, time, select(hits, m + before, -1.0))


@inlined
def _entry(members, seen, i):
    """The next body in the cell of a lane, or any where there is none."""
    return members.grid.entries[index(select(seen.k < seen.number[i], seen.first[i] + seen.k, 0))]


@inlined
def _take(seen, i, time, wall):
    """A hit with that body, if there is one and it is the first so far."""
    sooner = (seen.k < seen.number[i]) & (time < seen.time[i])
    seen.time[i] = select(sooner, time, seen.time[i])
    seen.wall[i] = select(sooner, wall, seen.wall[i])

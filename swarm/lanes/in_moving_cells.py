"""The first hits of all lanes with the facets of a mesh that moves: from cell to cell in the frame of the mesh.

There a flight is a curve, with a bound of its jerk: each lane goes on for as long as it surely stays among the cells
that it is in. All lanes take a step together, as at a mesh at rest; those in a cell with facets look at these. Where
a flight may come through the plane of one, safe steps to that facet alone lead to the hit: none is skipped.
"""

import math
from typing import Any

import numpy as np

from ..kernel.arrays import index, unwritten
from ..kernel.gravity import accelerated
from ..kernel.grid import cell_of, entries_of, until_next, until_out
from ..kernel.jit import Array, outlined, select
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, column, dot, norm, put
from ..surfaces.facets.facet_cells import may_pass, way_in
from ..surfaces.facets.free_room import FULL, KIND, all_away_for, room_of
from ..surfaces.fields.members import member
from ..surfaces.time_of_impact.course import rise_time
from ..surfaces.time_of_impact.flights import Hit
from ..surfaces.time_of_impact.march import lets_go
from ..surfaces.time_of_impact.rising import InWallFrame, Level, ThirdDerivativeBound, flight_of
from .from_cell_to_cell import Maybe, ask_for
from .table import STRIDE

# The hit of a lane, in rows of `course`.
_TIME, _WALL = 0, 1
# So many facets are looked at together.
_ROOM = 1024
# Steps of a lane after which its flight is said to be free so far, and safe steps to one facet.
_MOST, _STEPS = 4000, 100
# The bounds of a flight hold for so many times as long as it would be among its cells if it went straight on.
_CURVED = 1.5
# And for at most so many times the time in which the motion changes little: a turn by a radian.
_AHEAD = 20.0
# A part of the room of a facet, by which a flight goes on that comes to its plane just beyond an edge.
_ON = 0.5
# Where a step to a facet ends that does not lead to the hit.
_NEARER, _BEYOND, _BEHIND = -1.0, -2.0, -3.0


class Leaps(Record):
    """The lanes that are under way, closed up."""

    rows: Array  # the flight at its start, and where it is now in the frame of the mesh
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
        for k in range(_OWN):
            self.rows[k, target] = self.rows[k, source]
        self.time[target], self.owner[target] = self.time[source], self.owner[source]
        self.last[target] = self.last[source]

    def flight(self, gravity, i):
        """The flight of a lane."""
        r, v, rows = column(self.rows, _START, i), column(self.rows, _SPEED, i), self.rows
        return flight_of(r, v, accelerated(gravity, ZERO, 1.0), rows[_REMAINING, i], rows[_FAST, i])

    def seen(self, mesh, gravity, i):
        """A lane in the frame of the mesh now, as `InWallFrame`."""
        rows = self.rows
        weight = norm(accelerated(gravity, ZERO, 1.0))
        return InWallFrame(
            mesh.drive, column(rows, _OWN, i), column(rows, _PACE, i), column(rows, _PULL, i),
            rows[_FAST, i] + self.time[i] * weight, rows[_ARM, i], weight, rows[_COORDINATES, i],
        )  # fmt: skip


# Of its rows
_START, _SPEED, _REMAINING, _FAST, _OWN, _PACE, _PULL, _ARM, _COORDINATES = 0, 3, 6, 7, 8, 11, 14, 17, 18
_PLACE, _BACK, _AHEAD, _ROWS = 19, 22, 25, 28


@outlined
def go_through_moving(gravity, mesh, before, lanes, live):
    """The first hits of every live lane with facets that have so many walls before them, or that found before."""
    course = lanes.course
    leaps = Leaps(
        unwritten((_ROWS, STRIDE), np.float64), unwritten(STRIDE, np.float64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.float64), unwritten(STRIDE, np.int64),
        unwritten(STRIDE, np.bool_), unwritten(STRIDE, np.int64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.int64), unwritten(STRIDE, np.int64),
    )  # fmt: skip
    maybe = Maybe(unwritten(_ROOM, np.int64), unwritten(_ROOM, np.int64), unwritten(_ROOM, np.int64))
    for i in range(index(live)):
        lane = lanes.lane(i)
        found, remaining = course[_TIME, i], lane.remaining
        put(leaps.rows, _START, i, lane.r)
        put(leaps.rows, _SPEED, i, lane.v)
        leaps.rows[_REMAINING, i], leaps.rows[_FAST, i] = remaining, norm(lane.v)
        leaps.time[i], leaps.owner[i] = 0.0, i
        leaps.last[i] = select(remaining < found, remaining, found)
    n = int(live)
    for _step in range(_MOST):
        _find_cells(gravity, mesh, leaps, n)
        _look(gravity, mesh, leaps, maybe, n)
        n = _go_on(gravity, mesh, before, course, leaps, n)
        if n == 0:
            return
    for i in range(index(n)):
        _keep(course, leaps, i, leaps.time[i], -1.0)


def _find_cells(gravity, mesh, leaps, n):
    """Where every lane is in the frame of the mesh, in which cell, and how far it surely comes from there."""
    cells, rows, most = mesh.body.grid, leaps.rows, _AHEAD * mesh.drive.time_scale
    for i in range(index(n)):
        seen = mesh.seen(leaps.flight(gravity, i), leaps.time[i])
        put(rows, _OWN, i, seen.r)
        put(rows, _PACE, i, seen.v)
        put(rows, _PULL, i, seen.a)
        rows[_ARM, i], rows[_COORDINATES, i] = seen.arm, seen.coordinates
        cell = cell_of(cells, seen.r)
        put(rows, _PLACE, i, cell.place)
        leaps.cell[i], leaps.inside[i] = cell.number, cell.inside
    # What is outside of the grid is in the cell after its last, which holds nothing.
    for i in range(index(n)):
        room = room_of(cells.known.room, index(leaps.cell[i]))
        put(rows, _BACK, i, room.back)
        put(rows, _AHEAD, i, room.ahead)
    for i in range(index(n)):
        seen, longest = leaps.seen(mesh, gravity, i), leaps.last[i] - leaps.time[i]
        at, back, ahead = (column(rows, row, i) for row in (_PLACE, _BACK, _AHEAD))
        # The bound of the acceleration grows with the time that it holds for.
        straight = _CURVED * until_out(None, cells, at - back, at + ahead, seen.r, seen.v)
        within = select(straight < longest, straight, longest)
        within = select(within < most, within, most)
        time = until_out(seen.pulls(within), cells, at - back, at + ahead, seen.r, seen.v)
        time = select(time < within, time, within)
        leaps.until[i], leaps.wall[i] = leaps.time[i] + time, -1.0
    for i in range(index(n)):
        cell = index(leaps.cell[i])
        leaps.count[i] = 0
        if cells.known.room[cell, KIND] == FULL:
            seen, span = leaps.seen(mesh, gravity, i), leaps.until[i] - leaps.time[i]
            turns = seen.bounds(span).acceleration * span
            if not all_away_for(cells.known.room, cell, seen.v, turns):
                first, stop = entries_of(cells, cell)
                leaps.first[i], leaps.count[i] = first, stop - first


def _look(gravity, mesh, leaps, maybe, n):
    """Every lane at the facets in its cell, by their planes first."""
    cells, some = mesh.body.grid, 0
    for i in range(index(n)):
        if leaps.count[i] > 0:
            seen, span = leaps.seen(mesh, gravity, i), leaps.until[i] - leaps.time[i]
            here = way_in(cells, column(leaps.rows, _PLACE, i), seen, span)
            for k in range(leaps.first[i], leaps.first[i] + leaps.count[i]):
                if may_pass(cells, index(k), here):
                    maybe.lane[some], maybe.entry[some] = i, k
                    some += 1
                    if some == _ROOM:
                        _look_at(gravity, mesh, leaps, maybe, some)
                        some = 0
    _look_at(gravity, mesh, leaps, maybe, some)


@outlined
def _look_at(gravity, mesh, leaps, maybe, some):
    """So many lanes each at a facet."""
    facets = mesh.body
    for j in range(index(some)):
        maybe.facet[j] = facets.grid.entries[index(maybe.entry[j])]
        ask_for(facets.table, maybe.facet[j], facets.table.shape[1])
    for j in range(index(some)):
        i, m = index(maybe.lane[j]), maybe.facet[j]
        met = _met(gravity, mesh, leaps, i, m)
        if met.time < leaps.until[i]:
            leaps.until[i], leaps.wall[i] = met.time, met.wall


@outlined
def _met(gravity, mesh, leaps, i, m):
    """The `Hit` of a lane with a facet in this step; without a wall how far it surely meets none, if that is less."""
    facet, flight = member(mesh.body, index(m)), leaps.flight(gravity, i)
    t, until, room = leaps.time[i], leaps.until[i], facet.room.value
    seen = leaps.seen(mesh, gravity, i)
    for _k in range(_STEPS):
        step = _step_to(facet, seen, until - t)
        if not step.time < until - t:
            return Hit(math.inf, -1.0)
        # A step that is round-off of the time, too, leads to the hit.
        if step.wall == 0.0 or (step.wall == _NEARER and not t + step.time > t):
            return Hit(t + step.time, float(m))
        t += max(step.time, _ON * room / seen.bounds(0.0).speed) if step.wall == _BEYOND else step.time
        seen = mesh.seen(flight, t)
    return Hit(t, -1.0)


def _step_to(facet, seen, longest) -> Any:
    """A safe step to a facet: its wall is 0 if it leads to the hit, else _NEARER; or _BEYOND an edge, or _BEHIND it."""
    depth, rate, bend = facet.phi(seen.r), 0.5 * dot(facet.normal, seen.v), 0.5 * dot(facet.normal, seen.a)
    is_behind, room = depth > facet.room.value, 2.0 * EPSILON * seen.coordinates
    if is_behind:
        # It comes back first.
        depth, rate, bend = -depth, -rate, -bend
    own = rise_time(depth, rate, bend)
    ahead, whole = min(2.0 * own, longest), seen.bounds(longest)
    if not is_behind and own < longest and _is_beside(facet, seen, (depth, rate, bend), own, longest, whole):
        return Hit(math.inf, -1.0)
    bounds = seen.bounds(ahead)
    sixth = bounds.jerk * (1.0 / 6.0)
    time = min(rise_time(depth, rate, bend + sixth * ahead), ahead)
    if lets_go(depth, rate, time, room):
        return Hit(_leaving(facet, seen, Level(min(depth, -room), rate, bend, 1.0, 0.0), ahead), _NEARER)
    if is_behind:
        return Hit(time, _BEHIND)
    # How deep a flight may be at the end of the step
    left = 2.0 * sixth * ahead * time * time
    if (left <= room) & (time < longest) and facet.within(_place(seen, time)) >= 0.0:
        return Hit(time, 0.0)
    within = facet.within(seen.r)
    if within < 0.0:
        return Hit(max(time, min(-within / whole.speed, longest)), _BEYOND)
    return Hit(time, 0.0 if time * bounds.speed <= room else _NEARER)


@outlined
def _leaving(facet, seen, level, longest):
    """A time up to the longest in which a flight that leaves a plane, slowly, surely does not come back to it.

    A particle that slides lets go where nothing pulls it to the wall, and not yet away. The bound of a long time ends
    such a step after round-off, which would be a hit, and so would the next, without end.
    """
    return ThirdDerivativeBound(facet, seen, level).longest(longest)


def _place(seen, t):
    """Where a flight is after a time, but for its jerk."""
    return seen.r + t * (seen.v + (0.5 * t) * seen.a)


def _is_beside(facet, seen, level, own, longest, bounds):
    """Whether a flight surely comes through the plane of a facet beyond an edge, and not back to it.

    Its level c + 2 b t + a t^2 has the root `own`, as in `facet_cells.may_pass`.
    """
    (depth, rate, bend), more = level, bounds.jerk * longest * longest * longest * (1.0 / 6.0) + facet.room.value
    below = rate * rate - bend * depth
    if (rate <= 0.0) | (below <= 4.0 * abs(bend) * more):
        return False
    if bend < 0.0 and depth + longest * (2.0 * rate + longest * bend) <= more:
        return False
    beside = more * (1.0 + bounds.speed / math.sqrt(below))
    return facet.within(_place(seen, own)) < -beside


def _go_on(gravity, mesh, before, course, leaps, n):
    """Every lane to the next cell, or to its hit: how many are under way still."""
    left = 0
    for i in range(index(n)):
        until, wall = leaps.until[i], leaps.wall[i]
        if not leaps.inside[i]:
            until = _until_in(gravity, mesh, leaps, i)
        if wall >= 0.0 or not until < leaps.last[i]:
            _keep(course, leaps, i, until, select(wall < 0.0, -1.0, wall + before))
            continue
        leaps.time[i] = until
        if left < i:
            leaps.move(i, index(left))
        left += 1
    return left


@outlined
def _until_in(gravity, mesh, leaps, i):
    """Until when a lane that is outside of the grid surely does not come into it."""
    cells, seen, longest = mesh.body.grid, leaps.seen(mesh, gravity, i), leaps.last[i] - leaps.time[i]
    cell, time, within = cell_of(cells, seen.r), 0.0, longest
    for _k in range(8):
        until = until_next(seen.pulls(within), cells, cell, seen.r, seen.v)
        time = max(time, min(until, within))
        if not 2.0 * time < within:
            break
        within = math.sqrt(time * within)
    return leaps.time[i] + time


def _keep(course, leaps, i, time, wall):
    """Keep the hit of a lane, if it is the first so far."""
    owner = index(leaps.owner[i])
    if time < course[_TIME, owner]:
        course[_TIME, owner], course[_WALL, owner] = time, wall

"""The first hits of all lanes with the facets of a mesh that moves: from cell to cell in the frame of the mesh.

There a flight is a curve, with a bound of its jerk: each lane goes on for as long as it surely stays among the cells
that it is in. All lanes take a step together, as at a mesh at rest; those in a cell with facets look at these. Where
a flight may come through the plane of one, safe steps to that facet alone lead to the hit: none is skipped.
"""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.gravity import accelerated
from ..kernel.grid import cell_of, entries_of, until_next, until_out
from ..kernel.jit import outlined, select
from ..kernel.limits import EPSILON
from ..kernel.vector import ZERO, column, dot, norm, put
from ..surfaces.facets.facet_cells import may_pass, way_in
from ..surfaces.facets.free_room import FULL, KIND, all_away_for, room_of
from ..surfaces.fields.members import member
from ..surfaces.time_of_impact.course import rise_time
from ..surfaces.time_of_impact.flights import Hit
from ..surfaces.time_of_impact.march import lets_go
from ..surfaces.time_of_impact.rising import InWallFrame, Level, ThirdDerivativeBound, flight_of
from .from_cell_to_cell import MOST, ROOM, UnderWay, maybe_met, under_way
from .table import marked_lanes

# The time of the hit of a lane, a row of `course`.
_TIME = 0
# Safe steps to one facet.
_STEPS = 100
# The bounds of a flight hold for so many times as long as it would be among its cells if it went straight on.
_CURVED = 1.5
# And for at most so many times the time in which the motion changes little: a turn by a radian and a quarter.
_LONGEST = 25.0
# A part of the room of a facet, by which a flight goes on that comes to its plane just beyond an edge.
_ON = 0.5
# Where a step to a facet ends that does not lead to the hit.
_NEARER, _BEYOND, _BEHIND = -1.0, -2.0, -3.0


class Leaps(UnderWay):
    """Those that leap through the cells of a mesh that moves: curves in its frame."""

    own = 8

    def begin(self, i, lane, found):
        """As of `UnderWay`."""
        UnderWay.begin(self, i, lane, found)
        self.rows[_REMAINING, i], self.rows[_FAST, i] = lane.remaining, norm(lane.v)

    def until_in(self, gravity, mesh, i):
        """As of `UnderWay`."""
        return _until_in(gravity, mesh, self, i)

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
    course, leaps, maybe = lanes.course, under_way(Leaps, _ROWS), maybe_met()
    for i in range(index(live)):
        leaps.begin(i, lanes.lane(i), course[_TIME, i])
    n = int(live)
    for _step in range(MOST):
        _find_cells(gravity, mesh, leaps, lanes, n)
        _look(gravity, mesh, leaps, maybe, lanes.order, marked_lanes(lanes, n))
        n = leaps.go_on(gravity, mesh, before, course, n)
        if n == 0:
            return
    for i in range(index(n)):
        leaps.keep(course, i, leaps.time[i], -1.0)


def _find_cells(gravity, mesh, leaps, lanes, n):
    """Where every lane is in the frame of the mesh, in which cell, how far it surely comes, and whether it may meet."""
    cells, rows, most = mesh.body.grid, leaps.rows, _LONGEST * mesh.drive.time_scale
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
        lanes.marked[i] = False
        if cells.known.room[cell, KIND] == FULL:
            seen, span = leaps.seen(mesh, gravity, i), leaps.until[i] - leaps.time[i]
            turns = seen.bounds(span).acceleration * span
            lanes.marked[i] = not all_away_for(cells.known.room, cell, seen.v, turns)


def _look(gravity, mesh, leaps, maybe, order, n):
    """So many lanes at the facets in their cells, by their planes first."""
    cells, some = mesh.body.grid, 0
    for j in range(index(n)):
        i = index(order[j])
        seen, span = leaps.seen(mesh, gravity, i), leaps.until[i] - leaps.time[i]
        here, (first, stop) = way_in(cells, column(leaps.rows, _PLACE, i), seen, span), entries_of(cells, leaps.cell[i])
        for k in range(first, stop):
            if may_pass(cells, index(k), here):
                maybe.lane[some], maybe.entry[some] = i, k
                some += 1
                if some == ROOM:
                    _look_at(gravity, mesh, leaps, maybe, some)
                    some = 0
    _look_at(gravity, mesh, leaps, maybe, some)


@outlined
def _look_at(gravity, mesh, leaps, maybe, some):
    """So many lanes each at a facet."""
    maybe.look_up(mesh.body, index(some))
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

"""Find the first hits of all lanes with the facets of a moving mesh, from cell to cell in the frame of the mesh.

In this frame a flight is a curve with a bound of its jerk: each lane goes on while it surely stays among the cells
that it is in. The loops are those of a mesh at rest. Where a flight may pass through the plane of a facet, safe steps
to this facet alone lead to the hit: none is skipped.
"""

import math
from typing import Any

import numpy as np

from ..kernel.arrays import index, unwritten
from ..kernel.grid import cell_of, until_next, until_out
from ..kernel.jit import Array, outlined, select
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import column, dot, norm, put
from ..surfaces.facets.facet_cells import CurveBound, FlightInCell, flight_in
from ..surfaces.fields.members import member
from ..surfaces.time_of_impact.course import positive, rise_time
from ..surfaces.time_of_impact.flights import Hit
from ..surfaces.time_of_impact.march import lets_go
from ..surfaces.time_of_impact.rising import InWallFrame, Level, ThirdDerivativeBound, flight_of
from ..surfaces.time_of_impact.safe import CURVED
from .from_cell_to_cell import MIDDLE, ROWS, SPEED, START, UnderWay, go_from_cell_to_cell, under_way
from .table import LANES, STRIDE, whole_eights

# More rows of a lane that is under way: of its flight at its start, and of its state in the frame of the mesh.
_REMAINING, _FAST = SPEED + 3, SPEED + 4
_PLACE, _PACE, _PULL, _ARM, _COORDINATES = ROWS, ROWS + 3, ROWS + 6, ROWS + 9, ROWS + 10
# Then its way through its cell, which begins at its place relative to the middle of the cell.
_WAY, _BENT, _NUMBERS, _PIECE = ROWS + 11, ROWS + 14, tuple(range(ROWS + 17, ROWS + 22)), ROWS + 22
# Safe steps to one facet.
_STEPS = 100
# The bounds of a flight hold for at most this multiple of the time in which the motion changes little: a turn by a
# radian and a quarter.
_LONGEST = 25.0
# A flight that comes to the plane of a facet just beyond an edge moves on by this fraction of the room of the facet.
_ON = 0.5
# The number of safe steps to facets that lanes take side by side; most need no more.
_TOGETHER = 5
# Where a step to a facet leads: to the hit, nearer to it, to its plane beyond an edge, or to a place in front of it;
# past it in the time that counts, or to a lane that takes its steps by itself.
_TO_HIT, _NEARER, _BEYOND, _BEHIND, _PAST, _ALONE = 0.0, -1.0, -2.0, -3.0, -4.0, -5.0


class UnderWayInMotion(UnderWay):
    """Lanes that go through the cells of a moving mesh: curves in its frame."""

    width, own = ROWS + 23, 8

    def begin(self, i, lane, found):
        UnderWay.begin(self, i, lane, found)
        self.rows[_REMAINING, i], self.rows[_FAST, i] = lane.remaining, norm(lane.v)

    def flight(self, gravity, i):
        """Return the flight of a lane."""
        r, v, rows = column(self.rows, START, i), column(self.rows, SPEED, i), self.rows
        return flight_of(r, v, gravity, rows[_REMAINING, i], rows[_FAST, i])

    def seen(self, mesh, gravity, i):
        """Return a lane in the frame of the mesh now, as `InWallFrame`."""
        rows, flight = self.rows, self.flight(gravity, i)
        return InWallFrame(
            mesh.drive, column(rows, _PLACE, i), column(rows, _PACE, i), column(rows, _PULL, i),
            flight.fastest(self.time[i]), rows[_ARM, i], flight.weight(), rows[_COORDINATES, i],
        )  # fmt: skip

    def facets(self, mesh):
        return mesh.body

    def look_up(self, mesh, n):
        track = mesh.drive.track
        if track is not None:
            for i in range(index(n)):
                self.rows[_PIECE, i] = float(track.piece_at(self.time[i] - self.rows[_REMAINING, i]))

    def see(self, gravity, mesh, i):
        rows = self.rows
        seen = mesh.on_piece(int(rows[_PIECE, i])).seen(self.flight(gravity, i), self.time[i])
        put(rows, _PLACE, i, seen.r)
        put(rows, _PACE, i, seen.v)
        put(rows, _PULL, i, seen.a)
        rows[_ARM, i], rows[_COORDINATES, i] = seen.arm, seen.coordinates
        return seen.r

    def now(self, gravity, i):
        return column(self.rows, _PLACE, i), column(self.rows, _PACE, i)

    def until_out(self, gravity, mesh, i, first, last):
        cells, most = mesh.body.grid, _LONGEST * mesh.drive.time_scale
        seen, longest = self.seen(mesh, gravity, i), self.last[i] - self.time[i]
        # The bound of the acceleration grows with the time that it holds for.
        straight = CURVED * until_out(None, cells, first, last, seen.r, seen.v)
        within = select(straight < longest, straight, longest)
        within = select(within < most, within, most)
        time = until_out(seen.pulls(within), cells, first, last, seen.r, seen.v)
        return select(time < within, time, within)

    def until_in(self, gravity, mesh, i):
        return _until_in(gravity, mesh, self, i)

    def may_meet(self, gravity, mesh, i, cone):
        seen, span = self.seen(mesh, gravity, i), self.until[i] - self.time[i]
        # The velocity is around the mean of those at both ends of its way.
        jerk, half = seen.jerk(span), 0.5 * span
        change, off = half * seen.a, half * span * jerk.rest
        if jerk.known is not None:
            bent = (0.5 * half * span) * jerk.known
            change, off = change + bent, off + 0.5 * norm(bent)
        return not cone.is_left(seen.v + change, norm(change) + off)

    def keep_way(self, gravity, mesh, i):
        rows, seen, span = self.rows, self.seen(mesh, gravity, i), self.until[i] - self.time[i]
        at = column(rows, MIDDLE, i)
        way = flight_in(mesh.body.grid, at, seen.v, seen.a, span, seen.jerk(span))
        for row, vector in ((MIDDLE, way.at), (_WAY, way.way), (_BENT, way.bent)):
            put(rows, row, i, vector)
        curve = way.curve
        for row, number in zip(_NUMBERS, (way.slow, way.weak, curve.off, curve.bends, curve.reach), strict=True):
            rows[row, i] = number

    def way(self, _gravity, _mesh, i):
        rows = self.rows
        at, way, bent = (column(rows, row, i) for row in (MIDDLE, _WAY, _BENT))
        slow, weak, off, bends, reach = (rows[row, i] for row in _NUMBERS)
        return FlightInCell(at, way, bent, slow, weak, CurveBound(off, bends, reach))

    def meet(self, gravity, mesh, maybe, some):
        for first in range(0, some, LANES):
            _meet(gravity, mesh, self, maybe, index(first), min(int(some) - int(first), LANES))


@outlined
def go_through_moving(gravity, mesh, before, lanes, live):
    """Find the first hit of every live lane with facets that have `before` walls before them; keep an earlier one."""
    go_from_cell_to_cell(under_way(UnderWayInMotion), gravity, mesh, before, lanes, live)


# --- Facets ----------------------------------------------------------------------------------------------


@outlined
def _meet(gravity, mesh, under, maybe, first, count):
    """Take the hits with `count` facets, except those that a flight surely misses, by safe steps side by side."""
    marked, near = unwritten(STRIDE, np.bool_), near_facets()
    last = first + index(count - 1)
    for n in range(index(count), whole_eights(count)):
        maybe.lane[first + n], maybe.facet[first + n] = maybe.lane[last], maybe.facet[last]
    for n in range(whole_eights(count)):
        i, facet = index(maybe.lane[first + n]), member(mesh.body, index(maybe.facet[first + n]))
        way = facet.way_past(under.seen(mesh, gravity, i), under.until[i] - under.time[i])
        marked[n], near.step[n] = not way.misses, way.begin
    left = index(0)
    for n in range(index(count)):
        i = index(maybe.lane[first + n])
        near.lane[left], near.facet[left], near.time[left] = i, maybe.facet[first + n], under.time[i] + near.step[n]
        left += index(marked[n])
    for _round in range(_TOGETHER):
        count = near.in_eights(left)
        near.look_up(mesh, under, count)
        for k in range(count):
            near.approach(gravity, mesh, under, k)
        left = near.close_up(gravity, mesh, under, left)
    for k in range(left):
        near.go_alone(gravity, mesh, under, k)


class NearFacets(Record):
    """Lanes that are each on its way to a facet by safe steps."""

    lane: Array  # int64
    facet: Array  # int64
    time: Array  # the time of its flight so far
    step: Array  # the next safe step
    leads: Array  # where it leads, one of _TO_HIT, _NEARER, _PAST and _ALONE
    piece: Array  # int64, the piece of a path that the mesh is on

    def look_up(self, mesh, under, count):
        """Look up the numbers that `approach` needs, for `count` lanes."""
        track = mesh.drive.track
        if track is not None:
            for k in range(count):
                self.piece[k] = track.piece_at(self.time[k] - under.rows[_REMAINING, index(self.lane[k])])

    def approach(self, gravity, mesh, under, k):
        """Compute the next step, without a branch."""
        i, facet, t = index(self.lane[k]), member(mesh.body, index(self.facet[k])), self.time[k]
        seen = mesh.on_piece(self.piece[k]).seen(under.flight(gravity, i), t)
        self.step[k], self.leads[k] = _approach(facet, seen, t, under.until[i])

    def in_eights(self, left):
        """Fill lanes up to whole vectors with copies of the last one: one lane alone takes as long as eight."""
        count = whole_eights(left)
        for k in range(left, count):
            self.lane[k], self.facet[k], self.time[k] = self.lane[left - 1], self.facet[left - 1], self.time[left - 1]
        return count

    def close_up(self, gravity, mesh, under, left):
        """Take the hits of lanes that have arrived; return the number of lanes still on their way."""
        kept = index(0)
        for k in range(left):
            leads = self.leads[k]
            if leads == _TO_HIT:
                self.arrive(gravity, mesh, under, k)
            elif leads == _ALONE:
                self.go_alone(gravity, mesh, under, k)
            self.lane[kept], self.facet[kept] = self.lane[k], self.facet[k]
            self.time[kept] = self.time[k] + self.step[k]
            kept += index(leads == _NEARER)
        return kept

    def arrive(self, gravity, mesh, under, k):
        """Take a hit, unless the facet gives way there to one with the opposite orientation."""
        i, t, step = index(self.lane[k]), self.time[k], self.step[k]
        # As at rest: flights between two such facets take no time.
        short = (t + step) * under.seen(mesh, gravity, i).bounds(0.0).speed <= mesh.body.like.room.value
        if short:
            self.go_alone(gravity, mesh, under, k)
        else:
            under.take(i, Hit(t + step, float(self.facet[k])))

    def go_alone(self, gravity, mesh, under, k):
        """Take the hit of a lane that makes the rest of its steps by itself."""
        i = index(self.lane[k])
        under.take(i, _met(gravity, mesh, (under.flight(gravity, i), self.time[k], under.until[i]), self.facet[k]))


def near_facets():
    """Allocate `NearFacets` for the lanes of one look."""
    return NearFacets(
        unwritten(STRIDE, np.int64), unwritten(STRIDE, np.int64), unwritten(STRIDE, np.float64),
        unwritten(STRIDE, np.float64), unwritten(STRIDE, np.float64), unwritten(STRIDE, np.int64),
    )  # fmt: skip


@outlined
def _met(gravity, mesh, way, m):
    """Return the first `Hit` of a flight with facet m; `way` is (flight, its time so far, the time at which to end)."""
    facet, (flight, t, until) = member(mesh.body, index(m)), way
    room, seen = facet.room.value, mesh.seen(flight, t)
    for _k in range(_STEPS):
        step = _step_to(facet, seen, until - t)
        if not step.time < until - t:
            return Hit(math.inf, -1.0)
        # A step within the round-off of the time also leads to the hit.
        leads, beyond = step.wall == 0.0 or (step.wall == _NEARER and not t + step.time > t), step.wall == _BEYOND
        if leads:
            beyond = mesh.body.gives_way(index(m), _place(seen, step.time))
            if not beyond:
                return Hit(t + step.time, float(m))
        t += max(step.time, _ON * room / seen.bounds(0.0).speed) if beyond else step.time
        seen = mesh.seen(flight, t)
    return Hit(t, -1.0)


def _approach(facet, seen, t, until):
    """Return the step of `_step_to` and where it leads, without a branch; some lanes go on alone from there."""
    depth, rate, bend = facet.phi(seen.r), 0.5 * dot(facet.normal, seen.v), 0.5 * dot(facet.normal, seen.a)
    longest, room = until - t, 2.0 * EPSILON * seen.coordinates
    ahead = 2.0 * rise_time(depth, rate, bend)
    ahead = select(ahead < longest, ahead, longest)
    jerk, speed = seen.jerk(ahead), seen.bounds(ahead).speed
    third, rest = (1.0 / 6.0) * jerk.along(facet.normal), (1.0 / 6.0) * jerk.off
    time = rise_time(depth, rate, bend + (positive(third) + rest) * ahead)
    time = select(time < ahead, time, ahead)
    is_sure = 2.0 * (abs(third) + rest) * ahead * time * time <= room
    is_near, is_there = is_sure | (time * speed <= room), not facet.is_beyond(seen.place(time, jerk), 0.0)
    was_there = not facet.is_beyond(seen.r, 0.0)
    hits = (is_sure & is_there) | (was_there & (time * speed <= room)) | (not t + time > t)
    alone = (depth > facet.room.value) | lets_go(depth, rate, time, room) | (is_near & (not hits))
    leads = select(hits, _TO_HIT, select(time < longest, _NEARER, _PAST))
    return time, select(alone, _ALONE, select(time < longest, leads, _PAST))


def _step_to(facet, seen, longest) -> Any:
    """Return a safe step to a facet as a `Hit`, where the wall says where the step leads."""
    depth, rate, bend = facet.phi(seen.r), 0.5 * dot(facet.normal, seen.v), 0.5 * dot(facet.normal, seen.a)
    is_behind, room = depth > facet.room.value, 2.0 * EPSILON * seen.coordinates
    if is_behind:
        # First it comes back to the plane.
        depth, rate, bend = -depth, -rate, -bend
    ahead = min(2.0 * rise_time(depth, rate, bend), longest)
    bounds = seen.bounds(ahead)
    sixth = bounds.jerk * (1.0 / 6.0)
    time = min(rise_time(depth, rate, bend + sixth * ahead), ahead)
    if lets_go(depth, rate, time, room):
        return Hit(_leaving(facet, seen, Level(min(depth, -room), rate, bend, 1.0, 0.0), ahead), _NEARER)
    if is_behind:
        return Hit(time, _BEHIND)
    # The largest depth of a flight at the end of the step
    left = 2.0 * sixth * ahead * time * time
    if (left <= room) & (time < longest) and not facet.is_beyond(_place(seen, time), 0.0):
        return Hit(time, 0.0)
    within = facet.within(seen.r)
    if within < 0.0:
        return Hit(max(time, min(-within / seen.bounds(longest).speed, longest)), _BEYOND)
    return Hit(time, 0.0 if time * bounds.speed <= room else _NEARER)


@outlined
def _leaving(facet, seen, level, longest):
    """Return a time up to `longest` in which a flight that leaves a plane slowly surely does not come back to it.

    A particle that slides leaves where the pull to the wall is zero, and not yet away from it. The bound of a long time
    would end such a step after round-off, with a hit, and then the next one, without end.
    """
    return ThirdDerivativeBound(facet, seen, level).longest(longest)


def _place(seen, t):
    """Return the place of a flight after a time, without its jerk."""
    return seen.r + t * (seen.v + (0.5 * t) * seen.a)


@outlined
def _until_in(gravity, mesh, under, i):
    """Return a time until which a lane outside of the grid surely does not come into it."""
    cells, seen, longest = mesh.body.grid, under.seen(mesh, gravity, i), under.last[i] - under.time[i]
    cell, time, within = cell_of(cells, seen.r), 0.0, longest
    for _k in range(8):
        until = until_next(seen.pulls(within), cells, cell, seen.r, seen.v)
        time = max(time, min(until, within))
        if not 2.0 * time < within:
            break
        within = math.sqrt(time * within)
    return under.time[i] + time

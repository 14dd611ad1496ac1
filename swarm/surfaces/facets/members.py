"""The facets of a mesh in kernels: the first facet that a flight meets, and the facets near a point."""

import math
from typing import Any

import numpy as np

from ...kernel.arrays import aligned_copy, fetch, index
from ...kernel.gravity import accelerated, displacement
from ...kernel.grid import cell_of, entries_at, entries_of, until_next, until_out
from ...kernel.jit import outlined, select
from ...kernel.vector import cross, dot, square
from ...state import Floats
from ..fields.members import Members, member
from ..presence.patched import Patched
from ..shapes.plane import PlaneNumbers
from ..time_of_impact import flights
from .facet import ROOM, THIN, Shared
from .facet_cells import BLOCK, blocks_of, flight_in, from_middle, passes
from .free_room import CLOSED, FREE, FULL, KIND, room_of, with_blocks, with_cones, without_entries
from .nearest import foot_on, nearest

# The most cells and blocks of cells that are crossed before a flight is reported as free up to there.
_MOST = 4000
# Facets are coplanar up to this sine of the angle between them. A place is on a plane up to this distance from it,
# in units of round-off. One of two facets is nearer if their distances differ by this part.
_PARALLEL, _ON, _NEARER = 1e-9, 1.0, 1e-9


class Facets(Members, Patched):
    """The facets of a mesh: walls on one side, each between its edges; the data of their grid are `FacetCells`."""

    in_blocks = True

    def gone(self):
        without, known = Members.gone(self).grid, self.grid.known
        return self._replace(grid=without._replace(known=known._replace(room=without_entries(known.room))))

    def ask_for(self, m):
        """Prefetch the data of a facet, before its corners."""
        fetch(self.table, m * self.table.shape[1])
        fetch(self.like.corners.triangles, self.like.corners.row(m) * 3)

    def ask_for_corners(self, m):
        """Prefetch the corners of a facet."""
        corners = self.like.corners
        for k in range(3):
            fetch(corners.vertices, index(corners.triangles[corners.row(m), k]) * 3)

    def as_met(self):
        return self.like._replace(corners=None)

    @outlined
    def field_hit(self, gravity, r, v):
        """Return the first hit, from cell to cell, or the time until which the flight is surely free."""
        cells, t = self.grid, 0.0
        place, pace = r, v
        for _cell in range(_MOST):
            cell = cell_of(cells, place)
            if cell.inside:
                number = index(cell.number)
                room = room_of(cells.known.room, number)
                until = t + until_out(gravity, cells, cell.place - room.back, cell.place + room.ahead, place, pace)
                if cells.known.room[number, KIND] == FULL:
                    here = flight_in(cells, from_middle(cells, cell.place, place), pace, gravity, until - t)
                    found = hit_in(self, gravity, (r, v), (number, until), here)
                    if found.wall >= 0.0:
                        return found
            else:
                until = t + until_next(gravity, cells, cell, place, pace)
            if not until < math.inf:
                return flights.NEVER
            t, place, pace = until, r + displacement(gravity, v, until), accelerated(gravity, v, until)
        return flights.Hit(t, -1.0)

    def tree(self):
        """Return the data by which `foot_on` finds the nearest triangle of a closed mesh."""
        shared = self.like.corners
        return shared.vertices, shared.triangles, self.grid.known.boxes

    def foot(self, tree, r):
        return foot_on(self, tree, r)

    @outlined
    def is_in_another(self, number, r):
        first, stop = entries_at(self.grid, r)
        for k in range(first, stop):
            m = self.grid.entries[k]
            if float(m) != number and member(self, index(m)).distance(r) > 0.0:
                return True
        return False

    @outlined
    def deepest_in_cell(self, r):
        """Return the largest depth behind any facet, or the depth behind the facet nearest to the point.

        At a sharp ridge a point before one of its facets is behind the other. For a point that is lost behind a closed
        mesh it is the distance from the mesh.
        """
        cell = cell_of(self.grid, r)
        first, stop = entries_of(self.grid, cell.number)
        most, near, depth_there, ahead, behind = -math.inf, math.inf, 0.0, math.inf, math.inf
        for k in range(first, stop):
            facet = member(self, index(self.grid.entries[k]))
            distance, is_behind = facet.distance(r), facet.phi(r) > facet.behind()
            most = max(most, distance)
            behind = select(is_behind & (-distance < behind), -distance, behind)
            ahead = select(is_behind | (-distance >= ahead), ahead, -distance)
        # Before all of them, as most points are
        for k in range(first, stop if most > 0.0 else first):
            facet = member(self, index(self.grid.entries[k]))
            depth = facet.phi(r)
            if abs(depth) < near and not facet.is_beyond(r, -(facet.room.value + facet.corners.beyond)):
                near, depth_there = abs(depth), depth
        deepest = most if most <= near else depth_there
        if self.grid.known.boxes is not None:
            # All facets are tested only for a point that may be lost: not where a facet that it is before is as near as
            # another.
            is_lost = first == stop or behind < (1.0 - _NEARER) * ahead
            is_lost = is_lost and self.grid.known.room[index(cell.number), KIND] != FREE
            if is_lost and not self.is_gone():
                deepest = max(deepest, foot_on(self, self.tree(), r).gap)
        return deepest

    def loosened(self, reach):
        room = self.like.room.value + ROOM * reach
        return self._replace(like=self.like._replace(room=Shared(room)))

    def until_out(self, cell, gravity, r, v):
        cells = self.grid
        room = room_of(cells.known.room, index(cell.number))
        until = until_out(gravity, cells, cell.place - room.back, cell.place + room.ahead, r, v)
        return until if cell.inside else until_next(gravity, cells, cell, r, v)

    def way_in_cell(self, cell, seen, span):
        at = from_middle(self.grid, cell.place, seen.r)
        return flight_in(self.grid, at, seen.v, seen.a, span, seen.jerk(span))

    def may_meet(self, cell, k, here):
        return _passes(self.grid, cell.number, k, here)

    @outlined
    def misses(self, m, seen, longest):
        # A place past its plane, by however little, needs the full test.
        facet = member(self, m)
        return (facet.phi(seen.r) <= 0.0) & facet.way_past(seen, longest).misses

    def keeps(self, number, r):
        is_other = (number < 0.0) | (number >= self.count())
        return is_other or self.is_there(number, r, 0.0) or self.wall_after(number, r, 0.0) >= 0.0

    def is_there(self, number, r, near):
        return self.wall(number).is_there(r, near)

    @outlined
    def gives_way(self, m, r):
        """Whether a flight to the plane of a facet passes at r, which is nearer to one that is turned the other way.

        Two such facets meet at a saddle vertex. Each extends beyond its edges by the round-off of places; where both
        do a flight between them would have no end. The facet that the place belongs to, or that is nearer, is met.
        """
        one, (first, stop) = member(self, m), entries_at(self.grid, r)
        room, within = self.like.room.value, one.within(r)
        # Beyond an edge, by round-off: few hits are at such places.
        for k in range(first, stop if one.is_beyond(r, -room) else first):
            other = member(self, index(self.grid.entries[k]))
            turn = cross(one.normal, other.normal)
            is_opposite = dot(one.normal, other.normal) < 0.0 and square(turn) <= _PARALLEL * _PARALLEL
            if is_opposite and abs(other.phi(r)) <= _ON * room and other.within(r) > within:
                return True
        return False

    def whole(self, number):
        facet = self.wall(number)
        return PlaneNumbers(facet.normal, facet.offset)

    def is_ahead(self, number, start, end, near):
        return self.wall(number).is_ahead(start, end, near)

    @outlined
    def wall_after(self, number, r, near):
        """Return the facet that continues the plane of another one at a place, or -1."""
        first, stop = entries_at(self.grid, r)
        normal, found, widest = self.wall(number).normal, -1.0, -near
        for k in range(first, stop):
            m = self.grid.entries[k]
            other = member(self, index(m))
            turn, within = cross(normal, other.normal), other.within(r)
            is_flat = dot(normal, other.normal) > 0.0 and square(turn) <= _PARALLEL * _PARALLEL
            if float(m) != number and is_flat and abs(other.phi(r)) <= _ON * self.like.room.value and within > widest:
                found, widest = float(m), within
        return found


def hit_in(facets, gravity, flight, cell, here):
    """Return the first hit in a cell (its number, when it is left) of a flight (r, v)."""
    (r, v), (number, until) = flight, cell
    found, cells = flights.Hit(until, -1.0), facets.grid
    first, stop = entries_of(cells, number)
    for k in range(first, stop):
        if _passes(cells, number, index(k - first), here):
            m = cells.entries[k]
            hit = hit_of(facets, gravity, r, v, index(m))
            if hit.time < found.time:
                found = hit
    return found


def hit_of(facets, gravity, r, v, m):
    """Return when a flight meets a facet, as a `Hit`."""
    time, _hits = flights.hit(gravity, member(facets, m), r, v)
    room = facets.like.room.value
    # Flights between two facets that are turned against each other take no time.
    if time * time * square(v) <= room * room and facets.gives_way(m, r + displacement(gravity, v, time)):
        time = math.inf
    return flights.Hit(time, float(m))


def _passes(cells, number, k, here):
    """Whether a flight may meet the facet of an entry of the cell with this number."""
    begin, _end = blocks_of(cells, number)
    return passes(cells, index(begin + k // BLOCK), index(k % BLOCK), here)


# --- From a description ----------------------------------------------------------------------------------


def table_of_facets(corners: Floats) -> Floats:
    """Return the normals and the offsets of facets with corners (T, 3, 3), one facet in each row."""
    normal = _normals(*np.moveaxis(corners, 1, 0))
    return aligned_copy(np.concatenate([normal, (normal * corners.mean(axis=1)).sum(axis=1)[:, None]], axis=1))


def table_of_sides(corners: Floats, room: float) -> Floats:
    """Return the numbers of both sides of sheets with corners (T, 3, 3), side by side; `room` is round-off [m]."""
    table = aligned_copy(np.repeat(table_of_facets(corners), 2, axis=0))
    table[1::2] *= -1.0
    table[:, 3] -= THIN * room
    return table


def _normals(a: Floats, b: Floats, c: Floats) -> Floats:
    """Return unit normals of triangles, from the two shorter sides."""
    sides = np.stack([b - a, c - b, a - c])
    longest = (sides**2).sum(axis=2).argmax(axis=0)
    every = np.arange(len(a))
    found = np.cross(sides[(longest + 1) % 3, every], sides[(longest + 2) % 3, every])
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def with_room(facets: Facets, mesh: Any, is_solid: bool) -> Facets:
    """Return the facets with the free blocks around each cell; without a `mesh` all empty cells are free."""
    from scipy.ndimage import label

    grid = facets.grid
    shape = tuple(int(n) for n in grid.shape)
    held = np.diff(grid.first[:-1]).reshape(shape) > 0
    rows = grid.known.room
    with_cones(rows, facets.table[:, :3], grid.entries, grid.first)
    parts, count = label(~held)
    if mesh is None:
        with_blocks(rows, held)
    elif count:
        # The middle of one cell of each part determines its side.
        labels, first = np.unique(parts.ravel(), return_index=True)
        first, labels = first[labels > 0], labels[labels > 0]
        places = np.array(np.unravel_index(first, shape), np.float64)
        low, width = (np.array(row)[:, None] for row in (grid.low, grid.width))
        found = np.empty((4, len(labels)))
        nearest(facets, mesh, np.ascontiguousarray(low + (places + 0.5) * width), found)
        sides = np.full(count + 1, CLOSED, np.int8)
        sides[labels] = np.where(found[3] < 0.0, FREE, CLOSED)
        rows[:-1, KIND] = np.where(held, rows[:-1, KIND].reshape(shape), sides[parts]).ravel()
        with_blocks(rows, held)
    rows[-1, KIND] = FREE if is_solid else CLOSED
    if mesh is None:
        return facets
    return facets._replace(grid=grid._replace(known=grid.known._replace(boxes=mesh[2])))

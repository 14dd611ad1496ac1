"""Many bodies of one kind in kernels: their numbers in one table, and the grid that finds the next one."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import aligned_copy, index
from ...kernel.grid import Grid, cell_of, entries_at, entries_of, layer_of, number_of, until_next
from ...kernel.jit import Array, kernel, outlined, select
from ...kernel.record import Record
from ...kernel.vector import Vec, column, norm, put
from ..facets.facet import CornersOf, Shared
from ..rotation import Rotated
from ..shapes.capsule import CapsuleNumbers
from ..shapes.quadratic import QuadricNumbers
from ..shapes.slab import AXES, SlabNumbers
from ..shapes.solid import SolidNumbers
from ..shapes.sphere import SphereCavity, SphereNumbers, ball, cavity
from ..time_of_impact import flights
from ..time_of_impact.course import rise_time

# The most cells through which a step is followed.
_MOST_CELLS = 4000
# The rows of the identity.
_UNTURNED = Vec(1.0, 0.0, 0.0), Vec(0.0, 1.0, 0.0), Vec(0.0, 0.0, 1.0)
# The kinds with fields of their own in a table, besides vectors and balls.
_KINDS: tuple[Any, ...] = (CapsuleNumbers, QuadricNumbers, SlabNumbers, *AXES, Rotated, SolidNumbers)


class GrownLike(Record):
    """The numbers of one of the bodies of a field, as the centre of a ball with this radius meets its walls."""

    body: Any
    radius: float

    @property
    def lacks_bend(self):
        """Whether the bodies support uniform motion only."""
        return self.body.lacks_bend


class SignedDistance(Record):
    """The gap of a point at a field as one wall, the signed distance outside, and its gradient."""

    gap: float
    normal: Vec


class Members(Record):
    """The bodies of a field: solids; a place outside all of them is admissible."""

    like: Any  # the numbers of one body, which determine the kind
    table: Array  # (members, width) the numbers of each body
    grid: Grid

    # As for a wall at rest, see contract.py.
    flat = accelerates = False

    @property
    def lacks_bend(self):
        """Whether the bodies support uniform motion only."""
        return self.like.lacks_bend

    @property
    def holds_balls(self):
        """Whether balls may meet the bodies: a constant for the compiler."""
        return self.like.holds_balls

    def grown(self, radius):
        """Return the field that the centre of a ball meets."""
        return self._replace(like=GrownLike(self.like, radius))

    def time_scale(self):
        """A time in which the motion of the field changes little [s]."""
        return math.inf

    # Whether each lane tests all bodies on a straight flight.
    few = False
    # Whether the number of empty cells around an empty cell is stored.
    in_blocks = False

    def in_cells(self):
        """Return the field of bodies that a flight meets in the cells that it passes, and nowhere else."""
        return self

    def gone(self):
        """Return the field while all bodies are absent: neither its cells nor its grid have entries."""
        grid = self.in_cells().grid
        return self.in_cells()._replace(grid=grid._replace(first=np.zeros_like(grid.first), entries=grid.entries[:0]))

    def is_gone(self):
        """Whether all bodies are absent."""
        return self.grid.entries.shape[0] == 0

    def as_met(self):
        """Return `like` for a body that is met: without the data that only determine where it is met."""
        return self.like

    def count(self):
        """Return the number of bodies."""
        return float(self.table.shape[0])

    def wall(self, number):
        """Return one body as a surface; for a number out of range the first or the last body."""
        last = self.table.shape[0] - 1.0
        return member(self, index(int(select(number < 0.0, 0.0, select(number > last, last, number)))))

    def far(self, r):
        """Lower bound of the distance of a place from all bodies: the distance from the end of an empty cell."""
        cell = cell_of(self.grid, r)
        first, stop = entries_of(self.grid, cell.number)
        if not cell.inside or first < stop:
            return 0.0
        return _until_side(self, cell, r)

    def reach(self, lease):
        """A time during which a particle surely meets no body, as `Smooth.reach`."""
        return rise_time(-self.far(lease.r), 0.5 * (norm(lease.v) + lease.width), 0.5 * norm(lease.a))

    @outlined
    def is_in_another(self, number, r):
        """Whether a point is in any body except `number`."""
        first, stop = entries_at(self.grid, r)
        for k in range(first, stop):
            m = self.grid.entries[k]
            body = member(self, index(m))
            if body.level_of(body.inner(r)) > 0.0 and float(m) != number:
                return True
        return False

    @outlined
    def field_hit(self, gravity, r, v):
        """Return the first `Hit` of a free flight in its cell, or when it leaves the cell, free until then."""
        grid = self.grid
        cell = cell_of(grid, r)
        found, (first, stop) = flights.Hit(until_next(gravity, grid, cell, r, v), -1.0), entries_of(grid, cell.number)
        for k in range(first, stop):
            m = grid.entries[k]
            time, hits = flights.hit(gravity, member(self, index(m)), r, v)
            if time < found.time:
                found = flights.Hit(time, select(hits, float(m), -1.0))
        return found

    @outlined
    def other_hit(self, number, r, v, until):
        """Return the first `Hit` of a straight flight up to `until` with any body except `number`; -1: any body."""
        grid, t, place = self.grid, 0.0, r
        for _cell in range(_MOST_CELLS):
            cell = cell_of(grid, place)
            found = flights.Hit(t + self.until_out(cell, None, place, v), -1.0)
            first, stop = entries_of(grid, cell.number)
            for k in range(first, stop):
                m = float(grid.entries[k])
                time, _hits = member(self, index(grid.entries[k])).first_hit(r, v)
                if time < found.time and m != number:
                    found = flights.Hit(time, m)
            if found.wall >= 0.0 or not found.time < until:
                return found
            t, place = found.time, r + found.time * v
        return flights.Hit(t, -1.0)

    def keeps(self, number, r):
        """Whether a step along body `number` that ends at a place on it ends where it is present; else True."""
        return True

    # --- For a field that moves: see safe.py ---

    def loosened(self, reach):
        """Return the field for places in its frame with a round-off that is larger by that of `reach` [m]."""
        return self

    def until_out(self, cell, gravity, r, v):
        """Return when a flight is beyond a cell, or the free cells around it; its acceleration may have bounds."""
        return until_next(gravity, self.grid, cell, r, v)

    def way_in_cell(self, cell, seen, span):
        """Return the argument of `may_meet` for a flight in a cell during `span` [s]."""
        return

    def misses(self, m, seen, longest):
        """Whether a flight, seen in the frame of the field, surely misses body `m` until `longest`."""
        return False

    def may_meet(self, cell, k, here):
        """Whether this flight may meet the body of an entry of the cell."""
        return True

    # --- The bodies in the cell of a point ---

    def count_in_cell(self, r):
        """Return the number of bodies in the cell of a point."""
        first, stop = entries_at(self.grid, r)
        return int(stop - first)

    def list_in_cell(self, k, before, r, into):
        """Write their numbers, counted from `before`, into into[k:]; return how many were written."""
        first, stop = entries_at(self.grid, r)
        for i in range(first, stop):
            into[k + i - first] = before + self.grid.entries[i]
        return int(stop - first)

    def one_in_cell(self, k, r):
        """Return the number of entry k of the cell."""
        first, _stop = entries_at(self.grid, r)
        return self.grid.entries[first + k]

    def until_next_cell(self, r, v):
        """Return when a straight flight may meet a body of another cell."""
        return until_next(None, self.grid, cell_of(self.grid, r), r, v)

    @outlined
    def deepest_in_cell(self, r):
        """Return the largest distance into any body of the cell."""
        most = -math.inf
        first, stop = entries_at(self.grid, r)
        for k in range(first, stop):
            most = max(most, member(self, index(self.grid.entries[k])).distance(r))
        return most

    @outlined
    def foot(self, tree, r):
        """Return the `SignedDistance` of a point for all bodies as one wall; `tree` is that of a mesh.

        The gap of a point in several bodies is the root of the sum of the squares of its depths.
        """
        best, which = nearest_body(self, r)
        if not best < math.inf:
            return SignedDistance(-math.inf, Vec(1.0, 0.0, 0.0))
        if best >= 0.0:
            return SignedDistance(-best, -1.0 * member(self, index(which - 1)).gradient(r))
        first, stop = entries_at(self.grid, r)
        squares, sums = 0.0, Vec(0.0, 0.0, 0.0)
        for k in range(first, stop):
            body = member(self, index(self.grid.entries[k]))
            depth = -body.phi(r)
            if depth > 0.0:
                squares, sums = squares + depth * depth, sums - depth * body.gradient(r)
        gap = math.sqrt(squares)
        return SignedDistance(gap, sums * (1.0 / gap))


class Few(Members):
    """Few bodies, all of which each lane tests on a straight flight, faster than from cell to cell."""

    few = True

    def in_cells(self):
        return Members(*self)


def _until_side(members, cell, r):
    """Return the distance of a place from the nearest face of its cell, or of the block of free cells around it."""
    ahead, back = (members.until_out(cell, None, r, Vec(way, way, way)) for way in (1.0, -1.0))
    return min(ahead, back)


def member(members, m):
    """Return the numbers of one body."""
    return gathered(members.like, members.table, m, 0)


def gathered(like, table, m, k):
    """Return numbers of the kind of `like`, from row m of a table, from column k on."""
    numbers, _after = _taken(like, table, m, k)
    return numbers


def _taken(like, table, m, k):
    """Return the result of `gathered`, and the column after its last one."""
    # Numbers first: plain Python tests in this order.
    if not isinstance(like, tuple):
        return (None, k) if like is None else (table[m, k], k + 1)
    if isinstance(like, GrownLike):
        body, k = _taken(like.body, table, m, k)
        return body.grown(like.radius), k
    if isinstance(like, SphereNumbers):
        # Four of its numbers are half a line of the cache; the others follow from them.
        made = cavity if isinstance(like, SphereCavity) else ball
        return made(Vec(table[m, k], table[m, k + 1], table[m, k + 2]), table[m, k + 3]), k + 4
    if isinstance(like, Shared):
        return like, k
    if isinstance(like, CornersOf):
        return like.of(m), k
    if isinstance(like, AXES):
        return type(like)(1.0), k + 1  # type: ignore[arg-type]
    parts: tuple[Any, ...] = ()
    for part in like:
        one, k = _taken(part, table, m, k)
        parts = (*parts, one)
    return parts if type(like) is tuple else type(like)(*parts), k


def width(like):
    """Return the number of columns: a constant for the compiler."""
    if not isinstance(like, tuple):
        return 0 if like is None else 1
    if isinstance(like, GrownLike):
        return width(like.body)
    if isinstance(like, (SphereNumbers, Shared, CornersOf)):
        return 4 if isinstance(like, SphereNumbers) else 0
    return sum(map(width, like))


def table_of(bodies: Sequence[Any]) -> NDArray[np.float64]:
    """Return the table of bodies, each the numbers of a wall, all of one kind."""
    return aligned_copy(np.array([_written(body) for body in bodies]))


def can_be_member(wall: Any) -> bool:
    """Whether a body with these numbers can be in a field."""
    if isinstance(wall, (float, type(None))):
        return True
    if isinstance(wall, (SphereNumbers, Vec)):
        return True
    return (type(wall) is tuple or isinstance(wall, _KINDS)) and all(can_be_member(part) for part in wall)


def kind_of(wall: Any) -> Any:
    """Return the types of numbers that one field may hold, for any axes."""
    wall = wall.body if isinstance(wall, Rotated) else wall
    if isinstance(wall, (Vec, *AXES)):
        return Vec
    return (type(wall), *map(kind_of, wall)) if isinstance(wall, tuple) else type(wall)


def alike(walls: Sequence[Any]) -> list[Any]:
    """Return the numbers of bodies of one kind, of one type also if only some of them are turned."""
    if len({_type_of(wall) for wall in walls}) == 1:
        return list(walls)
    turned = any(isinstance(wall, Rotated) for wall in walls)
    return [_in_general(wall, turned) for wall in walls]


def _type_of(wall: Any) -> Any:
    return (type(wall), *map(_type_of, wall)) if isinstance(wall, tuple) else type(wall)


def _in_general(wall: Any, turned: bool) -> Any:
    """Return the same numbers, of the type of a body turned in any way."""
    if isinstance(wall, AXES):
        return Vec(*(float(isinstance(wall, axis)) for axis in AXES))
    if isinstance(wall, Rotated):
        return wall._replace(body=_in_general(wall.body, False))
    if isinstance(wall, SolidNumbers):
        return wall._replace(parts=tuple(_in_general(part, _is_round(part)) for part in wall.parts))
    if isinstance(wall, SlabNumbers):
        return SlabNumbers(*(_in_general(part, False) for part in wall))
    return Rotated(wall, *_UNTURNED) if turned else wall


def _is_round(part: Any) -> bool:
    """Whether a part of a solid may be turned."""
    return isinstance(part, QuadricNumbers)


def _written(like: Any) -> list[float]:
    """Return the columns of one body."""
    if like is None:
        return []
    if isinstance(like, SphereNumbers):
        return [*like.center, like.radius]
    return [number for part in like for number in _written(part)] if isinstance(like, tuple) else [float(like)]


# --- The nearest bodies ----------------------------------------------------------------------------------


@kernel
def nearest(members, points, found):
    """Write the gradient and phi of the body with the least phi near each of the points (3, N) to rows of `found`."""
    for i in range(points.shape[1]):
        best, which = nearest_body(members, column(points, 0, i))
        put(found, 0, i, member(members, index(which - 1)).gradient(column(points, 0, i)))
        found[3, i] = best


@outlined
def nearest_body(members, r):
    """Return the least phi of the bodies near a point, and the number of this body, from 1 on."""
    grid = members.grid
    cells = max(grid.shape.x, max(grid.shape.y, grid.shape.z))
    place = cell_of(grid, r).place
    center = Vec(*(layer_of(layer, count) for layer, count in zip(place, grid.shape, strict=True)))
    best, which, last, shell = math.inf, 0, cells, 0.0
    while shell <= last:
        phi, m = _least_in_shell(members, r, center, shell)
        # A body in the next shell may be nearer still.
        if phi < math.inf and which == 0:
            last = min(last, shell + 1.0)
        if phi < best:
            best, which = phi, m + 1
        shell += 1.0
    return best, which


@outlined
def _least_in_shell(members, r, center, shell):
    """Return the least phi in the cells that are `shell` cells away from one, and the number of its body."""
    grid, best, which = members.grid, math.inf, 0
    for x in _around(center.x, shell, grid.shape.x):
        for y in _around(center.y, shell, grid.shape.y):
            for z in _around(center.z, shell, grid.shape.z):
                if max(abs(x - center.x), max(abs(y - center.y), abs(z - center.z))) < shell:
                    continue
                first, stop = entries_of(grid, int(number_of(grid.shape, x, y, z)))
                for k in range(first, stop):
                    m = grid.entries[k]
                    phi = member(members, index(m)).phi(r)
                    if phi < best:
                        best, which = phi, m
    return best, which


def _around(place, shell, count):
    return range(int(max(place - shell, 0.0)), int(min(place + shell, count - 1.0)) + 1)


@kernel
def within(members, points, found):
    """Write whether each of the points (3, N) is in any body into `found`; on its surface it is not."""
    grid = members.grid
    for i in range(points.shape[1]):
        r = column(points, 0, i)
        (first, stop), inside = entries_at(grid, r), False
        for k in range(first, stop):
            inside = inside or member(members, index(grid.entries[k])).phi(r) < 0.0
        found[i] = inside


@kernel
def touched(members, points, radius, found):
    """Write how far balls at points (3, N) with radii (N,) reach into any body into `found`; -inf if none is near."""
    for i in range(points.shape[1]):
        found[i] = members.grown(radius[i]).deepest_in_cell(column(points, 0, i))

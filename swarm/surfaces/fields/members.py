"""Many bodies of one kind as kernels take them: their numbers in one table, and the grid that finds the next one."""

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

# So many cells a step is followed through at most.
_MOST_CELLS = 4000
# The rows of a rotation that turns nothing.
_UNTURNED = Vec(1.0, 0.0, 0.0), Vec(0.0, 1.0, 0.0), Vec(0.0, 0.0, 1.0)
# What has fields of its own in a table, beside vectors and balls.
_KINDS: tuple[Any, ...] = (CapsuleNumbers, QuadricNumbers, SlabNumbers, *AXES, Rotated, SolidNumbers)


class GrownLike(Record):
    """The numbers of one of the bodies of a field, as the centre of a ball with this radius meets its walls."""

    body: Any
    radius: float

    @property
    def lacks_bend(self):
        """Whether they cannot move other than uniformly."""
        return self.body.lacks_bend


class SignedDistance(Record):
    """The gap of a point at a field as one wall, the signed distance outside, and its gradient."""

    gap: float
    normal: Vec


class Members(Record):
    """The bodies of a field: solids, outside of all of which is admissible."""

    like: Any  # the numbers of one of them, which say of what kind they are
    table: Array  # (members, width) the numbers of each
    grid: Grid

    # What a wall at rest says, as in contract.py.
    flat = accelerates = False

    @property
    def lacks_bend(self):
        """Whether they cannot move other than uniformly."""
        return self.like.lacks_bend

    @property
    def holds_balls(self):
        """Whether balls may meet them: a constant for the compiler."""
        return self.like.holds_balls

    def grown(self, radius):
        """The field that the centre of a ball meets."""
        return self._replace(like=GrownLike(self.like, radius))

    def time_scale(self):
        """A time in which their motion changes little [s]."""
        return math.inf

    # Whether each lane looks at all of them on a straight flight.
    few = False
    # Whether it is known how many cells around an empty one are empty.
    in_blocks = False

    def in_cells(self):
        """The field of bodies that a flight meets in the cells that it passes, and nowhere else."""
        return self

    def gone(self):
        """The field while none of the bodies is there: no cell has any, nor does the grid."""
        grid = self.in_cells().grid
        return self.in_cells()._replace(grid=grid._replace(first=np.zeros_like(grid.first), entries=grid.entries[:0]))

    def is_gone(self):
        """Whether none of the bodies is there."""
        return self.grid.entries.shape[0] == 0

    def as_met(self):
        """`like` of one that is met: what only says where it is met is left out."""
        return self.like

    def count(self):
        """Their number."""
        return float(self.table.shape[0])

    def wall(self, number):
        """One of them, as a surface; of a number that none has the first or the last."""
        last = self.table.shape[0] - 1.0
        return member(self, index(int(select(number < 0.0, 0.0, select(number > last, last, number)))))

    def far(self, r):
        """A lower bound of the distance of a place from all of them: that from the end of a cell with none."""
        cell = cell_of(self.grid, r)
        first, stop = entries_of(self.grid, cell.number)
        if not cell.inside or first < stop:
            return 0.0
        return _until_side(self, cell, r)

    def reach(self, lease):
        """A time during which a particle surely meets none of them, as `Smooth.reach`."""
        return rise_time(-self.far(lease.r), 0.5 * (norm(lease.v) + lease.width), 0.5 * norm(lease.a))

    @outlined
    def is_in_another(self, number, r):
        """Whether a point is in any but the one with this number."""
        first, stop = entries_at(self.grid, r)
        for k in range(first, stop):
            m = self.grid.entries[k]
            body = member(self, index(m))
            if body.level_of(body.inner(r)) > 0.0 and float(m) != number:
                return True
        return False

    @outlined
    def field_hit(self, gravity, r, v):
        """The first `Hit` of a free flight in its cell, or when it leaves that, free so far."""
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
        """The first `Hit` of a straight flight that lasts so long with any but this one; -1: with any of them."""
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
        """Whether a step along one of them that ends at a place on it ends where that is; of any other it says so."""
        return True

    # --- Of a field that moves: see safe.py ---

    def loosened(self, reach):
        """The field where places in its frame have round-off of so much more than its own size [m]."""
        return self

    def until_out(self, cell, gravity, r, v):
        """When a flight is beyond a cell, or the free cells around it; of its acceleration there may be bounds."""
        return until_next(gravity, self.grid, cell, r, v)

    def way_in_cell(self, cell, seen, span):
        """What `may_meet` asks of a flight that is so long in a cell [s]."""
        return

    def misses(self, m, seen, longest):
        """Whether a flight, seen in the frame of the field, surely misses one of its bodies for so long."""
        return False

    def may_meet(self, cell, k, here):
        """Whether that flight may meet the body of an entry of the cell."""
        return True

    # --- Of those in the cell of a point ---

    def count_in_cell(self, r):
        """Their number."""
        first, stop = entries_at(self.grid, r)
        return int(stop - first)

    def list_in_cell(self, k, before, r, into):
        """Their numbers, with so many walls before them, into into[k:], and how many they are."""
        first, stop = entries_at(self.grid, r)
        for i in range(first, stop):
            into[k + i - first] = before + self.grid.entries[i]
        return int(stop - first)

    def one_in_cell(self, k, r):
        """The number of one of them."""
        first, _stop = entries_at(self.grid, r)
        return self.grid.entries[first + k]

    def until_next_cell(self, r, v):
        """When a straight flight may meet another one."""
        return until_next(None, self.grid, cell_of(self.grid, r), r, v)

    @outlined
    def deepest_in_cell(self, r):
        """The largest distance into any of them."""
        most = -math.inf
        first, stop = entries_at(self.grid, r)
        for k in range(first, stop):
            most = max(most, member(self, index(self.grid.entries[k])).distance(r))
        return most

    @outlined
    def foot(self, tree, r):
        """The `SignedDistance` of a point on all of them as one wall; `tree` is that of a mesh.

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
    """So few bodies that each lane looks at all of them on a straight flight, faster than from cell to cell."""

    few = True

    def in_cells(self):
        return Members(*self)


def _until_side(members, cell, r):
    """The distance of a place from the nearest face of its cell, or of the block of free cells around it."""
    ahead, back = (members.until_out(cell, None, r, Vec(way, way, way)) for way in (1.0, -1.0))
    return min(ahead, back)


def member(members, m):
    """The numbers of one body."""
    return gathered(members.like, members.table, m, 0)


def gathered(like, table, m, k):
    """Numbers of one kind with `like`, from row m of a table, from column k on."""
    numbers, _after = _taken(like, table, m, k)
    return numbers


def _taken(like, table, m, k):
    """What `gathered` gives, and the column after its last one."""
    # Numbers first: plain Python asks in this order.
    if not isinstance(like, tuple):
        return (None, k) if like is None else (table[m, k], k + 1)
    if isinstance(like, GrownLike):
        body, k = _taken(like.body, table, m, k)
        return body.grown(like.radius), k
    if isinstance(like, SphereNumbers):
        # Four numbers of it are half a line of the cache; the others follow from them.
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
    """The number of columns: a constant for the compiler."""
    if not isinstance(like, tuple):
        return 0 if like is None else 1
    if isinstance(like, GrownLike):
        return width(like.body)
    if isinstance(like, (SphereNumbers, Shared, CornersOf)):
        return 4 if isinstance(like, SphereNumbers) else 0
    return sum(map(width, like))


def table_of(bodies: Sequence[Any]) -> NDArray[np.float64]:
    """The table of bodies, each the numbers of a wall, all of one kind."""
    return aligned_copy(np.array([_written(body) for body in bodies]))


def can_be_member(wall: Any) -> bool:
    """Whether a field may be of bodies with such numbers."""
    if isinstance(wall, (float, type(None))):
        return True
    if isinstance(wall, (SphereNumbers, Vec)):
        return True
    return (type(wall) is tuple or isinstance(wall, _KINDS)) and all(can_be_member(part) for part in wall)


def kind_of(wall: Any) -> Any:
    """The types of numbers that one field may hold, whatever their axes are."""
    wall = wall.body if isinstance(wall, Rotated) else wall
    if isinstance(wall, (Vec, *AXES)):
        return Vec
    return (type(wall), *map(kind_of, wall)) if isinstance(wall, tuple) else type(wall)


def alike(walls: Sequence[Any]) -> list[Any]:
    """The numbers of bodies of one kind, of one type also where some of them are turned and others are not."""
    if len({_type_of(wall) for wall in walls}) == 1:
        return list(walls)
    turned = any(isinstance(wall, Rotated) for wall in walls)
    return [_in_general(wall, turned) for wall in walls]


def _type_of(wall: Any) -> Any:
    return (type(wall), *map(_type_of, wall)) if isinstance(wall, tuple) else type(wall)


def _in_general(wall: Any, turned: bool) -> Any:
    """The same numbers, of the type that a body turned in any way has."""
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
    """The columns of one body."""
    if like is None:
        return []
    if isinstance(like, SphereNumbers):
        return [*like.center, like.radius]
    return [number for part in like for number in _written(part)] if isinstance(like, tuple) else [float(like)]


# --- Which is near ---------------------------------------------------------------------------------------


@kernel
def nearest(members, points, found):
    """The gradient and phi, in the rows of `found`, of the body with the least phi near each of the points (3, N)."""
    for i in range(points.shape[1]):
        best, which = nearest_body(members, column(points, 0, i))
        put(found, 0, i, member(members, index(which - 1)).gradient(column(points, 0, i)))
        found[3, i] = best


@outlined
def nearest_body(members, r):
    """The least phi of the bodies near a point, and the number of that body, from 1 on."""
    grid = members.grid
    cells = max(grid.shape.x, max(grid.shape.y, grid.shape.z))
    place = cell_of(grid, r).place
    center = Vec(*(layer_of(layer, count) for layer, count in zip(place, grid.shape, strict=True)))
    best, which, last, shell = math.inf, 0, cells, 0.0
    while shell <= last:
        phi, m = _least_in_shell(members, r, center, shell)
        # What is one shell farther may be nearer still.
        if phi < math.inf and which == 0:
            last = min(last, shell + 1.0)
        if phi < best:
            best, which = phi, m + 1
        shell += 1.0
    return best, which


@outlined
def _least_in_shell(members, r, center, shell):
    """The least phi in the cells that are `shell` cells away from one, and the number of its body."""
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
    """Whether each of the points (3, N) is in any body, into `found`; on its surface it is not."""
    grid = members.grid
    for i in range(points.shape[1]):
        r = column(points, 0, i)
        (first, stop), inside = entries_at(grid, r), False
        for k in range(first, stop):
            inside = inside or member(members, index(grid.entries[k])).phi(r) < 0.0
        found[i] = inside


@kernel
def touched(members, points, radius, found):
    """How far balls at points (3, N) with their radii (N,) reach into any body, into `found`; -inf if none is near."""
    for i in range(points.shape[1]):
        found[i] = members.grown(radius[i]).deepest_in_cell(column(points, 0, i))

"""Many bodies of one kind as kernels take them: their numbers in one table, and the grid that finds the next one."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...kernel.gravity import Nothing
from ...kernel.jit import Array, by_type, index, inlined, kernel, outlined, select
from ...kernel.vector import Vec, column, put
from .. import contract, flights, fold, near
from ..fold import Chain
from ..rotation import Rotated
from ..shapes.capsule import CapsuleNumbers
from ..shapes.ellipsoid import EllipsoidNumbers
from ..shapes.quadratic import QuadricNumbers
from ..shapes.slab import AlongX, AlongY, AlongZ, SlabNumbers
from ..shapes.solid import SolidNumbers
from ..shapes.sphere import SphereNumbers
from .grid import Grid, cell_of, until_next

# The rows of a rotation that turns nothing.
_AXES = Vec(1.0, 0.0, 0.0), Vec(0.0, 1.0, 0.0), Vec(0.0, 0.0, 1.0)
# Bytes of a line of the cache.
_LINE = 64


class Members(NamedTuple):
    """The bodies of a field: solids, outside of all of which is admissible."""

    like: Any  # the numbers of one of them, which say of what kind they are
    table: Array  # (members, width) the numbers of each
    grid: Grid


class Few(Members):
    """So few bodies that each lane looks at all of them on a straight flight, faster than from cell to cell."""


@inlined
def member(members, m):
    """The numbers of one body."""
    return gathered(members.like, members.table, m, 0)


@by_type
def gathered(like, table, m, k):
    """What is like that, from row m of a table, from column k on."""
    return table[m, k]


@by_type
def width(like):
    """How many columns it takes: a constant for the compiler."""
    return 1


def table_of(bodies: Sequence[Any]) -> NDArray[np.float64]:
    """The table of bodies, each the numbers of a wall, all of one kind."""
    return aligned(np.array([_written(body) for body in bodies]))


def can_be_member(wall: Any) -> bool:
    """Whether a field may be of bodies with such numbers."""
    if isinstance(wall, (float, type(None))):
        return True
    if isinstance(wall, (SphereNumbers, Vec)):
        return True
    known = gathered.dispatch(type(wall)) is not gathered.dispatch(object)
    return known and all(map(can_be_member, wall))


def kind_of(wall: Any) -> Any:
    """What numbers have in common that a field may hold: their types, whatever their axes are."""
    wall = wall.body if isinstance(wall, Rotated) else wall
    if isinstance(wall, Vec | AlongX | AlongY | AlongZ):
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
    if isinstance(wall, AlongX | AlongY | AlongZ):
        return Vec(*(float(isinstance(wall, axis)) for axis in (AlongX, AlongY, AlongZ)))
    if isinstance(wall, Rotated):
        return wall._replace(body=_in_general(wall.body, False))
    if isinstance(wall, SlabNumbers | Chain | SolidNumbers):
        parts = [_in_general(part, isinstance(wall, Chain) and _is_round(part)) for part in wall]
        return type(wall)(*parts)
    return Rotated(wall, *_AXES) if turned else wall


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


def aligned(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """A copy of a table that begins with a line of the cache."""
    memory = np.empty(rows.nbytes + _LINE, np.uint8)
    first = -memory.ctypes.data % _LINE
    copy = memory[first : first + rows.nbytes].view(np.float64).reshape(rows.shape)
    copy[:] = rows
    return copy


# --- As walls of a chain ---------------------------------------------------------------------------------

fold.count.register(Members, lambda members: float(members.table.shape[0]))


@fold.member.register(Members)
def _(members, wall):
    last = members.table.shape[0] - 1.0
    return member(members, index(int(select(wall < 0.0, 0.0, select(wall > last, last, wall)))))


@fold.outside_of_any.register(Members)
def _(members, wall, r):
    return _is_in_any(members, wall, r)


@outlined
def _is_in_any(members, wall, r):
    grid = members.grid
    cell = index(cell_of(grid, r).number)
    for k in range(grid.first[cell], grid.first[cell + 1]):
        m = grid.entries[k]
        body = member(members, index(m))
        if contract.level_of(body, contract.inner(body, r)) > 0.0 and float(m) != wall:
            return True
    return False


@near.count_in_cell.register(Members)
def _(members, r):
    cell = index(cell_of(members.grid, r).number)
    return int(members.grid.first[cell + 1] - members.grid.first[cell])


@near.list_in_cell.register(Members)
def _(members, k, before, r, into):
    cell = index(cell_of(members.grid, r).number)
    first, stop = members.grid.first[cell], members.grid.first[cell + 1]
    for i in range(first, stop):
        into[k + i - first] = before + members.grid.entries[i]
    return int(stop - first)


@near.one_in_cell.register(Members)
def _(members, k, r):
    return members.grid.entries[members.grid.first[index(cell_of(members.grid, r).number)] + k]


@near.until_next_cell.register(Members)
def _(members, r, v):
    return until_next(None, members.grid, cell_of(members.grid, r), r, v)


@near.deepest_in_cell.register(Members)
def _(members, r):
    grid, most = members.grid, -math.inf
    cell = index(cell_of(grid, r).number)
    for k in range(grid.first[cell], grid.first[cell + 1]):
        most = max(most, contract.distance(member(members, index(grid.entries[k])), r))
    return most


@flights.field_hit.register(Members)
def _(members, gravity, r, v):
    return _first_hit(members, gravity, r, v)


@outlined
def _first_hit(members, gravity, r, v):
    """The first hit in the cell of a particle, or when it is in another one."""
    grid = members.grid
    cell = cell_of(grid, r)
    found, number = flights.Hit(until_next(gravity, grid, cell, r, v), -1.0), index(cell.number)
    for k in range(grid.first[number], grid.first[number + 1]):
        m = grid.entries[k]
        time, hits = flights.hit(gravity, member(members, index(m)), r, v)
        if time < found.time:
            found = flights.Hit(time, select(hits, float(m), -1.0))
    return found


# --- Which is near ---------------------------------------------------------------------------------------


@kernel
def nearest(members, points, found):
    """The gradient and phi, in the rows of `found`, of the body with the least phi near each of the points (3, N)."""
    grid = members.grid
    cells = max(grid.shape.x, max(grid.shape.y, grid.shape.z))
    for i in range(points.shape[1]):
        r = column(points, 0, i)
        place = cell_of(grid, r).place
        center = Vec(_within(place.x, grid.shape.x), _within(place.y, grid.shape.y), _within(place.z, grid.shape.z))
        best, which, last, shell = math.inf, 0, cells, 0.0
        while shell <= last:
            phi, m = _least_in_shell(members, r, center, shell)
            # What is one shell farther may be nearer still.
            if phi < math.inf and which == 0:
                last = min(last, shell + 1.0)
            if phi < best:
                best, which = phi, m + 1
            shell += 1.0
        put(found, 0, i, contract.gradient(member(members, index(which - 1)), r))
        found[3, i] = best


@inlined
def _within(place, count):
    return min(max(place, 0.0), count - 1.0)


@outlined
def _least_in_shell(members, r, center, shell):
    """The least phi in the cells that are `shell` cells away from one, and whose it is."""
    grid, best, which = members.grid, math.inf, 0
    for x in _around(center.x, shell, grid.shape.x):
        for y in _around(center.y, shell, grid.shape.y):
            for z in _around(center.z, shell, grid.shape.z):
                if max(abs(x - center.x), max(abs(y - center.y), abs(z - center.z))) < shell:
                    continue
                number = index(int((x * grid.shape.y + y) * grid.shape.z + z))
                for k in range(grid.first[number], grid.first[number + 1]):
                    m = grid.entries[k]
                    phi = contract.phi(member(members, index(m)), r)
                    if phi < best:
                        best, which = phi, m
    return best, which


@inlined
def _around(place, shell, count):
    return range(int(max(place - shell, 0.0)), int(min(place + shell, count - 1.0)) + 1)


# --- What bodies are made of -----------------------------------------------------------------------------

gathered.register(Nothing, lambda like, table, m, k: None)
width.register(Nothing, lambda like: 0)
gathered.register(Vec, lambda like, table, m, k: Vec(table[m, k], table[m, k + 1], table[m, k + 2]))
width.register(Vec, lambda like: 3)
gathered.register(AlongX, lambda like, table, m, k: AlongX(1.0))
gathered.register(AlongY, lambda like, table, m, k: AlongY(1.0))
gathered.register(AlongZ, lambda like, table, m, k: AlongZ(1.0))


@gathered.register(SphereNumbers)
def _(like, table, m, k):
    # Four numbers of it are half a line of the cache; the others follow from them.
    radius = table[m, k + 3]
    center = Vec(table[m, k], table[m, k + 1], table[m, k + 2])
    return SphereNumbers(center, radius, radius * radius, -1.0 / radius, -1.0)


width.register(SphereNumbers, lambda like: 4)


@gathered.register(CapsuleNumbers)
def _(like, table, m, k):
    return CapsuleNumbers(
        Vec(table[m, k], table[m, k + 1], table[m, k + 2]),
        table[m, k + 3], table[m, k + 4], table[m, k + 5], table[m, k + 6],
    )  # fmt: skip


width.register(CapsuleNumbers, lambda like: 7)


@inlined
def _quadric(like, table, m, k):
    """The fields of a quadric."""
    tilt = k + 6 + width(like.b)
    return (
        gathered(like.center, table, m, k), gathered(like.a, table, m, k + 3), gathered(like.b, table, m, k + 6),
        table[m, tilt], table[m, tilt + 1], table[m, tilt + 2],
    )  # fmt: skip


gathered.register(QuadricNumbers, lambda like, table, m, k: QuadricNumbers(*_quadric(like, table, m, k)))
gathered.register(EllipsoidNumbers, lambda like, table, m, k: EllipsoidNumbers(*_quadric(like, table, m, k)))
width.register(QuadricNumbers, lambda like: 9 + width(like.b))


@gathered.register(SlabNumbers)
def _(like, table, m, k):
    n = k + width(like.normal)
    return SlabNumbers(
        gathered(like.normal, table, m, k), table[m, n], table[m, n + 1], table[m, n + 2], table[m, n + 3]
    )


width.register(SlabNumbers, lambda like: width(like.normal) + 4)


@gathered.register(Rotated)
def _(like, table, m, k):
    n = k + width(like.body)
    return Rotated(
        gathered(like.body, table, m, k),
        gathered(like.x, table, m, n), gathered(like.y, table, m, n + 3), gathered(like.z, table, m, n + 6),
    )  # fmt: skip


width.register(Rotated, lambda like: width(like.body) + 9)


@gathered.register(Chain)
def _(like, table, m, k):
    return Chain(gathered(like.first, table, m, k), gathered(like.rest, table, m, k + width(like.first)))


width.register(Chain, lambda like: width(like.first) + width(like.rest))


@gathered.register(SolidNumbers)
def _(like, table, m, k):
    n = k + width(like.parts)
    return SolidNumbers(gathered(like.parts, table, m, k), table[m, n], table[m, n + 1])


width.register(SolidNumbers, lambda like: width(like.parts) + 2)

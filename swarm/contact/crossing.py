"""Whether a step of a particle that slides goes into a wall that does not hold it, and where it is cut then."""

import math
from typing import Any, NamedTuple

from ..kernel.jit import by_type, index, inlined, outlined
from ..kernel.vector import Vec, dot, highest, lowest, square
from ..surfaces import contract
from ..surfaces import fold as walls
from ..surfaces.fields.grid import block_of, in_block, size_of
from ..surfaces.fields.members import member
from ..surfaces.moving import Carried, at
from ..surfaces.posed import Posed, straight_hit
from .hold import is_held_by

_EPSILON = 2.220446049250313e-16
# Of a length, the part that is none.
_NEAR = 1e-13
# Places of a step that are looked at for another wall, and halvings down to its instant.
_PLACES, _HALVINGS = 16, 60


class Path(NamedTuple):
    """A step of length h."""

    r0: Vec
    v0: Vec
    r1: Vec
    v1: Vec
    h: Any


@by_type
def meets(chain, ends, number, held, path, near):
    """Whether a step may go deeper than `near` into a wall that does not hold the particle.

    `ends` are the walls at its end, which are others where they move.
    """
    raise NotImplementedError


@meets.register(walls.Chain)
def _(chain, ends, number, held, path, near):
    here = _may_meet(chain.first, ends.first, path, near) & (not is_held_by(held, number))
    return here | meets(chain.rest, ends.rest, number + 1.0, held, path, near)


@meets.register(walls.Field)
def _(chain, ends, number, held, path, near):
    here = _meets_one(chain.first, ends.first, number, held, path, near)
    return here | meets(chain.rest, ends.rest, number + walls.count(chain.first), held, path, near)


@outlined
def _meets_one(field, ends, number, held, path, near):
    """The same of the bodies of a field that has so many walls before it."""
    grid = members_of(field).grid
    # A step without a solution has no end.
    if not (square(path.r1) < math.inf and square(path.v1) < math.inf):
        return True
    block = block_of_path(grid, own_path(field, ends, path), near)
    for k in range(size_of(block)):
        cell = index(in_block(grid, block, k))
        for entry in range(grid.first[cell], grid.first[cell + 1]):
            m = float(grid.entries[entry])
            body, end = walls.member(field, m), walls.member(ends, m)
            if (not is_held_by(held, number + m)) and _may_meet(body, end, path, near):
                return True
    return False


@by_type
def members_of(field):
    """The bodies of a field."""
    return field


members_of.register(Posed, lambda field: field.body)


@by_type
def own_path(field, ends, path):
    """A step in the frame of a field, which is `ends` at its end."""
    return path


@own_path.register(Posed)
def _(field, ends, path):
    r0, v0 = field.own_place(path.r0), field.own_velocity(path.r0, path.v0)
    return Path(r0, v0, ends.own_place(path.r1), ends.own_velocity(path.r1, path.v1), path.h)


@inlined
def block_of_path(grid, path, near):
    """The cells that the control points of a step reach into."""
    third = path.h / 3.0
    a, b = path.r0 + third * path.v0, path.r1 - third * path.v1
    low, high = lowest(lowest(path.r0, a), lowest(b, path.r1)), highest(highest(path.r0, a), highest(b, path.r1))
    room = Vec(near, near, near)
    return block_of(grid, low - room, high + room)


meets.register(type(None), lambda chain, ends, number, held, path, near: False)


@inlined
def _may_meet(surface, end, path, near):
    level0, rise0, _scale = _level(surface, path.r0, path.v0)
    level1, rise1, scale = _level(end, path.r1, path.v1)
    # The cubic through both ends is below its control points; the start is known to be admissible.
    third, deep = path.h / 3.0, near * scale
    on_line = _on_line(surface, end, path.r0, path.r1)
    return (level0 + third * rise0 > deep) | (level1 - third * rise1 > deep) | (level1 > deep) | on_line


@inlined
def _level(surface, r, v):
    """The level of a wall, its rate of change, and the length of its gradient."""
    n = contract.unit_normal(surface, r)
    scale = abs(dot(n, contract.slope(surface, r)))
    speed = dot(n, v - contract.velocity(surface, r))
    return contract.level_of(surface, contract.inner(surface, r)), scale * speed, scale


@by_type
def _on_line(surface, end, r0, r1):
    """Whether a straight way meets a wall whose level along it is no polynomial: a cubic may miss it."""
    if contract.is_quartic(surface) or contract.flat(surface):
        return False
    time, _found = straight_hit(surface, end, r0, r1)
    return time < 1.0


# --- Where it is cut -------------------------------------------------------------------------------------


class Arrival(NamedTuple):
    """The part of a step after which it meets a wall, infinite where it meets none, and that wall."""

    time: float
    wall: float


@by_type
def arrival(chain, number, held, path, near, left):
    """The first wall that a step goes into, with so much of the frame left at its start [s]."""
    raise NotImplementedError


@arrival.register(walls.Chain)
def _(chain, number, held, path, near, left):
    later = arrival(chain.rest, number + 1.0, held, path, near, left)
    if is_held_by(held, number):
        return later
    time = _deep_after(chain.first, path, near)
    if time <= later.time:
        return Arrival(time, number)
    return later


@arrival.register(walls.Field)
def _(chain, number, held, path, near, left):
    later = arrival(chain.rest, number + walls.count(chain.first), held, path, near, left)
    return _first_of(chain.first, number, held, path, near, later)


@outlined
def _first_of(members, number, held, path, near, later):
    """The first of that and of what a step meets of a field that has so many walls before it."""
    grid, found = members.grid, later
    block = block_of_path(grid, path, near)
    for k in range(size_of(block)):
        cell = index(in_block(grid, block, k))
        for entry in range(grid.first[cell], grid.first[cell + 1]):
            m = grid.entries[entry]
            if not is_held_by(held, number + m):
                time = _deep_after(member(members, index(m)), path, near)
                if time < found.time or (time == found.time and number + m < found.wall):
                    found = Arrival(time, number + m)
    return found


arrival.register(type(None), lambda chain, number, held, path, near, left: Arrival(math.inf, -1.0))


@arrival.register(Carried)
def _(chain, number, held, path, near, left):
    return _arrival_later(chain.walls, chain, number, held, path, near, left)


@by_type
def _arrival_later(rest, chain, number, held, path, near, left):
    """`arrival` at the walls of the rest, which has so many walls before it, of a chain where some move."""
    return Arrival(math.inf, -1.0)


@_arrival_later.register(walls.Chain)
def _(rest, chain, number, held, path, near, left):
    found = Arrival(math.inf, -1.0)
    for i in range(walls.length(rest)):
        found = _sooner_at(chain, number + i, held, path, near, left, found)
    return found


@_arrival_later.register(walls.Field)
def _(rest, chain, number, held, path, near, left):
    later = _arrival_later(rest.rest, chain, number + walls.count(rest.first), held, path, near, left)
    found = _arrival_among(rest, chain, number, held, path, near, left)
    return found if found.time < later.time else later


@outlined
def _arrival_among(rest, chain, number, held, path, near, left):
    """The same at the bodies of the first field of the rest."""
    found = Arrival(math.inf, -1.0)
    field, ends = at(Carried(rest), left).first, at(Carried(rest), left - path.h).first
    grid = members_of(field).grid
    block = block_of_path(grid, own_path(field, ends, path), near)
    for k in range(size_of(block)):
        cell = index(in_block(grid, block, k))
        for entry in range(grid.first[cell], grid.first[cell + 1]):
            found = _sooner_at(chain, number + grid.entries[entry], held, path, near, left, found)
    return found


@inlined
def _sooner_at(chain, wall, held, path, near, left, found):
    """The sooner one of an arrival and that at this wall."""
    if is_held_by(held, wall):
        return found
    time = _deep_later(chain, wall, path, near, left)
    if time < found.time:
        return Arrival(time, wall)
    return found


@outlined
def _deep_later(chain, wall, path, near, left):
    """`_deep_after` of a wall that may move."""
    start = at(chain, left)
    towards = path.v0 - walls.velocity(start, wall, path.r0)
    if walls.distance(start, wall, path.r0) >= -near and dot(walls.unit_normal(start, wall, path.r0), towards) > 0.0:
        return 0.0
    low, high = 0.0, math.inf
    for k in range(1, _PLACES + 1):
        s = k / _PLACES
        if walls.distance(at(chain, left - s * path.h), wall, at_part(path, s)) > near:
            high = s
            break
        low = s
    if not high < math.inf:
        return high
    for _i in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if walls.distance(at(chain, left - middle * path.h), wall, at_part(path, middle)) > 0.0:
            high = middle
        else:
            low = middle
    return high


@outlined
def _deep_after(surface, path, near):
    """The part of a step after which it is deeper than `near` in a wall; 0 where it is there and goes in."""
    depth = contract.distance(surface, path.r0)
    if depth >= -near and dot(contract.unit_normal(surface, path.r0), path.v0) > 0.0:
        return 0.0
    low, high = 0.0, math.inf
    for k in range(1, _PLACES + 1):
        if contract.distance(surface, at_part(path, k / _PLACES)) > near:
            high = k / _PLACES
            break
        low = k / _PLACES
    if not high < math.inf:
        time, found = contract.first_hit(surface, path.r0, path.r1 - path.r0)
        return time if found and 0.0 < time < 1.0 else math.inf
    for _i in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if contract.distance(surface, at_part(path, middle)) > 0.0:
            high = middle
        else:
            low = middle
    return high


@inlined
def at_part(path, s):
    """Where the cubic through both ends of a step is."""
    r0, a, b, c = cubic(path)
    return r0 + s * (a + s * (b + s * c))


@inlined
def cubic(path):
    """The cubic through both ends of a step, as the coefficients of the powers of the part of it."""
    d, h = path.r1 - path.r0, path.h
    # Hermite's form
    a, b = 3.0 * d - h * (2.0 * path.v0 + path.v1), h * (path.v0 + path.v1) - 2.0 * d
    return path.r0, h * path.v0, a, b


@inlined
def near(rules, r):
    """A distance that is none."""
    return _NEAR * rules.size + 8.0 * _EPSILON * (abs(r.x) + abs(r.y) + abs(r.z))

"""Where a particle that slides, or that several walls hold, comes into an opening of its wall."""

import math

import numpy as np

from ..kernel.jit import by_type, by_type_outlined, index, inlined, outlined, scratch, select
from ..kernel.vector import norm
from ..surfaces import fold as walls
from ..surfaces import near as near_walls
from ..surfaces.fields.grid import in_block, size_of
from ..surfaces.fields.members import member
from ..surfaces.openings import Openings, is_open, outside
from .crossing import at_part, block_of_path
from .hold import second

# Places of a step between which the distance to an opening has one least value, and steps of the search for that value
# and for the place where the opening begins.
_PLACES, _HALVINGS, _THIRDS = 16, 60, 80


@inlined
def open_wall_of(openings, held, r, near):
    """The wall of those that hold a particle that is open at its place, or nearer to that than `near`; or -1."""
    first = is_open(openings, held.first, r, near)
    return select(first, held.first, select(is_open(openings, second(held), r, near), second(held), -1.0))


@by_type_outlined
def open_wall_at(openings, chain, r, touch, near):
    """A wall within the distance `touch` of a place that is open there, or -1."""
    return -1.0


@open_wall_at.register(Openings)
def _(openings, chain, r, touch, near):
    count = near_walls.count_near(chain, r)
    number = scratch(count, np.float64)
    near_walls.list_near(chain, 0, 0.0, r, number)
    for i in range(count):
        if walls.distance(chain, number[i], r) >= -touch and is_open(openings, number[i], r, near):
            return number[i]
    return -1.0


# --- Steps -----------------------------------------------------------------------------------------------


@inlined
def _reach(path):
    """Twice the length of a step: what is farther from its end, by a distance of first order, is not on its way."""
    return norm(path.r1 - path.r0) + path.h * (norm(path.v0) + norm(path.v1))


@by_type
def may_pass(openings, held, path):
    """Whether a step may come into an opening of a wall that holds the particle."""
    return False


@may_pass.register(Openings)
def _(openings, held, path):
    reach = _reach(path)
    return _may_pass(openings, held.first, path, reach) | _may_pass(openings, second(held), path, reach)


@by_type
def _may_pass(openings, wall, path, reach):
    return False


@_may_pass.register(Openings)
def _(openings, wall, path, reach):
    here = (wall >= 0.0) & (wall < openings.walls) & _may_enter_any(openings.volumes, path, reach)
    return here | _may_pass(openings.rest, wall - openings.walls, path, reach)


@by_type
def _may_enter_any(volumes, path, reach):
    return False


@_may_enter_any.register(walls.Chain)
def _(volumes, path, reach):
    return _may_enter(volumes.first, path, reach) | _may_enter_any(volumes.rest, path, reach)


@by_type
def _may_enter(volume, path, reach):
    return outside(volume, path.r1) <= reach


_may_enter.register(walls.Field, lambda volume, path, reach: _may_enter_one(volume.first, path, reach))


@outlined
def _may_enter_one(members, path, reach):
    grid = members.grid
    block = block_of_path(grid, path, 0.0)
    for k in range(size_of(block)):
        cell = index(in_block(grid, block, k))
        for entry in range(grid.first[cell], grid.first[cell + 1]):
            if outside(member(members, index(grid.entries[entry])), path.r1) <= reach:
                return True
    return False


@by_type
def part_until_open(openings, held, path, near):
    """The part of a step after which a wall that holds the particle is open, deeper than `near`; else infinite."""
    return math.inf


@part_until_open.register(Openings)
def _(openings, held, path, near):
    return min(_part(openings, held.first, path, near), _part(openings, second(held), path, near))


@by_type
def _part(openings, wall, path, near):
    return math.inf


@_part.register(Openings)
def _(openings, wall, path, near):
    if 0.0 <= wall < openings.walls:
        return _first_part(openings.volumes, path, near)
    return _part(openings.rest, wall - openings.walls, path, near)


@by_type
def _first_part(volumes, path, near):
    return math.inf


@_first_part.register(walls.Chain)
def _(volumes, path, near):
    return min(_entry(volumes.first, path, near), _first_part(volumes.rest, path, near))


@by_type
def _entry(volume, path, near):
    """The part of a step after which it is in a volume."""
    return _way_in(volume, path, near)


_entry.register(walls.Field, lambda volume, path, near: _way_into_any(volume.first, path, near))


@outlined
def _way_into_any(members, path, near):
    grid, first = members.grid, math.inf
    block = block_of_path(grid, path, near)
    for k in range(size_of(block)):
        cell = index(in_block(grid, block, k))
        for entry in range(grid.first[cell], grid.first[cell + 1]):
            first = min(first, _way_in(member(members, index(grid.entries[entry])), path, near))
    return first


@outlined
def _way_in(volume, path, near):
    """The same of one volume, whose distance is looked at at some places of the step and where it is least."""
    reach = _reach(path)
    if not outside(volume, path.r1) <= reach:
        return math.inf
    last = 0.0
    for k in range(_PLACES + 1):
        place = k / _PLACES
        here = outside(volume, at_part(path, place))
        if here <= reach / _PLACES and not here < -near:
            place = _nearest(volume, path, last, min(k + 1, _PLACES) / _PLACES)
            here = outside(volume, at_part(path, place))
        if here < -near:
            return _edge(volume, path, last, place)
        last = k / _PLACES
    return math.inf


@outlined
def _nearest(volume, path, low, high):
    """The part of a step at which it is nearest to a volume, between two others."""
    for _third in range(_THIRDS):
        one, other = low + (high - low) / 3.0, high - (high - low) / 3.0
        if outside(volume, at_part(path, one)) <= outside(volume, at_part(path, other)):
            high = other
        else:
            low = one
    return 0.5 * (low + high)


@outlined
def _edge(volume, path, low, high):
    """The part of a step at which it enters a volume, between two others."""
    for _half in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if outside(volume, at_part(path, middle)) <= 0.0:
            high = middle
        else:
            low = middle
    return high

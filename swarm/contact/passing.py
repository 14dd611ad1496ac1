"""Where a particle comes into an opening of its wall, and closed walls at the same place, which close it."""

import math

import numpy as np

from ..kernel.jit import by_type, by_type_outlined, index, inlined, outlined, scratch
from ..kernel.vector import cross, dot, norm, square
from ..surfaces import fold as walls
from ..surfaces import near as near_walls
from ..surfaces.fields.grid import in_block, size_of
from ..surfaces.fields.members import member
from ..surfaces.openings import Openings, is_open, outside
from . import laws as wall_laws
from .crossing import at_part, block_of_path
from .events import TOUCH
from .hold import second
from .reflection import relative, wall_velocity

# Places of a step between which the distance to an opening has one least value, and steps of the search for that value
# and for the place where the opening begins.
_PLACES, _HALVINGS, _THIRDS = 16, 60, 80
# The sine of the angle between walls that hold a particle as one.
_PARALLEL = 1e-7


@outlined
def _lets_out(openings, rules, chain, wall, r, near):
    """Whether a wall that a particle is on lets it out: it is open there, and no closed wall lies on it."""
    if not is_open(openings, wall, r, near):
        return False
    return not _is_covered(openings, rules, chain, wall, r, near)


@outlined
def _is_covered(openings, rules, chain, wall, r, near):
    """Whether a closed wall that faces the same way is at the same place: who slides on one slides on both."""
    count, touch, n = near_walls.count_near(chain, r), TOUCH * rules.size + near, walls.unit_normal(chain, wall, r)
    number = scratch(count, np.float64)
    near_walls.list_near(chain, 0, 0.0, r, number)
    for i in range(count):
        m = walls.unit_normal(chain, number[i], r)
        alike = dot(n, m) > 0.0 and square(cross(n, m)) <= _PARALLEL * _PARALLEL
        here = alike and abs(walls.distance(chain, number[i], r)) <= touch
        if here and number[i] != wall and not is_open(openings, number[i], r, near):
            return True
    return False


@outlined
def hit_wall(openings, rules, chain, motion, wall, near):
    """The wall that a particle (r, v) hits that has reached this one: where this is open, a closed one at the place.

    Of several closed ones it is the one that it reaches first.
    """
    r, v = motion
    if not is_open(openings, wall, r, near):
        return wall
    moving, touch = wall_laws.moving(rules.laws), TOUCH * rules.size + near
    count, found, soonest = near_walls.count_near(chain, r), wall, math.inf
    number = scratch(count, np.float64)
    near_walls.list_near(chain, 0, 0.0, r, number)
    for i in range(count):
        w = relative(wall_velocity(moving, chain, number[i], r), v)
        towards, distance = dot(walls.unit_normal(chain, number[i], r), w), walls.distance(chain, number[i], r)
        # Reached within the distance `touch` along the way, not across it: at a corner who leaves, leaves.
        here = towards > 0.0 and distance <= touch and -distance * norm(w) <= touch * towards
        if here and -distance < soonest * towards and not is_open(openings, number[i], r, near):
            found, soonest = number[i], max(-distance, 0.0) / towards
    return found


@outlined
def open_wall_of(openings, rules, chain, held, r, near):
    """The wall of those that hold a particle that lets it out at its place, or nearer to that than `near`; or -1."""
    if _lets_out(openings, rules, chain, held.first, r, near):
        return held.first
    return second(held) if _lets_out(openings, rules, chain, second(held), r, near) else -1.0


@by_type_outlined
def open_wall_at(openings, rules, chain, r, near):
    """A wall at a place that lets out there, or -1."""
    return -1.0


@open_wall_at.register(Openings)
def _(openings, rules, chain, r, near):
    count, touch = near_walls.count_near(chain, r), TOUCH * rules.size
    number = scratch(count, np.float64)
    near_walls.list_near(chain, 0, 0.0, r, number)
    for i in range(count):
        if walls.distance(chain, number[i], r) >= -touch and _lets_out(openings, rules, chain, number[i], r, near):
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
    here = (wall >= openings.first) & (wall < openings.last) & _may_enter_any(openings.volumes, path, reach)
    return here | _may_pass(openings.rest, wall, path, reach)


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
def part_until_open(openings, rules, chain, held, path, near):
    """The part of a step after which a wall that holds the particle lets it out, deeper than `near`; else infinite."""
    return math.inf


@part_until_open.register(Openings)
def _(openings, rules, chain, held, path, near):
    first = _part_uncovered(openings, rules, chain, held.first, path, near)
    return min(first, _part_uncovered(openings, rules, chain, second(held), path, near))


@outlined
def _part_uncovered(openings, rules, chain, wall, path, near):
    """The same of one wall. Where a closed wall lies on its opening, the step is looked at until that ends."""
    low = _part(openings, wall, path, near)
    if not low < math.inf or not _is_covered(openings, rules, chain, wall, at_part(path, low), near):
        return low
    for k in range(1, _PLACES + 1):
        high = k / _PLACES
        if high > low and _lets_out(openings, rules, chain, wall, at_part(path, high), near):
            for _half in range(_HALVINGS):
                middle = 0.5 * (low + high)
                if _lets_out(openings, rules, chain, wall, at_part(path, middle), near):
                    high = middle
                else:
                    low = middle
            return high
        low = max(low, high)
    return math.inf


@by_type
def _part(openings, wall, path, near):
    return math.inf


@_part.register(Openings)
def _(openings, wall, path, near):
    if openings.first <= wall < openings.last:
        return _first_part(openings.volumes, path, near)
    return _part(openings.rest, wall, path, near)


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

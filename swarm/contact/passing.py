"""Particles that come into openings of their walls, and closed walls at the same place, which close these."""

import math

from ..kernel.arrays import index
from ..kernel.grid import over_entries
from ..kernel.jit import outlined
from ..kernel.vector import cross, dot, norm, square
from ..surfaces.fields.members import member
from ..surfaces.presence.openings import Doorway, outside
from ..surfaces.walls import Field
from .crossing import block_of_path
from .doorways import is_pressed, leads_on, lets_through
from .events import TOUCH
from .path import PLACES, at_part, first_true
from .reflection import relative, wall_velocity
from .rooms import has_ended

# Steps of the search for the least distance to an opening between three places of a step.
_THIRDS = 80
# The sine of the angle between walls that hold a particle as one.
_PARALLEL = 1e-7


@outlined
def _lets_out(openings, rules, walls, wall, r, near):
    """Whether a wall that a particle is on lets it out: it is open there, and no closed wall lies on it."""
    if not lets_through(openings, walls, wall, r, near):
        return False
    return not _is_covered(openings, rules, walls, wall, r, near)


@outlined
def _is_covered(openings, rules, walls, wall, r, near):
    """Whether a closed wall that faces the same way is at the same place: a particle on one wall slides on both."""
    number = walls.numbers_near(r)
    touch, n = TOUCH * rules.size + near, walls.unit_normal(wall, r)
    for i in range(number.size):
        m = walls.unit_normal(number[i], r)
        alike = dot(n, m) > 0.0 and square(cross(n, m)) <= _PARALLEL * _PARALLEL
        here = alike and abs(walls.distance(number[i], r)) <= touch and not has_ended(walls, number[i], r, near)
        if here and number[i] != wall and not lets_through(openings, walls, number[i], r, near):
            return True
    return False


@outlined
def hit_wall(openings, rules, walls, motion, wall, near):
    """The wall that a particle (r, v) hits that has reached this one: where this is open, a closed one at the place.

    Of several closed ones it is the one that it reaches first.
    """
    r, v = motion
    if not lets_through(openings, walls, wall, r, near):
        return wall
    moving, touch = rules.laws.moving, TOUCH * rules.size + near
    number = walls.numbers_near(r)
    found, soonest = wall, math.inf
    for i in range(number.size):
        w = relative(wall_velocity(moving, walls, number[i], r), v)
        towards, distance = dot(walls.unit_normal(number[i], r), w), walls.distance(number[i], r)
        # A wall is reached within the distance `touch` along the way, not across it: a particle that leaves at a corner
        # does not hit the other wall.
        here = towards > 0.0 and distance <= touch and -distance * norm(w) <= touch * towards
        here = here and not has_ended(walls, number[i], r, near)
        if here and -distance < soonest * towards and not lets_through(openings, walls, number[i], r, near):
            found, soonest = number[i], max(-distance, 0.0) / towards
    return found


@outlined
def open_wall_of(openings, rules, walls, active, r, near):
    """The wall of those that hold a particle that lets it out at its place, or nearer to that than `near`; or -1."""
    if _lets_out(openings, rules, walls, active.first, r, near):
        return active.first
    return active.second if _lets_out(openings, rules, walls, active.second, r, near) else -1.0


@outlined
def open_wall_at(openings, rules, walls, gravity, motion, near):
    """A wall at the place of a particle (r, v) that lets it out there, or -1; into another room if it is pressed."""
    if openings is None:
        return -1.0
    r, v = motion
    number, touch = walls.numbers_near(r), TOUCH * rules.size
    for i in range(number.size):
        here = walls.distance(number[i], r) >= -touch and not has_ended(walls, number[i], r, near)
        if not here or not _lets_out(openings, rules, walls, number[i], r, near):
            continue
        if is_pressed(walls, gravity, number[i], r, v) or not leads_on(walls, number[i], r):
            return number[i]
    return -1.0


# --- Steps -----------------------------------------------------------------------------------------------


def _reach(path):
    """Twice the length of a step: what is farther from its end, by a distance of first order, is not on its way."""
    return norm(path.r1 - path.r0) + path.h * (norm(path.v0) + norm(path.v1))


def may_pass(openings, walls, active, path):
    """Whether a step may come into an opening of a wall that holds the particle."""
    found, reach = False, _reach(path)
    for opening in openings or ():
        enters = False
        for volume in opening.volumes:
            enters = enters | _may_enter(volume, path, reach)
        for wall in active:
            here = opening.is_of(wall) & enters
            found = found | (here & _may_lead_on(walls, wall, path) if isinstance(opening, Doorway) else here)
    return found


def _may_lead_on(walls, wall, path):
    """Whether another room is behind a wall at some place of a step: a wall of its own, such as a floor, has none."""
    middle = 0.5 * (path.r0 + path.r1)
    return leads_on(walls, wall, path.r0) | leads_on(walls, wall, middle) | leads_on(walls, wall, path.r1)


def _may_enter(volume, path, reach):
    if isinstance(volume, Field):
        return _may_enter_one(volume.members, path, reach)
    return outside(volume, path.r1) <= reach


@outlined
def _may_enter_one(members, path, reach):
    block = block_of_path(members.grid, path, 0.0)
    return over_entries(members.grid, block, False, _may_enter_body, members, path, reach)


def _may_enter_body(found, m, members, path, reach):
    return found or outside(member(members, index(m)), path.r1) <= reach


def part_until_open(openings, rules, walls, active, path, near):
    """The part of a step after which a wall that holds the particle lets it out, deeper than `near`; else infinite."""
    if openings is None:
        return math.inf
    first = _part_uncovered(openings, rules, walls, active.first, path, near)
    return min(first, _part_uncovered(openings, rules, walls, active.second, path, near))


@outlined
def _part_uncovered(openings, rules, walls, wall, path, near):
    """`part_until_open` of one wall. If its opening does not let the particle out, the rest of the step is examined."""
    low = _part(openings, wall, path, near)
    given = openings, rules, walls, wall, path
    if not low < math.inf or _lets_out_at(*given, near, low):
        return low
    return first_true(_lets_out_at, given, low, near, near)


def _lets_out_at(openings, rules, walls, wall, path, near, part):
    return _lets_out(openings, rules, walls, wall, at_part(path, part), near)


def _part(openings, wall, path, near):
    first = math.inf
    for opening in openings:
        if opening.first <= wall < opening.last:
            for volume in reversed(opening.volumes):
                first = min(_way_into(volume, path, near), first)
    return first


def _way_into(volume, path, near):
    """The part of a step after which it is in a volume."""
    if isinstance(volume, Field):
        return _way_into_any(volume.members, path, near)
    return _way_in(volume, path, near)


@outlined
def _way_into_any(members, path, near):
    block = block_of_path(members.grid, path, near)
    return over_entries(members.grid, block, math.inf, _way_into_body, members, path, near)


def _way_into_body(first, m, members, path, near):
    return min(first, _way_in(member(members, index(m)), path, near))


@outlined
def _way_in(volume, path, near):
    """`_way_into` of one volume, whose distance is looked at at some places of the step and where it is least."""
    if not outside(volume, path.r1) <= _reach(path):
        return math.inf
    given = volume, path
    return 0.0 if _is_in(*given, near, 0.0) else first_true(_is_in, given, 0.0, near, 0.0, _nearest)


def _nearest(volume, path, near, low, part, high):
    """The part of a step at which it is nearest to a volume, between two others, if it may be in it there."""
    here = outside(volume, at_part(path, part))
    if here < -near or not here <= _reach(path) / PLACES:
        return part
    for _third in range(_THIRDS):
        one, other = low + (high - low) / 3.0, high - (high - low) / 3.0
        if outside(volume, at_part(path, one)) <= outside(volume, at_part(path, other)):
            high = other
        else:
            low = one
    return 0.5 * (low + high)


def _is_in(volume, path, depth, part):
    return outside(volume, at_part(path, part)) <= -depth

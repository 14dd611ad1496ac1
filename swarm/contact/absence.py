"""The absence of walls, for points at a wall: in a lasting contact, and at the end of a flight.

A wall `stands` at a place on it unless it has ended there, beyond its patch or in another room, or is open: each is an
`Absence`. Where a wall has ended, sliding particles go on along the wall after it, or fly. At an opening they escape,
or enter the room behind it.
"""

import math

from ..kernel.arrays import index
from ..kernel.gravity import accelerated
from ..kernel.grid import over_entries
from ..kernel.jit import outlined, select
from ..kernel.vector import ZERO, dot, norm, square
from ..surfaces.fields.members import member
from ..surfaces.presence.absence import BEYOND, CUT, FLIES, OPEN, face_alike, is_absent
from ..surfaces.presence.openings import outside
from ..surfaces.presence.patched import Patched, Patches
from ..surfaces.presence.rooms import Rooms, depth_behind, leads_on, other_side
from ..surfaces.walls import Field
from .crossing import block_of_path
from .events import TOUCH
from .path import BEFORE, PLACES, at_part, first_true, members_of, reach_of
from .reflection import relative, wall_velocity

# Steps of the search for the least distance to an opening, between three places of a step.
_THIRDS = 80
# The fraction of a velocity, or of gravity, that does not press on a wall.
_PRESSED = 1e-9


# --- At a place ------------------------------------------------------------------------------------------


def ends_of(walls):
    """Return the ways in which walls end: a constant number for the compiler, 0 if no wall ends."""
    patches = tuple((first, field.members) for first, field in walls.fields())
    return (
        *(Patches(first, members) for first, members in patches if isinstance(members_of(members), Patched)),
        *(Rooms(rooms) for rooms in walls.joined()),
    )


def lets_through(openings, walls, wall, r, near):
    """Whether an opening removes a wall at a place on it, or nearer to it than `near`."""
    return is_absent(openings, walls, wall, r, near, OPEN)


def stands(openings, walls, wall, r, near):
    """Whether a wall has not ended at a place on it, and is not open there."""
    ended = is_absent(ends_of(walls), walls, wall, r, near, BEYOND)
    return not ended and not lets_through(openings, walls, wall, r, near)


@outlined
def lets_out(openings, rules, walls, wall, r, near):
    """Whether a wall that a particle is on lets it out: it is open there, and no closed wall lies on it."""
    if not lets_through(openings, walls, wall, r, near):
        return False
    return not _is_covered(openings, rules, walls, wall, r, near)


@outlined
def _is_covered(openings, rules, walls, wall, r, near):
    """Whether a closed wall with the same orientation is at the same place: both hold a particle that slides on one."""
    number, touch = walls.numbers_near(r), TOUCH * rules.size + near
    for i in range(number.size):
        here = face_alike(walls, wall, number[i], r) and abs(walls.distance(number[i], r)) <= touch
        if here and number[i] != wall and stands(openings, walls, number[i], r, near):
            return True
    return False


@outlined
def hit_wall(openings, rules, walls, motion, wall, near):
    """Return the wall that a particle (r, v) hits at this one: if it is open, the closed wall that is reached first."""
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
        if here and -distance < soonest * towards and stands(openings, walls, number[i], r, near):
            found, soonest = number[i], max(-distance, 0.0) / towards
    return found


@outlined
def open_wall_at(openings, rules, walls, gravity, motion, near):
    """Return a wall at the place of a particle (r, v) that lets it out, or -1; into a room only if pressed there."""
    r, v = motion
    number, touch, ways = walls.numbers_near(r), TOUCH * rules.size, ends_of(walls)
    for i in range(number.size):
        here = walls.distance(number[i], r) >= -touch and not is_absent(ways, walls, number[i], r, near, BEYOND)
        if not here or not lets_out(openings, rules, walls, number[i], r, near):
            continue
        if _is_pressed(walls, gravity, number[i], r, v) or not leads_on(walls, number[i], r):
            return number[i]
    return -1.0


def _is_pressed(walls, gravity, wall, r, v):
    """Whether a particle at a wall moves into it, or is pulled into it."""
    n, pull = walls.unit_normal(wall, r), accelerated(gravity, ZERO, 1.0)
    return dot(n, v) > _PRESSED * norm(v) or dot(n, pull) > _PRESSED * norm(pull)


def closeness(walls):
    """The distance from an opening that counts as 0 for a flight: the round-off where rooms meet, 0 without unions."""
    return 2.0 * depth_behind(walls) if len(walls.unions) > 0 else 0.0


def through(walls, gravity, wall, motion):
    """Return a particle (r, v) at an open wall on the other side of it, with the same energy."""
    r, v = motion
    there, speed2 = other_side(walls, wall, r), square(v)
    gained = dot(accelerated(gravity, ZERO, 1.0), there - r)
    return there, v + (select(speed2 > abs(gained), gained / select(speed2 > 0.0, speed2, 1.0), 0.0)) * v


# --- For the walls that hold a particle -----------------------------------------------------------------


@outlined
def open_wall_of(openings, rules, walls, active, r, near):
    """Return the wall, of those that hold a particle, that lets it out at its place, or -1."""
    if lets_out(openings, rules, walls, active.first, r, near):
        return active.first
    return active.second if lets_out(openings, rules, walls, active.second, r, near) else -1.0


@outlined
def ended_wall(walls, active, r, near):
    """Return the wall, of those that hold a particle, that has ended at its place, or -1."""
    if is_absent(ends_of(walls), walls, active.first, r, near, FLIES):
        return active.first
    return active.second if is_absent(ends_of(walls), walls, active.second, r, near, FLIES) else -1.0


@outlined
def wall_after(walls, wall, r, near):
    """Return the wall on which sliding particles go on where this one ends, or -1 if they fly."""
    found = -1.0
    for way in ends_of(walls):
        if way.is_of(wall):
            found = way.wall_after(walls, wall, r, near)
    return found


# --- Steps -----------------------------------------------------------------------------------------------


def may_be_absent(openings, walls, active, path, near):
    """Whether (a wall that holds the particle has ended at the end of a step, one of them may be open in the step)."""
    ended, found, ways = False, False, ends_of(walls)
    for wall in active:
        ended = ended | is_absent(ways, walls, wall, path.r1, near, BEYOND)
    for opening in openings or ():
        enters = False
        for volume in opening.volumes:
            enters = enters | _over_bodies(volume, path, 0.0, False, _may_enter, reach_of(path))
        for wall in active:
            here = opening.is_of(wall) & enters
            found = found | (here & _may_lead_on(walls, wall, path) if opening.between else here)
    return ended, found


def _may_lead_on(walls, wall, path):
    """Whether another room is behind a wall at some place of a step; a wall without a room behind it has none."""
    middle = 0.5 * (path.r0 + path.r1)
    return leads_on(walls, wall, path.r0) | leads_on(walls, wall, middle) | leads_on(walls, wall, path.r1)


def part_until_open(openings, rules, walls, active, path, near):
    """Return the part of a step after which a wall that holds the particle lets it out, or infinity."""
    if openings is None:
        return math.inf
    first = _part_until_open(openings, rules, walls, active.first, path, near)
    return min(first, _part_until_open(openings, rules, walls, active.second, path, near))


@outlined
def part_until_end(walls, active, path, near, remaining):
    """Return the part of a step after which a wall that holds the particle has ended, or infinity."""
    return first_true(_ends_at, (walls, active, path, near, remaining), BEFORE, BEYOND, CUT)


def _ends_at(walls, active, path, near, remaining, depth, part):
    now, r = walls.at(remaining - part * path.h), at_part(path, part)
    ways = ends_of(now)
    return is_absent(ways, now, active.first, r, near, depth) or is_absent(ways, now, active.second, r, near, depth)


@outlined
def _part_until_open(openings, rules, walls, wall, path, near):
    """`part_until_open` for one wall. If the opening does not let the particle out, search the rest of the step."""
    low = math.inf
    for opening in openings:
        if opening.is_of(wall):
            for volume in reversed(opening.volumes):
                low = _over_bodies(volume, path, near, low, _way_into, near)
    given = openings, rules, walls, wall, path
    if not low < math.inf or _lets_out_at(*given, near, low):
        return low
    return first_true(_lets_out_at, given, low, near, near)


def _lets_out_at(openings, rules, walls, wall, path, near, part):
    return lets_out(openings, rules, walls, wall, at_part(path, part), near)


# --- Into volumes ----------------------------------------------------------------------------------------


def _over_bodies(volume, path, near, found, ask, given):
    """Return ask(found, volume, path, given); of a field repeat it for each body that a step may come near to."""
    if isinstance(volume, Field):
        return _over_members(volume.members, path, near, found, ask, given)
    return ask(found, volume, path, given)


@outlined
def _over_members(members, path, near, found, ask, given):
    block = block_of_path(members.grid, path, near)
    return over_entries(members.grid, block, found, _ask_member, members, ask, path, given)


def _ask_member(found, m, members, ask, path, given):
    return ask(found, member(members, index(m)), path, given)


def _may_enter(found, volume, path, reach):
    return found | (outside(volume, path.r1) <= reach)


def _way_into(first, volume, path, near):
    """Return the smaller of a part of a step and the part after which the step is in a volume."""
    return min(_way_in(volume, path, near), first)


@outlined
def _way_in(volume, path, near):
    if not outside(volume, path.r1) <= reach_of(path):
        return math.inf
    return first_true(_is_in, (volume, path), BEFORE, near, 0.0, _nearest)


def _nearest(volume, path, near, low, part, high):
    """Return the part of a step nearest to a volume, between `low` and `high`, if it may be in the volume there."""
    here = outside(volume, at_part(path, part))
    if here < -near or not here <= reach_of(path) / PLACES:
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

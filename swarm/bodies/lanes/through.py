"""Walls that end, such as the facets of a mesh: which one the straight way of a contact point goes through.

Such a wall ends at its edges, and its distance says nothing of places that are deep behind it or in other cells. So the
way from the start of a step to its end says which walls a contact point has passed.
"""

import math

from ...contact.path import members_of
from ...kernel.arrays import index
from ...kernel.grid import block_of, over_entries
from ...kernel.jit import outlined, select
from ...kernel.record import Record
from ...kernel.vector import Vec, highest, lowest
from ...surfaces.fields.foam import Foam
from ...surfaces.fields.members import member
from ...surfaces.in_motion.posed import Posed
from ...surfaces.presence.patched import Patched


class WayThrough(Record):
    """The first wall that a way goes through."""

    time: float  # the part of the way after which it does
    wall: float  # its number, -1: it goes through none
    gap: float  # how far the end of the way is from it [m]


def have_ends(walls):
    """Whether any wall of a scene ends: a constant for the compiler."""
    return any(_has_ends(field) for _number, field in walls.fields())


def _has_ends(field):
    # Of a foam the nearest cavity says whether a place is outside.
    members = members_of(field.members)
    return isinstance(members, Patched) and not isinstance(members, Foam)


def is_of_ends(walls, wall):
    """Whether the wall with this number ends."""
    found = False
    for number, field in walls.fields():
        if _has_ends(field):
            found = found | ((wall >= number) & (wall < number + field.count()))
    return found


def passed(before, after, start, end, limits):
    """The first `WayThrough` of a way from its start, where the walls are `before`, to its end, where they are `after`.

    `limits`: a start so little outside is at a wall; an end so near to one is at it; each wall is so much farther away.
    """
    found = WayThrough(math.inf, -1.0, -math.inf)
    for (number, field), (_number, then) in reversed(tuple(zip(before.fields(), after.fields(), strict=True))):
        if _has_ends(field):
            found = _first(field.members, then.members, number, found, start, end, limits)
    return found


@outlined
def _first(field, then, number, found, start, end, limits):
    members = members_of(field)
    if isinstance(field, Posed):
        start, end = field.own_place(start), then.own_place(end)
    far = limits[0] + limits[2]
    room = Vec(far, far, far)
    block = block_of(members.grid, lowest(start, end) - room, highest(start, end) + room)
    return over_entries(members.grid, block, found, _pass, members, number, start, end, limits)


def _pass(found, m, members, number, start, end, limits):
    wall, (near, room, farther) = member(members, index(m)), limits
    stop = end + farther * wall.unit_normal(end)
    gap = wall.level_of(wall.inner(stop))
    if wall.flat and not gap > room:
        return found
    outside = wall.level_of(wall.inner(start))
    back = select((outside > 0.0) & (outside <= near), outside, 0.0)
    begin = start - back * wall.unit_normal(start)
    time, _hits = wall.first_hit(begin, stop - begin)
    # A way may go through the whole of a round wall.
    gap = abs(gap)
    sooner = (time <= 1.0) & (gap > room) & (time < found.time)
    return WayThrough(
        select(sooner, time, found.time), select(sooner, number + m, found.wall), select(sooner, gap, found.gap)
    )

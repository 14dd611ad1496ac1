"""Walls with edges, such as the facets of a mesh: the first one that the straight way of a contact point crosses.

Such a wall is present only within its edges, and its distance says nothing about places deep behind it or in other
cells. The way from the start to the end of a step tells which wall a contact point has passed.
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
    """The first wall that a way crosses."""

    time: float  # the part of the way before the crossing
    wall: float  # the number of the wall, -1 for none
    gap: float  # the distance of the end of the way from the wall [m]


def have_ends(walls):
    """Whether any wall of a scene has edges: a constant for the compiler."""
    return any(_has_ends(field) for _number, field in walls.fields())


def _has_ends(field):
    # In a foam, the nearest cavity tells whether a place is outside.
    members = members_of(field.members)
    return isinstance(members, Patched) and not isinstance(members, Foam)


def is_of_ends(walls, wall):
    """Whether the wall with this number has edges."""
    found = False
    for number, field in walls.fields():
        if _has_ends(field):
            found = found | ((wall >= number) & (wall < number + field.count()))
    return found


def passed(before, after, start, end, limits):
    """Return the first `WayThrough` of a way from `start`, with the walls `before`, to `end`, with the walls `after`.

    `limits` are three lengths [m]: a start outside by at most the first one is at a wall; an end within the second one
    of a wall is at it; each wall is moved back by the third one.
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
    # A way may cross a round wall twice.
    gap = abs(gap)
    sooner = (time <= 1.0) & (gap > room) & (time < found.time)
    return WayThrough(
        select(sooner, time, found.time), select(sooner, number + m, found.wall), select(sooner, gap, found.gap)
    )

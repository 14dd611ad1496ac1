"""Whether a step of a sliding particle goes into a wall that does not hold it, and where the step is then cut."""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.grid import block_of, over_entries
from ..kernel.jit import outlined
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import Vec, dot, highest, lowest, norm, square
from ..surfaces.fields.foam import Foam
from ..surfaces.fields.members import member
from ..surfaces.in_motion.moving import Carried
from ..surfaces.in_motion.posed import Posed
from ..surfaces.presence.patched import Patched
from ..surfaces.walls import Field
from .path import StepPath, at_part, first_true, members_of, reach_of
from .rooms import leaving

# A speed across a wall up to this fraction of the speed is along the wall.
_ALONG = 1e-9
# Fraction of the size of a scene that counts as 0.
_NEAR = 1e-13


def meets(walls, ends, active, path, near):
    """Whether a step may go deeper than `near` into a wall that does not hold the particle.

    `ends` are the walls at its end, which differ if they move.
    """
    found = False
    for rooms, rooms_then in zip(walls.joined(), ends.joined(), strict=True):
        found = _leaves_all(rooms, rooms_then, active, path, near) | found
    for (number, wall), (_number, end) in zip(walls.shared(), ends.shared(), strict=True):
        if isinstance(wall, Field) and isinstance(wall.members, Foam):
            here = False  # all its edges are re-entrant
        elif isinstance(wall, Field):
            here = _meets_one(wall.members, end.members, number, active, path, near)
        else:
            here = _may_meet(wall, end, path, near) & (not active.has(number))
        found = found | here
    return found


def _leaves_all(rooms, ends, active, path, near):
    """Whether a step may leave every room of a union that it begins in."""
    leaves = True
    for room, then in zip(rooms, ends, strict=True):
        met, enters, holds = False, False, False
        for (number, wall, _gentle), (_number, end, _) in zip(room, then, strict=True):
            met = (_may_meet(wall, end, path, near) & (not active.has(number))) | met
            enters, holds = _is_entrance(wall, path, near) | enters, active.has(number) | holds
        # A particle at the face of a room that does not hold it has not entered the room.
        leaves = (met | (enters & (not holds))) & leaves
    return leaves


def _is_entrance(wall, path, near):
    """Whether a step begins at a wall of a room, and goes into the wall."""
    level, rise, scale = _level(wall, path.r0, path.v0)
    return (level > -near * scale) & (rise < -_ALONG * scale * norm(path.v0))


@outlined
def _meets_one(field, ends, number, active, path, near):
    """`meets` for the bodies of a field that has `number` walls before it."""
    grid = members_of(field).grid
    # A step without a solution has no end.
    if not (square(path.r1) < math.inf and square(path.v1) < math.inf):
        return True
    own = own_path(field, ends, path)
    block = block_of_path(grid, own, near)
    return over_entries(grid, block, False, _meets_body, field, ends, number, active, (path, own), near)


def _meets_body(found, m, field, ends, number, active, paths, near):
    m, (path, own) = float(m), paths
    # In the frame of a moving field: a particle at rest on a patch passes through no other, however fast they move.
    patches = members_of(field)
    if isinstance(patches, Patched) and not patches.is_ahead(m, own.r0, own.r1, reach_of(own) + near):
        return found
    return found or ((not _is_held(field, number, m, active)) and _may_meet(field.wall(m), ends.wall(m), path, near))


def _is_held(field, number, m, active):
    """Whether wall m of a field, with `number` walls before it, holds a particle, or continues a wall that does."""
    held = active.has(number + m)
    if isinstance(members_of(field), Patched):
        for one in active:
            is_of = (one >= number) & (one < number + field.count())
            held = held | (is_of & field.goes_on(one - number, m))
    return held


def own_path(field, ends, path):
    """Return a step in the frame of a field, which is `ends` at its end."""
    if not isinstance(field, Posed):
        return path
    r0, v0 = field.own_place(path.r0), field.own_velocity(path.r0, path.v0)
    return StepPath(r0, v0, ends.own_place(path.r1), ends.own_velocity(path.r1, path.v1), path.h)


def block_of_path(grid, path, near):
    """Return the cells that the control points of a step reach."""
    third = path.h / 3.0
    a, b = path.r0 + third * path.v0, path.r1 - third * path.v1
    low, high = lowest(lowest(path.r0, a), lowest(b, path.r1)), highest(highest(path.r0, a), highest(b, path.r1))
    room = Vec(near, near, near)
    return block_of(grid, low - room, high + room)


def _may_meet(surface, end, path, near):
    level0, rise0, _scale = _level(surface, path.r0, path.v0)
    level1, rise1, scale = _level(end, path.r1, path.v1)
    # The cubic through both ends is below its control points; the start is known to be admissible.
    third, deep = path.h / 3.0, near * scale
    on_line = _on_line(surface, end, path.r0, path.r1)
    return (level0 + third * rise0 > deep) | (level1 - third * rise1 > deep) | (level1 > deep) | on_line


def _level(surface, r, v):
    """The level of a wall, its rate of change, and the length of its gradient."""
    n = surface.unit_normal(r)
    scale = abs(dot(n, surface.inner_gradient(r)))
    speed = dot(n, v - surface.velocity(r))
    return surface.level_of(surface.inner(r)), scale * speed, scale


def _on_line(surface, end, r0, r1):
    """Whether a straight path meets a wall with a level along it that is no polynomial: a cubic may miss it."""
    if surface.is_quartic or surface.flat:
        return False
    time, _found = surface.straight_hit(end, r0, r1)
    return time < 1.0


# --- Where the step is cut --------------------------------------------------------------------------------


class Arrival(Record):
    """The part of a step after which it meets a wall, infinite without one, and this wall."""

    time: float
    wall: float


def arrival(walls, active, path, near, remaining):
    """Return the first `Arrival` of a step at a wall, when `remaining` is left of the frame at its start [s]."""
    if isinstance(walls, Carried):
        return _arrival_later(walls, active, path, near, remaining)
    found = _out_of_unions(walls, active, path, near, remaining)
    for number, wall in reversed(walls.shared()):
        if isinstance(wall, Field) and isinstance(wall.members, Foam):
            continue
        if isinstance(wall, Field):
            found = _first_of(wall.members, number, active, path, near, found)
        elif not active.has(number):
            time = _deep_after(_Still(wall), path, near)
            if time <= found.time:
                found = Arrival(time, number)
    return found


def _out_of_unions(walls, active, path, near, remaining):
    """Return the first `Arrival` at which a step leaves a union."""
    found = Arrival(math.inf, -1.0)
    for rooms in walls.joined():
        spans = tuple((room[0][0], room[-1][0]) for room in rooms)
        time, wall = leaving(walls, spans, active, path, near, remaining)
        if time < found.time:
            found = Arrival(time, wall)
    return found


@outlined
def _first_of(members, number, active, path, near, later):
    """Return the first of a later `Arrival` and those at the walls of a field with `number` walls before it."""
    block = block_of_path(members.grid, path, near)
    return over_entries(members.grid, block, later, _sooner_body, members, number, active, path, near)


def _sooner_body(found, m, members, number, active, path, near):
    if _is_held(members, number, m, active):
        return found
    whole = members.whole(float(m)) if isinstance(members, Patched) else member(members, index(m))
    time = _deep_after(_Still(whole), path, near)
    if isinstance(members, Patched) and time < math.inf and not members.is_there(float(m), at_part(path, time), near):
        return found
    if time < found.time or (time == found.time and number + m < found.wall):
        return Arrival(time, number + m)
    return found


def _arrival_later(walls, active, path, near, remaining):
    """`arrival` if some walls move."""
    later, before = _out_of_unions(walls, active, path, near, remaining), walls.count_in_fields()
    for i in range(len(walls.shared()) - len(walls.fields())):
        later = _sooner_at(later, i, walls, before, active, path, near, remaining)
    if not walls.fields():
        return later
    starts, ends = walls.at(remaining).fields(), walls.at(remaining - path.h).fields()
    for (number, field), (_number, end) in reversed(tuple(zip(starts, ends, strict=True))):
        found = _arrival_among(field.members, end.members, walls, number, active, path, near, remaining)
        later = found if found.time < later.time else later
    return later


@outlined
def _arrival_among(field, ends, walls, number, active, path, near, remaining):
    """`arrival` at the bodies of a field, which is `ends` at the end of the step."""
    grid = members_of(field).grid
    block = block_of_path(grid, own_path(field, ends, path), near)
    none = Arrival(math.inf, -1.0)
    return over_entries(grid, block, none, _sooner_at, walls, number, active, path, near, remaining)


def _sooner_at(found, m, walls, number, active, path, near, remaining):
    """Return the sooner of an arrival and that at wall m of a field with `number` walls before it."""
    wall = number + m
    if active.has(wall):
        return found
    time = _deep_after(_Moving(walls, wall, remaining), path, near)
    return Arrival(time, wall) if time < found.time else found


class _Still(Record):
    """A wall at rest."""

    surface: Any

    def depth(self, r, time):
        return self.surface.distance(r)

    def pace_into(self, path):
        return dot(self.surface.unit_normal(path.r0), path.v0)

    def straight(self, path):
        """Return the part at which the straight path is at the wall, for a step that is deep at none of its places."""
        time, found = self.surface.first_hit(path.r0, path.r1 - path.r0)
        return time if found and 0.0 < time < 1.0 else math.inf


class _Moving(Record):
    """A wall that may move, by its number; `remaining` is left of the frame at the start of the step [s]."""

    walls: Any
    wall: float
    remaining: float

    def depth(self, r, time):
        return self.walls.at(self.remaining - time).distance(self.wall, r)

    def pace_into(self, path):
        start = self.walls.at(self.remaining)
        towards = path.v0 - start.velocity(self.wall, path.r0)
        return dot(start.unit_normal(self.wall, path.r0), towards)

    def straight(self, path):
        return math.inf


@outlined
def _deep_after(body, path, near):
    """Return the part of a step after which it is deeper than `near` in a wall; 0 if it starts there and goes in."""
    if body.depth(path.r0, 0.0) >= -near and body.pace_into(path) > 0.0:
        return 0.0
    time = first_true(_is_deep, (body, path), 0.0, near, 0.0)
    return time if time < math.inf else body.straight(path)


def _is_deep(body, path, depth, part):
    return body.depth(at_part(path, part), part * path.h) > depth


def near(rules, r):
    """Return a distance that counts as 0: round-off."""
    return _NEAR * rules.size + 8.0 * EPSILON * (abs(r.x) + abs(r.y) + abs(r.z))

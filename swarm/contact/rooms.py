"""Where walls end for what slides on them: at the edges of the rooms of a union, and of patches.

Edges between rooms are re-entrant: what slides on a wall of one into another one flies on there. Where walls of two
rooms lie on each other, as the floors of two boxes side by side, it slides on, on that of the other.
"""

import math

import numpy as np

from ..kernel.arrays import scratch
from ..kernel.jit import outlined
from ..kernel.vector import cross, dot, square
from ..surfaces.presence.patched import Patched
from ..surfaces.presence.rooms import gap_in, gaps_in
from .path import at_part, first_true, members_of

# Of the slack, how deep in another room what slides flies: at the start of a step, where a step is cut, and where it
# must be. A step that is cut ends between the first two, to round-off.
_FLIES, _CUT, _BEYOND = 1.0, 2.0, 4.0
# The sine of the angle between walls that lie on each other.
_PARALLEL = 1e-7


def _patches(walls):
    """The fields of patches, each with the number of its first wall."""
    return tuple((first, field) for first, field in walls.fields() if isinstance(members_of(field.members), Patched))


def have_ends(walls):
    """Whether walls end: a constant for the compiler."""
    return len(walls.unions) > 0 or len(_patches(walls)) > 0


def _ends(walls, number, r, much, near):
    """Whether a wall is not there at a place on it, by more than so many times what is round-off.

    That is `near`, and the slack of the rooms.
    """
    ended = False
    for first, field in _patches(walls):
        here = (number >= first) & (number < first + field.count())
        ended = (here & (not field.members.is_there(number - first, r, much * near))) | ended
    for rooms in walls.joined():
        least, gaps = much * walls.slack, gaps_in(rooms, r)
        for k, room in enumerate(rooms):
            beyond = gaps[k] > least
            for j, gap in enumerate(gaps):
                beyond = beyond | (gap < -least) if j != k else beyond
            ended = (is_of(room, number) & beyond) | ended
    return ended


def is_of(room, number):
    """Whether a wall is one of a room."""
    return (number >= room[0][0]) & (number <= room[-1][0])


def has_ended(walls, number, r, near):
    """Whether a wall is not there at a place on it."""
    return have_ends(walls) and _ends(walls, number, r, _BEYOND, near)


def may_end(walls, active, r, near):
    """Whether a wall that holds a particle is not there where a step ends."""
    found = False
    for number in active:
        found = found | _ends(walls, number, r, _BEYOND, near)
    return found


@outlined
def ended_wall(walls, active, r, near):
    """The wall of those that hold a particle that is not there where it is, or -1."""
    if _ends(walls, active.first, r, _FLIES, near):
        return active.first
    return active.second if _ends(walls, active.second, r, _FLIES, near) else -1.0


@outlined
def wall_after(walls, number, r, near):
    """The wall on which what slides on this one goes on where it ends, or -1: it flies."""
    found = -1.0
    for first, field in _patches(walls):
        if first <= number < first + field.count():
            after = field.members.wall_after(number - first, r, _FLIES * near)
            return first + after if after >= 0.0 else -1.0
    for rooms in walls.joined():
        found = max(found, _wall_on(walls, rooms, number, r))
    return found


def _wall_on(walls, rooms, number, r):
    """A wall of another room that lies on this one, where the particle is inside of none."""
    found, flies = -1.0, False
    for room in rooms:
        if not is_of(room, number):
            gap = gap_in(room, r)
            flies = flies or gap < -_FLIES * walls.slack
            if gap <= _BEYOND * walls.slack:
                for other, _wall, _gentle in room:
                    found = other if lie_on_each_other(walls, number, other, r) else found
    return -1.0 if flies else found


def lie_on_each_other(walls, number, other, r):
    """Whether two walls are the same at a place on the first one, and face the same way."""
    n, m = walls.unit_normal(number, r), walls.unit_normal(other, r)
    alike = dot(n, m) > 0.0 and square(cross(n, m)) <= _PARALLEL * _PARALLEL
    return alike and abs(walls.distance(other, r) - walls.distance(number, r)) <= _BEYOND * walls.slack


def are_one(walls, number, other, r):
    """Whether two walls are one for a particle at a place: the same, or of two rooms and on each other there."""
    if number == other:
        return True
    return len(walls.unions) > 0 and other >= 0.0 and lie_on_each_other(walls, number, other, r)


@outlined
def part_until_end(walls, active, path, near, remaining):
    """The part of a step after which a wall that holds the particle is no longer there; infinite: it is all along."""
    given = walls, active, path, near, remaining
    return 0.0 if _ends_at(*given, _BEYOND, 0.0) else first_true(_ends_at, given, 0.0, _BEYOND, _CUT)


def _ends_at(walls, active, path, near, remaining, much, part):
    now, r = walls.at(remaining - part * path.h), at_part(path, part)
    return _ends(now, active.first, r, much, near) or _ends(now, active.second, r, much, near)


# --- Where a step leaves rooms ---------------------------------------------------------------------------


@outlined
def leaving(walls, spans, active, path, near, remaining):
    """The part of a step after which it leaves a union, infinite where it does not, and the wall: (part, wall).

    `spans` are the first and the last wall of each room. It leaves where it leaves the last of the rooms that it is in,
    and is inside of no other. What lies on a wall that holds the particle is no wall to it.
    """
    inside = scratch(len(spans), np.bool_)
    _begin(walls, spans, active, path, near, remaining, inside)
    part, wall = 0.0, -1.0
    # Each time round it is in another room.
    for _room in range(4 * len(spans)):
        latest = -1.0
        for k, span in enumerate(spans):
            if inside[k]:
                left, number = _left(walls, span, active, path, near, remaining, part)
                if left > latest:
                    latest, wall = left, number
        if not latest < math.inf:
            return math.inf, -1.0
        part = latest
        if not _enter(walls, spans, active, path, near, remaining, (part, inside)):
            break
    return part, wall


@outlined
def _begin(walls, spans, active, path, near, remaining, inside):
    """Which rooms of a union a particle is in at the start of a step: that whose wall holds it, or the nearest.

    It is in another one if it is inside of that by more than `near`: rooms that touch are apart.
    """
    nearest, held = math.inf, False
    for first, last in spans:
        nearest = min(nearest, _deepest(walls, (first, last), active, path, remaining, 0.0)[0])
        held = held or _holds(active, first, last)
    least = -near if held else max(near, nearest)
    for k, (first, last) in enumerate(spans):
        depth = _deepest(walls, (first, last), active, path, remaining, 0.0)[0]
        inside[k] = depth <= least or _holds(active, first, last)


def _holds(active, first, last):
    """Whether one of the walls that hold a particle is one of a room."""
    found = False
    for one in active:
        found = found or first <= one <= last
    return found


@outlined
def _enter(walls, spans, active, path, near, remaining, place):
    """Whether a step is inside of any room after a part of it, and of which; `place` is (part, inside)."""
    part, inside = place
    goes_on = False
    for k, span in enumerate(spans):
        inside[k] = _deepest(walls, span, active, path, remaining, part)[0] < -near
        goes_on = goes_on or inside[k]
    return goes_on


@outlined
def _left(walls, span, active, path, near, remaining, part):
    """The part of a step, from one on, after which it leaves a room, infinite where it does not, and the wall."""
    number = _wall_ahead(walls, span, active, path, near, remaining) if part == 0.0 else -1.0
    if number >= 0.0:
        return 0.0, number
    given = walls, span, active, path, remaining
    left = first_true(_is_out, given, part, near, 0.0)
    return left, _deepest(*given, left)[1] if left < math.inf else -1.0


def _is_out(walls, span, active, path, remaining, depth, part):
    return _deepest(walls, span, active, path, remaining, part)[0] > depth


@outlined
def _wall_ahead(walls, span, active, path, near, remaining):
    """The wall of a room that a step is at in its beginning, and goes into; or -1."""
    now, (number, last) = walls.at(remaining), span
    while number <= last:
        towards = dot(now.unit_normal(number, path.r0), path.v0 - now.velocity(number, path.r0))
        is_at = now.distance(number, path.r0) >= -near and not _is_or_lies_on(now, active, number, path.r0)
        if is_at and towards > 0.0:
            return number
        number += 1.0
    return -1.0


@outlined
def _deepest(walls, span, active, path, remaining, part):
    """The largest distance outside of the walls of a room, after a part of a step, and the wall."""
    now, r, (number, last) = walls.at(remaining - part * path.h), at_part(path, part), span
    deepest, wall = -math.inf, number
    while number <= last:
        depth = now.distance(number, r)
        if depth > deepest and not _is_or_lies_on(now, active, number, r):
            deepest, wall = depth, number
        number += 1.0
    return deepest, wall


@outlined
def _is_or_lies_on(walls, active, number, r):
    """Whether a wall is one of those that hold the particle, or lies on one."""
    found = active.has(number)
    for one in active:
        found = found or (one >= 0.0 and lie_on_each_other(walls, one, number, r))
    return found

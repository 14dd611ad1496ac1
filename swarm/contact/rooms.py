"""Where a step of a sliding particle leaves the rooms of a union, and at which of their walls."""

import math

import numpy as np

from ..kernel.arrays import scratch
from ..kernel.jit import outlined
from ..kernel.vector import dot
from ..surfaces.presence.absence import lie_on_each_other
from .path import at_part, first_true


@outlined
def leaving(walls, spans, active, path, near, remaining):
    """Return (the part of a step after which it leaves a union, the wall there); the part is infinite if it stays.

    `spans` are the first and the last wall of each room. A step leaves the union where it leaves the last of the rooms
    that it is in, and is inside of no other. A wall that lies on a wall that holds the particle does not count.
    """
    inside = scratch(len(spans), np.bool_)
    nearest, held = math.inf, False
    for span in spans:
        nearest = min(nearest, _deepest(walls, span, active, path, remaining, 0.0)[0])
        held = held or _holds(active, span)
    # It begins in the room with the wall that holds it, or in the nearest room; also in another room if it is inside of
    # that by more than `near`: rooms that touch are apart.
    _enter(walls, spans, active, path, remaining, 0.0, -near if held else max(near, nearest), inside)
    for k, span in enumerate(spans):
        inside[k] = inside[k] or _holds(active, span)
    part, wall = 0.0, -1.0
    # Each iteration is in another room.
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
        if not _enter(walls, spans, active, path, remaining, part, -near, inside):
            break
    return part, wall


def _holds(active, span):
    """Whether a wall that holds a particle is one of a room."""
    found = False
    for one in active:
        found = found or span[0] <= one <= span[1]
    return found


@outlined
def _enter(walls, spans, active, path, remaining, part, most, inside):
    """Mark the rooms that are no farther than `most` after a part of a step; return whether there is one."""
    goes_on = False
    for k, span in enumerate(spans):
        inside[k] = _deepest(walls, span, active, path, remaining, part)[0] <= most
        goes_on = goes_on or inside[k]
    return goes_on


@outlined
def _left(walls, span, active, path, near, remaining, part):
    """Return the part of a step, from `part` on, after which it leaves a room, or infinity, and the wall."""
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
    """Return the wall of a room that a step begins at and goes into, or -1."""
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
    """Return the largest distance outside of the walls of a room after a part of a step, and the wall."""
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
    """Whether a wall holds the particle, or lies on a wall that does."""
    found = active.has(number)
    for one in active:
        found = found or (one >= 0.0 and lie_on_each_other(walls, one, number, r))
    return found

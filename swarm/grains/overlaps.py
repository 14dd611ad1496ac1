"""Overlaps that no contact may have: the centre of a ball has passed the surface of a wall or of another ball.

From there a contact pushes the wrong way, or pulls the ball through: the step is refused. The largest overlap and the
longest move rule this out for most steps. In the other steps every pair, and every ball at a wall, is checked here
along the straight way of the step. A step in which a ball jumps over a wall or a ball is refused too, for contacts are
looked for only at the ends of steps.
"""

import math
from typing import Any

from ..common.status import Status
from ..contact.path import members_of
from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.record import Record
from ..kernel.vector import norm, square, vector_at
from ..surfaces.balls.rounded import part_within
from ..surfaces.fields.members import member
from ..surfaces.rotation import Rotated
from ..surfaces.walls import Field
from . import grain_arrays as col
from .contacts import apart, move_of
from .heavy_walls import is_heavy, now
from .vessel import is_of_faces, met, moves

# Entries of the failure of a step: the place of a ball in the order of cells, the place of the other ball or -1, the
# wall or -1, and the overlap [m], or the length of the move if the step is too long.
BALL, OTHER, WALL, SIZE, COLUMNS = 0, 1, 2, 3, 4


class Limits(Record):
    """The overlaps and moves up to which a step needs no check."""

    overlap: float  # [m]
    move: float  # [m]
    longest: Any  # the longest move that cannot jump over a solid [m], or None in a scene without solids


def _note(failed, ball, other, wall, size):
    failed[BALL], failed[OTHER], failed[WALL], failed[SIZE] = ball, other, wall, size


@outlined
def look_at_pairs(matter, grains, near, failed):
    """Return the `Status` of a step by its pairs: TOO_FAST, TOO_DEEP or DONE; write the deepest pair into `failed`."""
    place, status, deepest = grains.place, Status.DONE.value, 0.0
    for a in range(place.shape[0]):
        i = index(a)
        mine = move_of(matter, grains, i)
        for k in range(near.first[i], near.first[i + 1]):
            j = index(near.mate[index(k)])
            s, move = apart(matter, place, i, j), mine - move_of(matter, grains, j)
            reach, least = place[i, col.RADIUS] + place[j, col.RADIUS], min(place[i, col.RADIUS], place[j, col.RADIUS])
            overlap = reach - norm(s + part_within(-1.0 * s, move) * move)
            if overlap > deepest:
                is_long = square(move) > reach * reach
                if is_long or overlap > least:
                    deepest, status = overlap, Status.TOO_FAST.value if is_long else Status.TOO_DEEP.value
                    _note(failed, i, j, -1.0, norm(move) if is_long else overlap)
    return status


def _passed(face, r, move):
    """The depth behind a part of a face at which a move through the part ends [m]; -1 for any other move."""
    if isinstance(face, Rotated):
        return _passed(face.body, face.place_in(r), face.vector_in(move))
    return face.passed_by(r, move)


@outlined
def _passed_any(wall, near, k, r, move):
    """The largest depth of `_passed` among the parts of faces listed in row k."""
    most = -1.0
    for m in range(near.spans[k, col.BEGIN], near.spans[k, col.END]):
        most = max(most, _passed(member(members_of(wall.members), index(near.listed[index(m)])), r, move))
    return most


@outlined
def look_at_wall(matter, wall, grains, near, failed, number):
    """Return the `Status` of a step by the balls at a wall; write the deepest one into `failed`."""
    place, status, deepest, longest = grains.place, Status.DONE.value, -math.inf, matter.limits.longest
    for k in range(near.wall_first[number], near.wall_first[number + 1]):
        c = index(k)
        if near.wall_is_open is not None and near.wall_is_open[c]:
            continue
        i = index(near.slot[c])
        r, move, radius = vector_at(place, i, col.X), move_of(matter, grains, i), place[i, col.RADIUS]
        own = met(wall, near.listed, near.spans, c, radius)
        overlap = max(own.gap_of(own.inner(r)), own.gap_of(own.end_inner(r + move)))
        # A step may lead over an edge.
        if not moves(wall):
            overlap = max(overlap, own.gap_of(own.inner(r + 0.5 * move)))
        elif own.pose.turn is None:
            middle = 0.5 * (own.own_place(r) + own.own_end(r + move))
            overlap = max(overlap, own.gap_of(own.body.inner(middle)))
        if isinstance(wall, Field) and moves(wall):
            field = now(wall.members)
            start = field.own_place(r)
            r, move = start, field.own_end(r + move) - start
        elif is_heavy(wall):
            move = move - own.displacement()
        is_through = overlap > radius
        if isinstance(wall, Field) and is_of_faces(members_of(wall.members).like):
            # Far behind a part of a face, the distance to it no longer tells its sides apart.
            depth = _passed_any(wall, near, c, r, move)
            is_through = is_through | (depth >= 0.0)
            overlap = max(overlap, radius + depth) if depth >= 0.0 else overlap
        is_long = False
        if longest is not None:
            is_long = (norm(move) > longest) & (overlap > -norm(move))
        if (is_through or is_long) and overlap > deepest:
            deepest, status = overlap, Status.TOO_FAST.value if is_long else Status.TOO_DEEP.value
            _note(failed, i, -1.0, number, norm(move) if is_long else overlap)
    return status

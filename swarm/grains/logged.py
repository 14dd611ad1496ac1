"""The log of contacts: a row of each contact when it ends, with the sums over its steps.

A contact begins with the first step that ends with an overlap of two balls, or of a ball and a wall. It ends with the
first step that ends without an overlap. In all other steps its impulse is 0. Its notes are kept with its friction, by
the pair, or by the ball and the face of the wall, also where lists are made anew.
"""

from typing import Any, NamedTuple

from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.vector import ZERO, norm, set_vector, vector_at
from ..lanes.watching.log import Lasted, Log, Struck
from ..surfaces.periodic.period import into
from . import grain_arrays as col
from .at_walls import step_at_wall
from .contacts import closing
from .friction import across, faced
from .grain_arrays import OfWall
from .held import velocity_of
from .lanes_of_pairs import move_in, pair_at
from .vessel import met_member


class Noting(NamedTuple):
    """The log of contacts, and the arrays that its rows need besides the contacts."""

    log: Log
    period: Any  # `Period` of the cell, or None
    image: Any  # (3, N) the cells in which the balls were when the lists were made, or None


def _note(matter, rubs, contact, kept, time):
    """Add a step that ends at a time [s] to the notes of a contact; return whether the contact begins in it."""
    gap, k = contact.number(col.GAP), contact.listed()
    # The second condition is that of a contact that exists at the start of the run.
    begins = (gap <= 0.0) | (kept[k, col.PRESSED] == 0.0)
    if begins:
        kept[k, col.BEGAN] = time - matter.h
        kept[k, col.PRESSED] = kept[k, col.FORCE] = kept[k, col.TAKEN_OFF] = 0.0
    impulse = norm(contact.vector(col.IMPULSE))
    kept[k, col.PRESSED] += impulse
    kept[k, col.FORCE] = max(kept[k, col.FORCE], impulse / matter.h)
    if rubs:
        kept[k, col.TAKEN_OFF] += contact.number(col.RUBBED)
    return begins


@outlined
def note_pairs(matter, grains, near, touches, time):
    """Add a step that ends at a time [s] to the notes of the contacts of pairs."""
    for g in range(touches.used[1]):
        for k in range(touches.lanes[index(g)]):
            contact, (i, j) = pair_at(touches, g, index(k))
            if _note(matter, matter.pairs.friction is not None, contact, near.drag, time):
                first, place = i if grains.number[i] < grains.number[j] else j, contact.listed()
                set_vector(near.drag, place, col.ARRIVED, vector_at(grains.speed, first, col.BEFORE))


@outlined
def note_wall(matter, law, wall, grains, near, touches, noting, given):
    """Log the contacts with a wall that have ended in the step; `given` is the number of the wall, and the time [s]."""
    rows, (number, time) = touches.wall_rows, given
    begin = touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        if _note(matter, law.friction is not None, OfWall(rows, c), near.wall_drag, time):
            place, v = index(int(rows[c, col.LISTED])), vector_at(grains.speed, i, col.BEFORE)
            set_vector(near.wall_drag, place, col.ARRIVED, v)
            if noting.log.slip is not None:
                n, (both, _last), _move = faced(matter, wall, grains, touches, c, i)
                set_vector(near.wall_drag, place, col.SLIP, across(v - 0.5 * both, n))


def _row(noting, at, kept, k, time, slip):
    """Log a contact with its notes in row k of `kept`; `at` is a `Struck` without notes, not wrapped into the cell."""
    lasted = Lasted(time - kept[k, col.BEGAN], kept[k, col.FORCE], kept[k, col.TAKEN_OFF])
    back = into(noting.period, at.r)
    struck = at._replace(
        r=back.r, before=vector_at(kept, k, col.ARRIVED), impulse=kept[k, col.PRESSED], slip=slip, lasted=lasted
    )
    noting.log.ended(noting.image, struck, back.images)


@outlined
def log_pairs(matter, world, time):
    """Log the contacts of pairs that have ended in the step that is done, which ended at a time [s]."""
    grains, near, touches, noting = world.grains, world.near, world.touches, world.noting
    speed = grains.speed
    for g in range(touches.used[1]):
        for k in range(touches.lanes[index(g)]):
            contact, (i, j) = pair_at(touches, g, index(k))
            gap, difference = contact.number(col.GAP), vector_at(speed, i, col.AFTER) - vector_at(speed, j, col.AFTER)
            move = move_in(matter, contact.rows, contact.q, contact.lane, difference)
            way = closing(contact.vector(col.START), contact.number(col.SIZE), move)
            if (gap > 0.0) & (gap + way.change <= 0.0):
                if grains.number[i] > grains.number[j]:
                    i, j = j, i
                r, v = vector_at(grains.place, i, col.X), velocity_of(world.held, grains, i)
                at = Struck(grains.number[i], -1.0, time, r, v, v, 0.0, partner=grains.number[j])
                _row(noting, at, near.drag, contact.listed(), time, ZERO)


@outlined
def log_wall(matter, wall, world, given):
    """Log the contacts with a wall that have ended in the step; `given` is the number of the wall, and the time [s]."""
    grains, near, touches, noting = world.grains, world.near, world.touches, world.noting
    rows, (number, time) = touches.wall_rows, given
    begin = touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        if rows[c, col.GAP] > 0.0:
            i = index(touches.wall_ends[c])
            radius = grains.place[i, col.RADIUS]
            _own, _move, way = step_at_wall(matter, wall, grains, touches, c, i)
            if rows[c, col.GAP] + way.change <= 0.0:
                r, v = vector_at(grains.place, i, col.X), velocity_of(world.held, grains, i)
                member = world.places[number][index(met_member(wall, touches.listed, touches.spans, c, radius, r))]
                place = index(int(rows[c, col.LISTED]))
                slip = ZERO if noting.log.slip is None else vector_at(near.wall_drag, place, col.SLIP)
                at = Struck(grains.number[i], float(member), time, r, v, v, 0.0)
                _row(noting, at, near.wall_drag, place, time, slip)

"""Particles that have left a cell that repeats, back into it; what they were on is told by where they are then."""

import numpy as np

from ..contact.events import ARRIVED, EDGE, FLYING, HELD
from ..kernel.jit import by_type, by_type_outlined, index, inlined, outlined
from ..kernel.vector import Vec, column, dot, put
from ..surfaces import fold as walls
from ..surfaces.axes import length_of
from ..surfaces.moving import at
from ..surfaces.period import Period, has_left, into, keeps_walls
from . import arrays, compose
from .marks import marked_lanes
from .stay import AGAIN

# A wall that is farther away than this part of the cell is none that holds a particle.
_ON_THE_WALL = 1e-12


@by_type
def return_lanes(period, state, lanes, live):
    """The lanes that their flight has brought out of the cell; what they meet there they meet in the next pass."""


@return_lanes.register(Period)
def _(period, state, lanes, live):
    rows = lanes.rows
    for i in range(index(live)):
        lanes.marked[i] = has_left(period, column(rows, arrays.R, i))
    for k in range(marked_lanes(lanes, live)):
        lane = index(lanes.order[k])
        p = index(lanes.particle[lane])
        r, before = column(rows, arrays.R, lane), state.energy[p]
        back = into(period, r)
        put(rows, arrays.R, lane, back.r)
        _count(period, state, p, back.images)
        rows[arrays.OWN, lane] = _twice(period.fall, state.energy[p], before, rows[arrays.OWN, lane])
        if not keeps_walls(period, r):
            lanes.wall[lane] = -1.0


@inlined
def _count(period, state, p, images):
    """Count the images that a particle has come through, and change its energy to that in the cell."""
    state.image[0, p] += np.int64(images.x)
    state.image[1, p] += np.int64(images.y)
    state.image[2, p] += np.int64(images.z)
    _fall(period.fall, state, p, images)


@by_type
def _fall(fall, state, p, images):
    """The energy of particle p relative to the cell it is in now."""


@_fall.register(Vec)
def _(fall, state, p, images):
    # Kahan's sum: the same change again and again would be rounded the same way each time.
    change = -dot(images, fall) - state.carry[p]
    before = state.energy[p]
    after = before + change
    state.carry[p] = (after - before) - change
    state.energy[p] = after


@by_type
def _twice(fall, after, before, twice):
    """Twice the energy per mass of a lane, part of whose changes the state is not told yet."""
    return twice


@_twice.register(Vec)
def _(fall, after, before, twice):
    return 2.0 * after - (2.0 * before - twice)


# --- Along walls -----------------------------------------------------------------------------------------


@by_type_outlined
def return_sliding(period, chain, state, lanes, i, phase):
    """A lane that slides, back into the cell where it goes on; what it does next: it flies to the image of its wall."""
    return phase


@return_sliding.register(Period)
def _(period, chain, state, lanes, i, phase):
    rows, p = lanes.rows, lanes.particle[i]
    r = column(rows, compose.R, i)
    if phase == ARRIVED or not has_left(period, r):
        return phase
    back, before = into(period, r), state.energy[p]
    first, second, slides = rows[compose.WALL, i], rows[compose.WALL + 1, i], phase in (HELD, EDGE, AGAIN)
    if not slides or not _are_there(period, at(chain, rows[compose.LEFT, i]), first, second, r, back.r):
        return FLYING
    put(rows, compose.R, i, back.r)
    _count(period, state, p, back.images)
    rows[compose.TWICE, i] = _twice(period.fall, state.energy[p], before, rows[compose.TWICE, i])
    return phase


@by_type_outlined
def return_particle(period, chain, state, p):
    """A particle that its kernel has given back, into the cell."""


@return_particle.register(Period)
def _(period, chain, state, p):
    contacts, r = state.contacts, column(state.position, 0, p)
    if not has_left(period, r):
        return
    back = into(period, r)
    put(state.position, 0, p, back.r)
    _count(period, state, p, back.images)
    first, second = contacts.walls[0, p], contacts.walls[1, p]
    holds = contacts.phase[p] == HELD or contacts.phase[p] == EDGE
    if holds and not _are_there(period, at(chain, contacts.left[p]), first, second, r, back.r):
        contacts.phase[p], contacts.step[p] = FLYING, 0.0
        contacts.walls[0, p], contacts.walls[1, p] = -1.0, -1.0


@outlined
def _are_there(period, chain, first, second, r, back):
    """Whether the walls that hold a particle at r are those that hold it in the cell, not images of others."""
    near = _ON_THE_WALL * _length(period)
    return _is_there(chain, first, r, back, near) and (second < 0.0 or _is_there(chain, second, r, back, near))


@outlined
def _is_there(chain, wall, r, back, near):
    same = dot(walls.unit_normal(chain, wall, r), walls.unit_normal(chain, wall, back)) > 0.5
    return same and abs(walls.distance(chain, wall, back) - walls.distance(chain, wall, r)) <= near


@inlined
def _length(period):
    return length_of(period.x) + length_of(period.y) + length_of(period.z)

"""Return particles to the periodic cell that they left; a check there shows whether their walls still hold them."""

import numpy as np

from ..contact.events import ARRIVED, EDGE, FLYING, HELD
from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.vector import column, dot, put
from ..surfaces.periodic.axes import length_of
from ..surfaces.periodic.period import has_left, into, keeps_walls
from .sliding import AGAIN
from .table import marked_lanes

# A wall does not hold a particle that comes back into the cell if its distance changes by more than this fraction of
# the cell.
_ON_THE_WALL = 1e-12


def return_lanes(period, state, lanes, live):
    """The lanes that their flight has brought out of the cell; what they meet there they meet in the next pass."""
    for i in range(index(live)):
        lanes.marked[i] = has_left(period, lanes.lane(i).r)
    for k in range(marked_lanes(lanes, live)):
        i = index(lanes.order[k])
        lane, p = lanes.lane(i), index(lanes.particle[i])
        r = lane.r
        back = into(period, r)
        lane.r = back.r
        lane.twice = _come_through(period, state, p, back.images, lane.twice)
        if not keeps_walls(period, r):
            lanes.wall[i] = -1.0


def _come_through(period, state, p, images, twice):
    """Count the images that a particle has come through, and change its energy to that in the cell.

    `twice` is twice the energy per mass of a lane; some changes of it are not in the state yet. Return its value
    after this change.
    """
    state.image[0, p] += np.int64(images.x)
    state.image[1, p] += np.int64(images.y)
    state.image[2, p] += np.int64(images.z)
    if period.fall is None:
        return twice
    # Kahan's sum: the same change again and again would be rounded the same way each time.
    change = -dot(images, period.fall) - state.carry[p]
    before = state.energy[p]
    after = before + change
    state.carry[p] = (after - before) - change
    state.energy[p] = after
    return 2.0 * after - (2.0 * before - twice)


# --- Along walls -----------------------------------------------------------------------------------------


@outlined
def return_sliding(period, walls, state, lanes, i, phase):
    """A lane that slides, back into the cell where it goes on; its phase then: it flies to the image of its wall."""
    lane, p = lanes.lane(i), lanes.particle[i]
    r = lane.r
    if phase == ARRIVED or not has_left(period, r):
        return phase
    back, slides = into(period, r), phase in (HELD, EDGE, AGAIN)
    if not slides or not _are_there(period, walls.at(lane.remaining), lane.first, lane.second, r, back.r):
        return FLYING
    lane.r = back.r
    lane.twice = _come_through(period, state, p, back.images, lane.twice)
    return phase


@outlined
def return_particle(period, walls, state, p):
    """A particle that its kernel has given back, into the cell."""
    contacts, r = state.contacts, column(state.position, 0, p)
    if not has_left(period, r):
        return
    back = into(period, r)
    put(state.position, 0, p, back.r)
    _come_through(period, state, p, back.images, 0.0)
    first, second = contacts.walls[0, p], contacts.walls[1, p]
    holds = contacts.phase[p] == HELD or contacts.phase[p] == EDGE
    if holds and not _are_there(period, walls.at(contacts.remaining[p]), first, second, r, back.r):
        contacts.phase[p], contacts.step[p] = FLYING, 0.0
        contacts.walls[0, p], contacts.walls[1, p] = -1.0, -1.0


@outlined
def _are_there(period, walls, first, second, r, back):
    """Whether the walls that hold a particle at r are those that hold it in the cell, not images of others."""
    near = _ON_THE_WALL * (length_of(period.x) + length_of(period.y) + length_of(period.z))
    return _is_there(walls, first, r, back, near) and (second < 0.0 or _is_there(walls, second, r, back, near))


@outlined
def _is_there(walls, wall, r, back, near):
    same = dot(walls.unit_normal(wall, r), walls.unit_normal(wall, back)) > 0.5
    return same and abs(walls.distance(wall, back) - walls.distance(wall, r)) <= near

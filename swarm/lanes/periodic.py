"""Return particles to the periodic cell that they left, and find whether their walls still hold them there."""

import numpy as np

from ..contact.events import ARRIVED, EDGE, FLYING, HELD
from ..kernel.arrays import index, kept
from ..kernel.jit import outlined, select
from ..kernel.vector import column, dot, put
from ..methods.contract import HARD
from ..surfaces.periodic.axes import least, length_of, pulls, time_to_leave
from ..surfaces.periodic.period import has_left, into, keeps_walls
from .sliding import AGAIN
from .table import marked_lanes

# A wall does not hold a particle that returns to the cell if its distance changes by more than this fraction of the
# cell.
_ON_THE_WALL = 1e-12


def return_lanes(method, walls, gravity, state, lanes, live):
    """Return lanes that have left the cell in their flight; they meet walls there in the next pass.

    With a method that steps into walls they take their step in this pass, from the walls that they touch in the cell.
    """
    period = lanes.period
    if period is None:
        return
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
            if method.steps_into_walls and lane.remaining > 0.0:
                lanes.wall[i] = method.touched(walls, gravity, lanes.given(method, i))


def _come_through(period, state, p, images, twice):
    """Count the images that a particle has passed through, and change its energy to that in the cell.

    `twice` is twice the energy per mass of a lane; some changes of it are not yet in the state. Return its value
    after this change.
    """
    state.image[0, p] += np.int64(images.x)
    state.image[1, p] += np.int64(images.y)
    state.image[2, p] += np.int64(images.z)
    if period.fall is None:
        return twice
    # Kahan's sum: otherwise repeated equal changes would be rounded in the same direction each time.
    change = -dot(images, period.fall) - state.carry[p]
    before = state.energy[p]
    after = before + change
    state.carry[p] = (after - before) - change
    state.energy[p] = after
    return 2.0 * after - (2.0 * before - twice)


# --- Of steps into walls ---------------------------------------------------------------------------------


def cut_steps(period, method, walls, gravity, lane, end):
    """Return the `FlightEnd` of the free steps that stay in the cell: the step out of it may meet images."""
    if period is None:
        return end
    (r, v), (gx, gy, gz) = (lane.r, lane.v), pulls(gravity)
    x, y = time_to_leave(period.x, r.x, v.x, gx), time_to_leave(period.y, r.y, v.y, gy)
    steps = np.floor(least(x, y, time_to_leave(period.z, r.z, v.z, gz)) / method.dt)
    taken = lane.remaining - end.remaining
    sooner = method.flown(walls, gravity, lane, select(steps < taken, steps, taken))
    cut = steps < taken
    return end._replace(
        r=select(cut, sooner.r, kept(end.r)), v=select(cut, sooner.v, kept(end.v)),
        remaining=select(cut, sooner.remaining, end.remaining), wall=select(cut, sooner.wall, end.wall),
    )  # fmt: skip


def return_stepped_lanes(method, walls, share, lanes, live):
    """Return lanes that have left the cell in their steps."""
    if lanes.period is None or not method.contacts_take_time:
        return
    for i in range(index(live)):
        # A hard lane has not taken its step yet.
        if lanes.wall[i] > HARD:
            return_stepped(method, walls, share, lanes, i)


def return_stepped(method, walls, share, lanes, i):
    """Return a lane that has left the cell in its step, at the end of this step: its contacts go on with images."""
    if has_left(lanes.period, lanes.lane(i).r):
        _return_stepped(method, walls, share, lanes, i)


@outlined
def _return_stepped(method, walls, share, lanes, i):
    lane, p, state, counters = lanes.lane(i), index(lanes.particle[i]), share.state, share.counters
    r, back = lane.r, into(lanes.period, lane.r)
    lane.r = back.r
    lane.twice = _come_through(lanes.period, state, p, back.images, lane.twice)
    if method.laws_at_ends is not None:
        _hand_on(lanes.period, method.at_start(walls, lane.remaining), state, p, r, back.r)
    if counters is not None:
        counters.come_back_lane(method, share, lanes, i, r)


def _hand_on(period, walls, state, p, r, back):
    """Move the impulse of each contact that goes on with another image of its wall to this image."""
    for k in range(walls.length()):
        if state.pressed[k, p] + state.rubbed[k, p] == 0.0:
            continue
        for j in range(walls.length()):
            if j != k and _is_image(period, walls, (float(k), r), (float(j), back)):
                state.pressed[j, p] += state.pressed[k, p]
                state.rubbed[j, p] += state.rubbed[k, p]
                state.pressed[k, p] = state.rubbed[k, p] = 0.0
                break


# --- Along walls -----------------------------------------------------------------------------------------


@outlined
def return_sliding(period, walls, state, lanes, i, phase):
    """Return a sliding lane to the cell; return its phase, FLYING if its walls are others there."""
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
    """Return a particle to the cell after its kernel has written it back."""
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
    """Whether the walls that hold a particle at r also hold it in the cell, and not images of other walls."""
    there = _is_image(period, walls, (first, r), (first, back))
    return there and (second < 0.0 or _is_image(period, walls, (second, r), (second, back)))


@outlined
def _is_image(period, walls, before, after):
    """Whether the wall `after` (number, place) is at its place as the wall `before` is at its own."""
    (wall, r), (other, back) = before, after
    near = _ON_THE_WALL * (length_of(period.x) + length_of(period.y) + length_of(period.z))
    same = dot(walls.unit_normal(wall, r), walls.unit_normal(other, back)) > 0.5
    return same and abs(walls.distance(other, back) - walls.distance(wall, r)) <= near

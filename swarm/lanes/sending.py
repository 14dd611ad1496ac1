"""Impacts on walls that send particles off by a law: a temperature's, or a user-defined one.

A loop without branches, which LLVM vectorises if the law has none, computes the velocity of each lane; another loop
books the lanes that are sent off. The numbers of a particle that the first loop reads are copied to its lane before:
the compiler cannot prove that a table in which the loop looks up numbers does not overlap the arrays that it writes.
"""

import math

import numpy as np

from ..contact.reflection import Bounce
from ..contact.wall_impact import Arriving, book_energy, by_law
from ..kernel.arrays import index
from ..kernel.jit import select
from ..kernel.vector import put, square
from .accounts import add_work
from .escape import detain
from .hit_member import of_lane
from .lane_arrays import Flying
from .table import LaneView, Rows, marked_lanes

_named = Rows()
_named.take(Flying.ALL)


class Sending(LaneView):
    """A lane that a law sends off, in rows behind those of its flight."""

    v, twice, impulse, work = _named.vector(), _named.number(), _named.number(), _named.number()
    lost, heat, wait = _named.number(), _named.number(), _named.number()
    wall, mass = _named.number(), _named.number()

    # With the rows of its flight.
    ROWS = _named.count


def send_off(method, walls, gravity, share, lanes, picked, live):
    """Send off every lane that meets a law; return whether a law gave no velocity, or one into the wall."""
    state, order = share.state, lanes.order
    for i in range(index(live)):
        p = index(lanes.particle[i])
        Sending(lanes.rows, i).mass, order[i] = state.mass[p], state.impacts[p]
    for i in range(index(live)):
        _compute(method, walls, gravity, share, lanes, picked, i)
    some_wrong = False
    for k in range(marked_lanes(lanes, live)):
        some_wrong = _book(method, walls, share, lanes, index(order[k])) | some_wrong
    return some_wrong


def _compute(method, walls, gravity, share, lanes, picked, i):
    """Compute the velocity and the accounts of a lane, as if a law sends it off."""
    lane, sent, wall, laws = lanes.lane(i), Sending(lanes.rows, i), lanes.wall[i], method.laws
    here = method.walls_of(of_lane(walls, picked, i), lane.remaining)
    number = lanes.order[i] + np.int64(lane.hits)
    random = share.seeding.of_impact(lanes.particle[i], number, laws)
    happens, found = by_law(laws, here, gravity, wall, Arriving(lane.r, lane.v, lane.twice, sent.mass), random)
    # This ends the contact, unless a wall at 0 K holds the particle, or a user-defined law may.
    holds = not square(found.v) > 0.0
    if laws.own is not None:
        holds = holds | method.is_within(lanes.given(method, i), square(found.v), found.twice_away, 1.0)
    sent.v, sent.twice, sent.impulse, sent.work = found.v, found.twice_energy, found.impulse, found.work
    sent.lost, sent.heat, sent.wait = found.lost, found.heat, found.wait
    sent.wall = select(holds, wall, -1.0)
    lanes.marked[i] = happens & (wall >= 0.0)


def _book(method, walls, share, lanes, i):
    """Send a lane off; return whether a law failed."""
    state, laws = share.state, method.laws
    lane, sent, wall, p = lanes.lane(i), Sending(lanes.rows, i), lanes.wall[i], index(lanes.particle[i])
    if laws.own is not None and math.isnan(sent.v.x):
        _leave_wrong(state, lanes, i)
        return True
    row = walls.row(wall)
    # The losses by impacts since the energy was written are booked when the particle leaves its lane.
    state.energy[p] = 0.5 * (sent.twice - sent.work) + (state.energy[p] - 0.5 * lane.twice)
    bounce = Bounce(sent.v, sent.impulse, sent.twice, 0.0, sent.work, sent.lost, sent.heat)
    heat = book_energy(state, (row, p, p), sent.mass, bounce)
    if share.counts is not None:
        share.counts.give(wall, heat, sent.wait)
    add_work(walls, lanes.impulse, i, wall, 0.5 * sent.work)
    lane.v, lane.twice = sent.v, sent.twice
    lane.hits += 1.0
    lanes.impulse[row, i] += sent.impulse
    for watch in share.watchers.of_impacts():
        watch.note(lanes, i, sent.impulse)
    lanes.wall[i] = sent.wall
    if state.absorbed_time is not None and sent.wait > 0.0:
        goes_on = detain(share, p, wall, lane.remaining, sent.wait)
        lane.remaining = lane.remaining - sent.wait if goes_on else 0.0
        lanes.wall[i] = lanes.wall[i] if goes_on else -1.0
    return False


def _leave_wrong(state, lanes, i):
    """Write the arguments of a law that failed to the state."""
    lane, p = lanes.lane(i), index(lanes.particle[i])
    put(state.position, 0, p, lane.r)
    put(state.velocity, 0, p, lane.v)
    state.impacts[p] += np.int64(lane.hits)
    state.contacts.remaining[p], state.contacts.met[p] = lane.remaining, lanes.wall[i]
    # The look at all lanes finds this NaN.
    lane.remaining, lanes.wall[i] = math.nan, -1.0

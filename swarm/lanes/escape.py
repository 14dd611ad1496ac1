"""Particles that reach a wall where it is open, or that absorbs them: nothing is left of their frames."""

import math

import numpy as np

from ..contact import crossing
from ..contact.absence import closeness, hit_wall, lets_through, open_wall_of, through
from ..contact.events import ARRIVED, FLYING
from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.vector import norm, put
from ..surfaces.presence.openings import is_open
from ..surfaces.presence.rooms import leads_on
from .table import marked_lanes
from .watching.crossings import ParticleMoment
from .watching.log import Struck


def escape(share, p, wall, r, v, remaining):
    """Particle p has escaped, with so much of its frame left: it stays where and as fast as it is."""
    share.state.escape_time[p] = share.moment - remaining
    if share.counters is not None:
        share.counters.settle(share, p, ParticleMoment(r, v, remaining))
    share.watchers.hit(share.state.image, Struck(p, wall, share.moment - remaining, r, v, v, 0.0))


def absorb(share, p, wall, remaining):
    """A wall has absorbed particle p, with so much of its frame left: it stays where and as fast as it is."""
    absorbed = share.state.absorbed
    absorbed.time[p], absorbed.wall[p] = share.moment - remaining, np.int32(wall)


def detain(share, p, wall, remaining, wait):
    """Whether particle p goes on in this frame after a wait at a wall; else it is absorbed, or waits longer."""
    if wait < remaining:
        return True
    if wait == math.inf:
        absorb(share, p, wall, remaining)
    else:
        share.state.starts[p] = share.moment - remaining + wait
    return False


def let_out_lanes(openings, method, walls, gravity, share, lanes, live):
    """The lanes with a flight that has ended on a wall where it is open, if no closed one is at the same place.

    Where another room is on its other side a lane is in that, and its flight goes on in the next pass.
    """
    near = closeness(walls)
    for i in range(index(live)):
        lanes.marked[i] = is_open(openings, lanes.wall[i], lanes.lane(i).r, near)
    for k in range(marked_lanes(lanes, live)):
        i = index(lanes.order[k])
        flier = lanes.lane(i)
        r, v = flier.r, flier.v
        now = walls.at(flier.remaining)
        wall = hit_wall(openings, method, now, (r, v), lanes.wall[i], near)
        if not lets_through(openings, now, wall, r, near):
            lanes.wall[i] = wall
            continue
        if leads_on(now, wall, r):
            (flier.r, flier.v), lanes.wall[i] = through(now, gravity, wall, (r, v)), -1.0
            continue
        p, counters = index(lanes.particle[i]), share.counters
        if counters is not None:
            counters.retire(share.state, lanes, p, i)
        escape(share, p, lanes.wall[i], r, v, flier.remaining)
        if counters is not None:
            counters.load(share.state, lanes, p, i)
        flier.remaining, lanes.wall[i] = 0.0, -1.0


@outlined
def is_at_opening(slide, now, i):
    """Whether a lane that slides is where a wall that holds it is open: it is at that wall then, as if it flew."""
    lanes, lane = slide.lanes, slide.lanes.lane(i)
    near = crossing.near(slide.method, lane.r)
    wall = open_wall_of(lanes.openings, slide.method, now, slide.active(lane), lane.r, near)
    if wall < 0.0:
        return False
    slide.state.contacts.met[lanes.particle[i]] = wall
    lane.v = slide.with_kept(now, lane)
    lane.keep = 0.0
    return True


@outlined
def let_out(walls, gravity, share, i, wall, r, v, remaining):
    """Particle i escapes through an open wall, or flies into the room behind it with the speed that it has kept."""
    state, contacts = share.state, share.state.contacts
    if not leads_on(walls, wall, r):
        escape(share, i, wall, r, v, remaining)
        end_frame(share, i)
        return
    first, second, keep = contacts.walls[0, i], contacts.walls[1, i], contacts.keep[i]
    if keep > 0.0 and first >= 0.0:
        n = walls.unit_normal(first, r)
        n = n + walls.unit_normal(second, r) if second >= 0.0 else n
        v = v - (keep / norm(n)) * n
    r, v = through(walls, gravity, wall, (r, v))
    put(state.position, 0, i, r)
    put(state.velocity, 0, i, v)
    contacts.remaining[i], contacts.keep[i], contacts.step[i] = remaining, 0.0, 0.0
    contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
    contacts.phase[i] = FLYING
    share.hand_over(i, FLYING)


def end_frame(share, i):
    """Nothing is left of the frame of particle i, which no wall holds."""
    contacts = share.state.contacts
    contacts.remaining[i], contacts.keep[i] = 0.0, 0.0
    contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
    contacts.phase[i] = FLYING
    share.hand_over(i, ARRIVED)

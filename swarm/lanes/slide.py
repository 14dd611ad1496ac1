"""Advance particles that slide, a block of them at once, in lanes: one kernel for one wall, one for edges of two walls.

One pass is one composed step of every lane, in loops without branches. An event in a step (the wall lets go, another
wall is met, the particle stops) is found one lane at a time: the step is cut there and taken again, so that it ends
at the instant to round-off. A lane books the impulses on its walls step by step, so that a halt changes no bit.
"""

import numpy as np

from ..common.status import Status
from ..contact import events, hold
from ..contact.events import ARRIVED, CAREFUL, FLYING
from ..contact.reflection import wall_velocity
from ..kernel.arrays import index
from ..kernel.jit import long_kernel, outlined
from ..kernel.vector import column, put, square
from ..surfaces.presence.rooms import inside_of
from .lane_arrays import speed2_scale
from .periodic import return_particle, return_sliding
from .sliding import AGAIN, Slide
from .sliding_ends import decide, set_going
from .sliding_step import compose, end_steps
from .table import LANES, LOOK, with_distances
from .watching import log as impact_log
from .watching.counted_lanes import Began
from .watching.crossings import ParticleMoment


@long_kernel
def slide_block(kind, method, walls, gravity, share, lanes):
    """Advance the particles of this kind, `One` or `Two`, that a thread draws; return (status, particle, drawn).

    Each goes on until it arrives, flies, or is held by other walls; `share.pending` counts those left to other kernels.
    """
    lanes = with_distances(lanes)
    slide = Slide(kind, method, walls, gravity, share.state, lanes, share.counts)
    place, live, passes = impact_log.gone_on(share.log)
    loaded = True
    while live < LANES and loaded:
        place, loaded, passes = _refill(slide, share, live, place, passes)
        if loaded:
            lanes.lane(live).looked_particle = -1.0
            live += 1
    while live > 0:
        status, particle = _over(method, share, lanes, live, (place, passes))
        if status != Status.DONE.value:
            for i in range(live):
                _retire(slide, share, i, slide.phase())
            return status, particle, place.drawn
        passes += 1
        compose(slide, live)
        end_steps(slide, live)
        for i in range(live):
            slide.account(i)
        # From the last: then every lane behind one that leaves is still under way and may take its place.
        for i in range(live - 1, -1, -1):
            phase = _next_phase(slide, share, i)
            if phase != slide.phase():
                _retire(slide, share, i, phase)
                place, loaded, passes = _refill(slide, share, i, place, passes)
                if not loaded:
                    live -= 1
                    lanes.move(live, i)
    # A halt may have kept the loop from loading more.
    return (Status.INTERRUPTED.value if passes >= share.halt[0] else Status.DONE.value), 0, place.drawn


@outlined
def _over(method, share, lanes, live, going):
    """Return (the status that ends the call before the next pass, or DONE, a particle that made no progress)."""
    place, passes = going
    if passes >= share.halt[0]:
        return Status.INTERRUPTED.value, 0
    if share.counters is not None and impact_log.is_full(share.log):
        impact_log.keep_going(share.log, place, 0, passes)
        return Status.LOG_FULL.value, 0
    if passes % LOOK == 0:
        for i in range(live):
            lane, p = lanes.lane(i), lanes.particle[i]
            if lane.stands(method, float(p)):
                return Status.TIMELESS.value, p
            lane.look(float(p))
    return Status.DONE.value, 0


def _next_phase(slide, share, i):
    """Return the phase of a lane after a step."""
    phase, lanes = slide.phase(), slide.lanes
    if lanes.event[i] != 0:
        phase = decide(slide, i)
    phase = phase if lanes.lane(i).remaining > 0.0 else ARRIVED
    if share.counters is None:
        return _in_cell(slide, i, phase)
    before, end = _count_step(slide, share, i), lanes.lane(i).r
    phase = _in_cell(slide, i, phase)
    _count_return(slide, share, i, before, end)
    return phase


def _in_cell(slide, i, phase):
    """Return a lane to the periodic cell; return its phase."""
    lanes = slide.lanes
    return phase if lanes.period is None else return_sliding(lanes.period, slide.walls, slide.state, lanes, i, phase)


# --- Crossings of counters ------------------------------------------------------------------------------


def _begin_step(slide, i):
    """Keep a lane as it is before its next step."""
    lane, began = slide.lanes.lane(i), Began(slide.lanes.began, i)
    began.r, began.v, began.remaining = lane.r, lane.v, lane.remaining


@outlined
def _count_step(slide, share, i):
    """Count the crossings of a lane since its step began; return the `ParticleMoment` of that beginning."""
    lane, began = slide.lanes.lane(i), Began(slide.lanes.began, i)
    before = ParticleMoment(began.r, began.v, began.remaining)
    share.counters.count_step(share, slide.lanes.particle[i], before, ParticleMoment(lane.r, lane.v, lane.remaining))
    _begin_step(slide, i)
    return before


@outlined
def _count_return(slide, share, i, before, end):
    """Count the crossings of a lane at a face of the cell, where its step has ended; begin its next step."""
    lane = slide.lanes.lane(i)
    if slide.lanes.period is not None:
        shift = lane.r - end
        if square(shift) > 0.0:
            now = ParticleMoment(lane.r, lane.v, lane.remaining)
            share.counters.come_back(share, slide.lanes.particle[i], before, end, now)
            _begin_step(slide, i)


# --- Into lanes and out of them --------------------------------------------------------------------------


@outlined
def _refill(slide, share, i, place, passes):
    """Load the next particle that slides into lane i; return (the next place, whether one was loaded, the passes).

    After a halt none is loaded, since the particles loaded may rest or fly at once, one after the other. To rest on
    moving walls takes as long as a pass, and counts as one.
    """
    while passes < share.halt[0]:
        place = share.following(slide.phase(), place)
        if place.is_end():
            return place, False, passes
        place = place.after()
        if _load(slide, share, i, place.i - 1):
            return place, True, passes
        if slide.moves():
            passes += 1
    return place, False, passes


@outlined
def _load(slide, share, i, p):
    """Load particle p into lane i; return whether it slides: it may also rest until the end of the frame, or fly."""
    lane, state, contacts = slide.lanes.lane(i), slide.state, slide.state.contacts
    begins = not contacts.remaining[p] > 0.0
    remaining = share.span if begins else contacts.remaining[p]
    r, v = column(state.position, 0, p), column(state.velocity, 0, p)
    slide.lanes.particle[i] = p
    lane.remaining, lane.step, lane.cut, lane.trials = remaining, contacts.step[p], np.inf, 0.0
    lane.first, lane.second = contacts.walls[0, p], contacts.walls[1, p]
    lane.keep, lane.twice, lane.scale2 = contacts.keep[p], 2.0 * state.energy[p], speed2_scale(state, p)
    if begins:
        active, now = slide.active(lane), slide.walls.at(remaining)
        # The velocity in frames includes the speed that is kept across the walls.
        along = active.split_at(now, hold.drift(slide.moving(), active, now, r), r, v).along
        if slide.moves() and lane.keep > 0.0:
            slide.cross(i, square(along) + lane.keep * lane.keep - square(v))
        v = along
    lane.r, lane.v = r, v
    if share.counters is not None:
        _begin_step(slide, i)
    phase = set_going(slide, i)
    if share.counters is not None:
        _count_step(slide, share, i)
    if phase != slide.phase():
        _retire(slide, share, i, phase)
        return False
    return True


@outlined
def _retire(slide, share, i, phase):
    """Write a lane back to its particle, for the next phase."""
    lanes, state, contacts = slide.lanes, slide.state, slide.state.contacts
    lane, p = lanes.lane(i), index(lanes.particle[i])
    now = slide.walls.at(lane.remaining)
    if phase == AGAIN:
        phase = slide.phase()
    v, keep = lane.v, lane.keep
    slid = phase != FLYING and phase != CAREFUL
    if not (slid and lane.remaining > 0.0):
        v = slide.with_kept(now, lane)
        if slide.moves() and keep > 0.0:
            slide.cross(i, square(v) - square(lane.v) - keep * keep)
    if phase == FLYING:
        u = wall_velocity(slide.moving(), now, lane.first, lane.r)
        v = events.off_the_wall(now, lane.first, lane.r, v, u)
        if now.inset is not None:
            lane.r = inside_of(now, lane.first, lane.r)
    put(state.position, 0, p, lane.r)
    put(state.velocity, 0, p, v)
    contacts.walls[0, p] = lane.first if slid else -1.0
    contacts.walls[1, p] = lane.second if slid else -1.0
    if phase != ARRIVED:
        contacts.phase[p] = phase if slid else FLYING
    elif contacts.phase[p] != ARRIVED:
        contacts.phase[p] = slide.phase()
    contacts.remaining[p] = lane.remaining if phase != ARRIVED else 0.0
    contacts.step[p] = lane.step if slid else 0.0
    contacts.keep[p] = keep
    if lanes.period is not None:
        return_particle(lanes.period, slide.walls, state, p)
        if share.counters is not None:
            lane.v = v
            end = lane.r
            lane.r = column(state.position, 0, p)
            _count_return(slide, share, i, ParticleMoment(end, v, lane.remaining), end)
    share.hand_over(p, phase)

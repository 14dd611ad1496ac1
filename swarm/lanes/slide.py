"""Particles that slide, a block of them at once, in lanes: one kernel for one wall, one for the edges of two.

One pass is one composed step of every lane, in loops without branches. What a step may end with (the wall lets go,
another wall is met, the particle stops) is found one lane at a time: the step is cut there and taken again, so that it
ends at the instant to round-off. A lane writes what it gives its walls step by step, so that a halt changes no bit.
"""

import math

import numpy as np

from ..contact import crossing, events, hold
from ..contact import laws as wall_laws
from ..contact import sliding as slides
from ..contact.events import ARRIVED, CAREFUL, EVENT, FLYING, HELD
from ..contact.passing import part_until_open
from ..contact.reflection import wall_velocity
from ..kernel.gravity import potential
from ..kernel.jit import index, long_kernel, outlined
from ..kernel.vector import ZERO, column, put, square
from ..methods import contract as methods
from ..status import Status
from ..surfaces import fold as walls
from ..surfaces.moving import at
from ..surfaces.period import part_until
from .arrays import following_particle, goes_on_by, speed2_scale
from .compose import SHORTEST, compose, end_steps, twice_after
from .escape import is_at_opening
from .sliding import (
    AGAIN,
    FAILED,
    LEAVES,
    LIFTED,
    MET,
    PASSES,
    STOPPED,
    STUCK,
    account,
    lose,
    moves,
    phase_of,
    push,
    with_kept,
    work,
)  # fmt: skip
from .stay import stay
from .table import LANES, LOOK, with_distances
from .wrap import return_particle, return_sliding

# Times that a step is cut before the lane is given up: it takes four or so.
_MOST_TRIALS = 100
# The first step of a particle that begins to slide, in crossings; the walls correct it.
_FIRST = 1e-3
# A step that is tried again is so much shorter.
_RETRY = 0.25


@long_kernel
def slide_block(kind, method, chain, gravity, share, lanes):
    """Advance the particles of this kind, `One` or `Two`, that a thread draws: (status, particle, drawn).

    Each until it has arrived, flies, or is held by other walls; `share.pending` counts what is left to other kernels.
    """
    lanes = with_distances(lanes)
    following, stop, drawn, live, passes = 0, 0, 0, 0, 0
    while live < LANES:
        following, stop, drawn, loaded = _refill(
            kind, method, chain, gravity, share, lanes, live, (following, stop, drawn, passes)
        )
        if not loaded:
            break
        lanes.lane(live).looked_particle = -1.0
        live += 1
    while live > 0:
        status, particle = _over(method, share, lanes, live, passes)
        if status != Status.DONE.value:
            for i in range(live):
                _retire(kind, method, chain, share, lanes, i, phase_of(kind))
            return status, particle, drawn
        passes += 1
        compose(kind, method, chain, gravity, lanes, live)
        end_steps(kind, method, chain, gravity, lanes, live)
        for i in range(live):
            account(method, chain, share.state, lanes, i)
        # From the last, so that every lane behind one that leaves is still under way, and may take its place.
        for i in range(live - 1, -1, -1):
            phase = _next_phase(kind, method, chain, gravity, share.state, lanes, i)
            if phase != phase_of(kind):
                _retire(kind, method, chain, share, lanes, i, phase)
                following, stop, drawn, loaded = _refill(
                    kind, method, chain, gravity, share, lanes, i, (following, stop, drawn, passes)
                )
                if not loaded:
                    live -= 1
                    lanes.move(live, i)
    # A halt may have kept it from loading more.
    return (Status.INTERRUPTED.value if passes >= share.halt[0] else Status.DONE.value), 0, drawn


@outlined
def _over(method, share, lanes, live, passes):
    """Whether the call ends before the next pass: (status, particle), a halt or one that got nowhere since a look."""
    if passes >= share.halt[0]:
        return Status.INTERRUPTED.value, 0
    if passes % LOOK != 0:
        return Status.DONE.value, 0
    for i in range(live):
        lane, p = lanes.lane(i), lanes.particle[i]
        left = lane.left
        if lane.looked_particle == float(p) and goes_on_by(method, lane.v, left) >= lane.looked_left - left:
            return Status.TIMELESS.value, p
        lane.looked_particle, lane.looked_left = float(p), left
    return Status.DONE.value, 0


def _next_phase(kind, method, chain, gravity, state, lanes, i):
    """The phase of a lane after a step."""
    phase = phase_of(kind)
    if lanes.event[i] != 0:
        phase = _decide(kind, method, chain, gravity, state, lanes, i)
    phase = phase if lanes.lane(i).left > 0.0 else ARRIVED
    return phase if lanes.period is None else return_sliding(lanes.period, chain, state, lanes, i, phase)


# --- Into lanes and out of them --------------------------------------------------------------------------


@outlined
def _refill(kind, method, chain, gravity, share, lanes, i, at):
    """The next particle that slides into lane i: (particle, stop, draws) to go on from, and whether there is one.

    None after a halt: what is loaded may rest or fly at once, one particle after the other.
    """
    following, stop, drawn, passes = at
    while True:
        if passes >= share.halt[0]:
            return following, stop, drawn, False
        following, stop, drawn = following_particle(share, phase_of(kind), following, stop, drawn)
        if following == stop:
            return following, stop, drawn, False
        following += 1
        if _load(kind, method, chain, gravity, share, lanes, i, following - 1):
            return following, stop, drawn, True


@outlined
def _load(kind, method, chain, gravity, share, lanes, i, p):
    """Particle p into lane i; whether it slides: it may also rest until the end of the frame, or fly."""
    lane, state, contacts = lanes.lane(i), share.state, share.state.contacts
    begins = not contacts.left[p] > 0.0
    left = share.span if begins else contacts.left[p]
    r, v = column(state.position, 0, p), column(state.velocity, 0, p)
    lanes.particle[i] = p
    lane.left, lane.step, lane.cut, lane.trials = left, contacts.step[p], np.inf, 0.0
    lane.first, lane.second = contacts.walls[0, p], contacts.walls[1, p]
    lane.keep, lane.twice, lane.scale2 = contacts.keep[p], 2.0 * state.energy[p], speed2_scale(state, p)
    if begins:
        held, now = lane.held(kind), at(chain, left)
        # Frames show the speed that is kept across the walls too.
        v = hold.split_at(held, now, hold.drift(wall_laws.moving(methods.laws(method)), held, now, r), r, v).along
    lane.r, lane.v = r, v
    phase = _set_going(kind, method, chain, gravity, state, lanes, i)
    if phase != phase_of(kind):
        _retire(kind, method, chain, share, lanes, i, phase)
        return False
    return True


@outlined
def _set_going(kind, method, chain, gravity, state, lanes, i):
    """The forces on a lane at the start of its next step; its phase then, which may be to rest."""
    lane, laws = lanes.lane(i), methods.laws(method)
    r, v, left = lane.r, lane.v, lane.left
    now = at(chain, left)
    if lanes.openings is not None and is_at_opening(lanes.openings, kind, method, now, state, lanes, i):
        return EVENT
    force = slides.force(laws, lane.held(kind), now, gravity, r, v)
    lane.a, lane.press, lane.press_second = force.acceleration, force.n, force.m
    if not lane.step > 0.0:
        lane.step = _FIRST * method.size / np.sqrt(lane.scale2)
    if moves(method):
        return stay(kind, method, chain, gravity, state, lanes, i)
    if square(v) == 0.0 and events.rests(gravity, force):
        p, contacts = lanes.particle[i], state.contacts
        contacts.sliding[p] += left
        contacts.phase[p], contacts.load[walls.row(chain, lane.first), p] = ARRIVED, force.n
        if lane.second >= 0.0:
            contacts.load[walls.row(chain, lane.second), p] = force.m
        push(chain, state, lanes, i, force.n * left, force.m * left)
        lane.left = 0.0
        return ARRIVED
    return phase_of(kind)


@outlined
def _retire(kind, method, chain, share, lanes, i, phase):
    """A lane back into its particle, for its next phase."""
    lane, p, contacts = lanes.lane(i), index(lanes.particle[i]), share.state.contacts
    if phase == AGAIN:
        phase = phase_of(kind)
    v, keep = lane.v, lane.keep
    slid = phase != FLYING and phase != CAREFUL
    if not (slid and lane.left > 0.0):
        v = with_kept(kind, at(chain, lane.left), lane)
    if phase == FLYING:
        now, r = at(chain, lane.left), lane.r
        u = wall_velocity(wall_laws.moving(methods.laws(method)), now, lane.first, r)
        v = events.off_the_wall(now, lane.first, r, v, u)
    put(share.state.position, 0, p, lane.r)
    put(share.state.velocity, 0, p, v)
    contacts.walls[0, p] = lane.first if slid else -1.0
    contacts.walls[1, p] = lane.second if slid else -1.0
    if phase != ARRIVED:
        contacts.phase[p] = phase if slid else FLYING
    elif contacts.phase[p] != ARRIVED:
        contacts.phase[p] = phase_of(kind)
    contacts.left[p] = lane.left if phase != ARRIVED else 0.0
    contacts.step[p] = lane.step if slid else 0.0
    contacts.keep[p] = keep
    if lanes.period is not None:
        return_particle(lanes.period, chain, share.state, p)
    share.hand_over(p, phase)


# --- Events ----------------------------------------------------------------------------------------------


@outlined
def _decide(kind, method, chain, gravity, state, lanes, i):
    """The phase of a lane whose step may not be taken as it is.

    The step is cut where the event is, and taken again, until the event is at its start.
    """
    lane, event, h = lanes.lane(i), lanes.event[i], lanes.lane(i).h
    if event & STOPPED:
        _stop(method, chain, gravity, state, lanes, i)
        return _set_going(kind, method, chain, gravity, state, lanes, i)
    if event & STUCK:
        return _give_up(state, lanes, i)
    if event & FAILED:
        return _shorten(kind, method, chain, state, lanes, i)
    held, r, v = lane.held(kind), lane.r, lane.v
    path, near = crossing.Path(r, v, lane.r1, lane.v1, h), crossing.near(method, r)
    cut = 1.0
    if event & LIFTED:
        particle = events.Particle(r, v, lane.left, lane.twice, lane.scale2)
        phase, cut = _lift(kind, lane, events.weightless(method, gravity, particle))
        if phase != phase_of(kind):
            return phase
    if event & MET:
        met = crossing.arrival(chain, 0.0, held, path, near, lane.left)
        # At once, or so soon that the time left does not change.
        if lane.left - met.time * h == lane.left:
            state.contacts.met[lanes.particle[i]] = met.wall
            lane.r = walls.settle(at(chain, lane.left), met.wall, r)
            return EVENT
        cut = min(cut, met.time)
    if event & (LEAVES | PASSES):
        cut = min(cut, part_until(lanes.period, crossing.cubic(path)))
        cut = min(cut, part_until_open(lanes.openings, method, at(chain, lane.left), held, path, near))
    if not cut < 1.0:
        # It passes near a wall.
        return _take(kind, method, chain, gravity, state, lanes, i)
    lane.cut = cut * h
    lane.trials += 1.0
    return phase_of(kind) if lane.trials <= _MOST_TRIALS else _give_up(state, lanes, i)


def _stop(method, chain, gravity, state, lanes, i):
    """Friction has stopped a lane."""
    lane, r, u, given = lanes.lane(i), lanes.lane(i).r, ZERO, 0.0
    if moves(method):
        u = walls.velocity(at(chain, lane.left), lane.first, r)
        lost, twice = square(lane.v - u) + lane.keep * lane.keep, square(u) + 2.0 * potential(gravity, r)
        given = twice - lane.twice + lost
        lane.twice = twice
    else:
        # All that is above the potential energy, down to what round-off has added to the kinetic one.
        lost = lane.twice - 2.0 * potential(gravity, r)
        lane.twice -= lost
    lane.keep = 0.0
    lose(state, lanes, i, lost)
    if moves(method):
        work(chain, state, lanes, i, given, 0.0)
    lane.v = u


def _take(kind, method, chain, gravity, state, lanes, i):
    """Take a step after all."""
    lane = lanes.lane(i)
    lane.r, lane.v, lane.left, lane.cut = lane.r1, lane.v1, lane.left - lane.h, np.inf
    lane.twice = twice_after(method, lane.twice - lane.work, lanes.after[i])
    lanes.unsolved[i] = True
    account(method, chain, state, lanes, i)
    return _set_going(kind, method, chain, gravity, state, lanes, i)


def _give_up(state, lanes, i):
    """Leave a lane to the careful way: it is at an apex, or where the walls have no edge."""
    state.contacts.met[lanes.particle[i]] = lanes.lane(i).first
    return CAREFUL


def _shorten(kind, method, chain, state, lanes, i):
    """A lane whose step has no solution: a shorter one, or none over the edge of a solid, beyond which is no wall."""
    lane, h = lanes.lane(i), lanes.lane(i).h
    lane.step, lane.cut = _RETRY * h, np.inf
    if h > SHORTEST * method.size / math.sqrt(lane.scale2):
        return phase_of(kind)
    end = lane.r + h * lane.v
    if walls.outside(at(chain, lane.left - h), -1.0, end) or not h > 0.0:
        return _give_up(state, lanes, i)
    lane.r = end
    lane.left -= h
    return FLYING


def _lift(kind, lane, none):
    """The phase of a lane that its walls let go now, or the part of the step after which they do: (phase, part)."""
    first, second = lane.press <= none, lane.press_second <= none
    part = _part(lane.press, lane.press1)
    if phase_of(kind) == HELD:
        return (FLYING, 0.0) if first else (HELD, part)
    if first and lane.press1 < 0.0:
        lane.first, lane.second = lane.second, -1.0
        return HELD, 0.0
    if second and lane.press1_second < 0.0:
        lane.second = -1.0
        return HELD, 0.0
    return phase_of(kind), min(part, _part(lane.press_second, lane.press1_second))


def _part(start, end):
    """Where a straight line from `start` falls through 0, if it does."""
    return start / (start - end) if end < 0.0 else 1.0

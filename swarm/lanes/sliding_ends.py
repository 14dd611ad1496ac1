"""The start of a step of a lane that slides, and its end where the step may not be taken as it is."""

import math

import numpy as np

from ..contact import crossing, events
from ..contact import sliding as slides
from ..contact.events import ARRIVED, CAREFUL, EVENT, FLYING, HELD
from ..contact.passing import part_until_open
from ..kernel.gravity import potential
from ..kernel.jit import outlined
from ..kernel.vector import ZERO, square
from ..surfaces import fold as walls
from ..surfaces.moving import at
from ..surfaces.period import part_until
from .escape import is_at_opening
from .sliding import FAILED, LEAVES, LIFTED, MET, PASSES, STOPPED, STUCK, account, lose, moves, phase_of, push, work
from .sliding_step import SHORTEST, twice_after
from .sticking import stay

# Times that a step is cut before the lane is given up: it takes four or so.
_MOST_TRIALS = 100
# The first step of a particle that begins to slide, in crossings; the walls correct it.
_FIRST = 1e-3
# A step that is tried again is so much shorter.
_RETRY = 0.25


@outlined
def set_going(kind, method, chain, gravity, state, lanes, i):
    """The forces on a lane at the start of its next step; its phase then, which may be to rest."""
    lane, laws = lanes.lane(i), method.laws
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
def decide(kind, method, chain, gravity, state, lanes, i):
    """The phase of a lane whose step may not be taken as it is.

    The step is cut where the event is, and taken again, until the event is at its start.
    """
    lane, event, h = lanes.lane(i), lanes.event[i], lanes.lane(i).h
    if event & STOPPED:
        _stop(method, chain, gravity, state, lanes, i)
        return set_going(kind, method, chain, gravity, state, lanes, i)
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
        met = crossing.arrival(chain, held, path, near, lane.left)
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
    return set_going(kind, method, chain, gravity, state, lanes, i)


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

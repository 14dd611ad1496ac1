"""The start of a step of a sliding lane, and its end if the step cannot be taken as it is."""

import math

import numpy as np

from ..contact import crossing, events
from ..contact.absence import ended_wall, ends_of, part_until_end, part_until_open, wall_after
from ..contact.events import ARRIVED, CAREFUL, EVENT, FLYING, HELD
from ..contact.path import StepPath, cubic
from ..kernel.gravity import potential
from ..kernel.jit import outlined
from ..kernel.vector import ZERO, square
from ..surfaces.periodic.period import part_until
from .escape import is_at_opening
from .sliding import ENDS, FAILED, LEAVES, LIFTED, MET, OPENS, STOPPED, STUCK
from .sliding_step import SHORTEST, twice_after
from .sticking import stay

# The most cuts of a step before the lane becomes CAREFUL; about four are usual.
_MOST_TRIALS = 100
# The first step of a particle that begins to slide, in crossings; the walls correct the length of the next steps.
_FIRST = 1e-3
# The factor that shortens a step that is tried again.
_RETRY = 0.25


@outlined
def set_going(slide, i):
    """Compute the forces on a lane at the start of its next step; return its phase, ARRIVED if it comes to rest."""
    walls, lanes, lane = slide.walls, slide.lanes, slide.lanes.lane(i)
    r, v, remaining = lane.r, lane.v, lane.remaining
    now = walls.at(remaining)
    if lanes.openings is not None and is_at_opening(slide, now, i):
        return EVENT
    if ends_of(walls):
        phase = _past_ends(slide, now, i)
        if phase != slide.phase():
            return phase
    force = slide.force(lane, now, r, v)
    lane.a, lane.press, lane.press_second = force.acceleration, force.n, force.m
    if not lane.step > 0.0:
        lane.step = _FIRST * slide.method.size / np.sqrt(lane.scale2)
    if slide.moves():
        return stay(slide, i)
    if square(v) == 0.0 and events.rests(slide.gravity, force):
        p, contacts = lanes.particle[i], slide.state.contacts
        slide.stay(i, remaining)
        contacts.phase[p], contacts.load[walls.row(lane.first), p] = ARRIVED, force.n
        if lane.second >= 0.0:
            contacts.load[walls.row(lane.second), p] = force.m
        slide.push(i, force.n * remaining, force.m * remaining)
        lane.remaining = 0.0
        return ARRIVED
    return slide.phase()


@outlined
def decide(slide, i):
    """Cut the step of a lane at its first event, or let the event happen at the start of the step; return the phase.

    A step that is cut is tried again, and may be cut again, until the event is at its start.
    """
    method, walls, lanes, lane = slide.method, slide.walls, slide.lanes, slide.lanes.lane(i)
    event, h = lanes.event[i], lane.h
    if event & STOPPED:
        _stop(slide, i)
        return set_going(slide, i)
    if event & STUCK:
        return _give_up(slide, i)
    if event & FAILED:
        return _shorten(slide, i)
    active, r, v = slide.active(lane), lane.r, lane.v
    if event & ENDS and ended_wall(walls.at(lane.remaining), active, r, crossing.near(method, r)) >= 0.0:
        return set_going(slide, i)
    path, near = StepPath(r, v, lane.r1, lane.v1, h), crossing.near(method, r)
    cut = 1.0
    if event & LIFTED:
        particle = events.Particle(r, v, lane.remaining, lane.twice, lane.scale2)
        phase, cut = _lift(slide.phase(), lane, events.weightless(method, slide.gravity, particle))
        if phase != slide.phase():
            return phase
    if event & MET:
        met = crossing.arrival(walls, active, path, near, lane.remaining)
        # The hit is at the start of the step, or so soon after it that the time left does not change.
        if lane.remaining - met.time * h == lane.remaining:
            slide.state.contacts.met[lanes.particle[i]] = met.wall
            lane.r = walls.at(lane.remaining).project(met.wall, r)
            return EVENT
        cut = min(cut, met.time)
    cut = min(cut, _until_gone(slide, event, active, path, lane.remaining))
    if not cut < 1.0:
        # The path passes near a wall without a hit.
        return _take(slide, i)
    lane.cut = cut * h
    lane.trials += 1.0
    return slide.phase() if lane.trials <= _MOST_TRIALS else _give_up(slide, i)


def _until_gone(slide, event, active, path, remaining):
    """Return the part of a step after which a wall ends, is open, or the lane leaves the cell; infinity for none."""
    lanes, near, found = slide.lanes, crossing.near(slide.method, path.r0), np.inf
    if event & ENDS:
        found = part_until_end(slide.walls, active, path, near, remaining)
    if event & LEAVES:
        found = min(found, part_until(lanes.period, cubic(path)))
    if event & OPENS:
        now = slide.walls.at(remaining)
        found = min(found, part_until_open(lanes.openings, slide.method, now, active, path, near))
    return found


@outlined
def _past_ends(slide, now, i):
    """Replace the walls of a lane that end at its place by the walls that follow; return its phase, FLYING for none."""
    lane, near = slide.lanes.lane(i), crossing.near(slide.method, slide.lanes.lane(i).r)
    for _wall in range(2):
        ended = ended_wall(now, slide.active(lane), lane.r, near)
        if ended < 0.0:
            break
        after = wall_after(now, ended, lane.r, near)
        if ended == lane.second:
            lane.second = after
        elif after >= 0.0:
            lane.first = after
        elif lane.second >= 0.0:
            lane.first, lane.second = lane.second, -1.0
        else:
            return FLYING
        if lane.second < 0.0:
            return HELD
    return slide.phase()


def _stop(slide, i):
    """Stop a lane by friction."""
    lane, r, u, given = slide.lanes.lane(i), slide.lanes.lane(i).r, ZERO, 0.0
    if slide.moves():
        u = slide.walls.at(lane.remaining).velocity(lane.first, r)
        lost, twice = square(lane.v - u) + lane.keep * lane.keep, square(u) + 2.0 * potential(slide.gravity, r)
        given = twice - lane.twice + lost
        lane.twice = twice
    else:
        # All energy above the potential energy is lost, including the round-off of the kinetic energy.
        lost = lane.twice - 2.0 * potential(slide.gravity, r)
        lane.twice -= lost
    lane.keep = 0.0
    slide.lose(i, lost)
    if slide.moves():
        slide.work(i, given, 0.0)
    lane.v = u


def _take(slide, i):
    """Take a step that ends without an event."""
    lanes, lane = slide.lanes, slide.lanes.lane(i)
    lane.r, lane.v, lane.remaining, lane.cut = lane.r1, lane.v1, lane.remaining - lane.h, np.inf
    lane.twice = twice_after(slide, lane.twice - lane.work, lanes.after[i])
    lanes.unsolved[i] = True
    slide.account(i)
    return set_going(slide, i)


def _give_up(slide, i):
    """Return CAREFUL for a lane that is at an apex, or at a place where its walls have no edge."""
    slide.state.contacts.met[slide.lanes.particle[i]] = slide.lanes.lane(i).first
    return CAREFUL


def _shorten(slide, i):
    """Shorten a step without a solution; if it is too short, let the lane fly off an edge, or give it up."""
    lane, h = slide.lanes.lane(i), slide.lanes.lane(i).h
    lane.step, lane.cut = _RETRY * h, np.inf
    if h > SHORTEST * slide.method.size / math.sqrt(lane.scale2):
        return slide.phase()
    end = lane.r + h * lane.v
    if slide.walls.at(lane.remaining - h).outside(-1.0, end) or not h > 0.0:
        return _give_up(slide, i)
    lane.r = end
    lane.remaining -= h
    return FLYING


def _lift(phase, lane, none):
    """Drop a wall that does not press on a lane now; return (its phase, the part of the step that the walls hold it).

    A press of at most `none` counts as 0.
    """
    first, second = lane.press <= none, lane.press_second <= none
    part = _part(lane.press, lane.press1)
    if phase == HELD:
        return (FLYING, 0.0) if first else (HELD, part)
    if first and lane.press1 < 0.0:
        lane.first, lane.second = lane.second, -1.0
        return HELD, 0.0
    if second and lane.press1_second < 0.0:
        lane.second = -1.0
        return HELD, 0.0
    return phase, min(part, _part(lane.press_second, lane.press1_second))


def _part(start, end):
    """Return the part of a step after which a linear function from `start` to `end` falls below 0; 1 for none."""
    return start / (start - end) if end < 0.0 else 1.0

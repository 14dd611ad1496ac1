"""One composed step of every sliding lane, in loops without branches, and the events at its end."""

import math

import numpy as np

from ..contact import crossing, hold
from ..contact import sliding as slides
from ..contact.absence import may_be_absent
from ..contact.path import StepPath
from ..contact.reflection import relative, wall_velocity
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import select
from ..kernel.vector import ZERO, either, square
from ..surfaces.periodic.period import is_beyond
from .sliding import ENDS, FAILED, LEAVES, LIFTED, MET, OPENS, STOPPED, STUCK

# The shortest step, as a fraction of a crossing, and the shortest way, as a fraction of the size.
SHORTEST, _NO_WAY = 1e-10, 1e-15
# Friction has stopped a particle when at most this fraction of |v|^2 is left.
SLOWEST = 1e-24


def compose(slide, live):
    """Make one composed step of every live lane, from r, v and a to r1 and v1."""
    walls, gravity, lanes = slide.walls, slide.gravity, slide.lanes
    friction, moving = slide.method.laws.friction, slide.moving()
    rubs = friction is not None
    for i in range(live):
        _start(slide, i)
    for k in range(slides.PARTS):
        for i in range(live):
            lane = lanes.lane(i)
            r, v, h = lane.r1, lane.v1, slides.part(k) * lane.h
            now = walls.at(lane.remaining - slides.before(k) * lane.h)
            last = lane.change
            change = last + slides.lead(k) * (last - lane.before)
            lane.before = last
            lane.end = r + h * (v + (0.5 * slides.part(k)) * change)
            if rubs:
                u = wall_velocity(moving, now, lane.first, r)
                # The drive of a particle that is at rest on its first wall
                drive = last - lane.h * now.acceleration(lane.first, r) if slide.moves() else last
                toward = slides.direction(friction, relative(u, v), drive)
                slowed = slides.slow(friction, slide.active(lane), now, gravity, r, (v, toward, u), 0.5 * h)
                v = slowed.v
                lane.work += slowed.lost
                lane.toward = toward
            lane.w = accelerated(gravity, v, 0.5 * h)
            lanes.unsolved[i] = True
        for _sweep in range(slides.SWEEPS):
            some = False
            for i in range(live):
                some = _sweep_lane(slide, i, k) | some
            if not some:
                break
        for i in range(live):
            lane = lanes.lane(i)
            h, w, v0, r0, active = slides.part(k) * lane.h, lane.w, lane.v1, lane.r1, slide.active(lane)
            remaining, after = _when(lane, k)
            step, end = walls.during(remaining, after), lane.end
            # The last sweep
            drift = hold.mean_drift(moving, active, step, r0, end, h)
            taken = active.split(step, drift, r0, end, w)
            r, v1 = r0 + h * taken.along, accelerated(gravity, 2.0 * taken.along - w, 0.5 * h)
            if rubs:
                now = walls.at(after)
                u = wall_velocity(moving, now, lane.first, r)
                slowed = slides.slow(friction, active, now, gravity, r, (v1, lane.toward, u), 0.5 * h)
                v1 = slowed.v
                lane.work += slowed.lost
            lane.r1, lane.v1 = r, v1
            lane.change = slides.inverse_part(k) * (v1 - v0)
            lane.impulse += 2.0 * taken.b
            lane.impulse_second += 2.0 * taken.c
            lane.given_by_second += hold.given_by_second(drift, taken)
            lanes.event[i] |= select(lanes.unsolved[i], FAILED, 0)


def _start(slide, i):
    """Set the length of the step of a lane, its allowed error, and its start."""
    lane, method = slide.lanes.lane(i), slide.method
    v, a, r = lane.v, lane.a, lane.r
    h = select(lane.step < lane.remaining, lane.step, lane.remaining)
    h = select(lane.cut < h, lane.cut, h)
    stop = _longest(slide, lane)
    h = select(stop < h, stop, h)
    # The tolerance is for a crossing at the present speed, or in the present pull along the walls.
    speed = math.sqrt(0.5 * (square(v) + math.sqrt(square(a)) * method.size))
    lane.h, lane.allowed = h, method.sliding_tolerance * speed * h
    taken = accelerated(slide.gravity, ZERO, 1.0) - a
    lane.still = slides.still(r, v, h * taken, lane.allowed)
    lane.r1, lane.v1, lane.change, lane.before = r, v, h * a, h * a
    lane.impulse, lane.impulse_second, lane.work, lane.given_by_second = 0.0, 0.0, 0.0, 0.0
    slide.lanes.event[i] = 0


def _longest(slide, lane):
    """Return a time within which a lane that slides with friction surely does not stop on its first wall."""
    now, r, v, a = slide.walls.at(lane.remaining), lane.r, lane.v, lane.a
    if slide.moves():
        v, a = v - now.velocity(lane.first, r), a - now.acceleration(lane.first, r)
    return slides.longest(slide.method.laws.friction, v, a)


def _when(lane, k):
    """Return the time left of the frame at the start and at the end of part k."""
    remaining, h = lane.remaining, lane.h
    return remaining - slides.before(k) * h, remaining - (slides.before(k) + slides.part(k)) * h


def _sweep_lane(slide, i, k):
    """Make one sweep of a lane that still moves; return whether it needs another."""
    lane, unsolved = slide.lanes.lane(i), slide.lanes.unsolved
    end, step, h = lane.end, slide.walls.during(*_when(lane, k)), slides.part(k) * lane.h
    swept = slides.sweep(slide.moving(), slide.active(lane), step, h, (lane.r1, end, lane.w), lane.still)
    on = unsolved[i]
    lane.end = either(on, swept.r, end)
    more = on & swept.moves
    unsolved[i] = more
    return more


# --- Its end ---------------------------------------------------------------------------------------------


def end_steps(slide, live):
    """Take the steps that are exact enough and end without an event; lengthen or shorten the next steps."""
    for i in range(live):
        _end_step(slide, i)


def _end_step(slide, i):
    method, walls, gravity, lanes, lane = slide.method, slide.walls, slide.gravity, slide.lanes, slide.lanes.lane(i)
    moving, active = slide.moving(), slide.active(lane)
    start, now = walls.at(lane.remaining), walls.at(lane.remaining - lane.h)
    h, scale2, keep = lane.h, lane.scale2, lane.keep
    r0, v0, a0 = lane.r, lane.v, lane.a
    r1 = active.project(now, lane.r1)
    v1 = active.split_at(now, hold.drift(moving, active, now, r1), r1, lane.v1).along
    rest = 2.0 * potential(gravity, r1) + keep * keep
    twice = twice_after(slide, lane.twice - lane.work, square(v1) + rest)
    if not slide.moves():
        # Walls at rest leave the speed that follows from the energy.
        v1 = slides.restored(v1, twice - rest, scale2)
    force = slide.force(lane, now, r1, v1)
    ratio = slides.error(h, (r0, v0, a0), (r1, v1, force.acceleration), lane.allowed)
    path = StepPath(r0, v0, r1, v1, h)
    lifted = active.lets_go(force.n, force.m)
    met = crossing.meets(start, now, active, path, crossing.near(method, r1))
    good = (ratio <= 1.0) & (lanes.event[i] == 0)
    leaves = is_beyond(lanes.period, r1)
    ends, opens = may_be_absent(lanes.openings, now, active, path, crossing.near(method, r1))
    fine = good & (not lifted) & (not met) & (not leaves) & (not ends) & (not opens)
    happened = select(lifted, LIFTED, 0) | select(met, MET, 0) | select(leaves, LEAVES, 0)
    happened |= select(ends, ENDS, 0) | select(opens, OPENS, 0)
    lanes.event[i] |= select(good, happened, 0)
    lanes.unsolved[i] = fine
    # A step cut by the end of the frame or an event gives no length; a step that is to be cut must be the same again
    # after a halt.
    whole = (fine & (h == lane.step)) | (not (ratio <= 1.0))
    lane.step = select(whole, slides.next_step(h, ratio), lane.step)
    lane.cut = select(fine, np.inf, lane.cut)
    lane.remaining -= select(fine, h, 0.0)
    lanes.gained[i], lanes.after[i] = twice + lane.work - lane.twice, twice
    lane.twice = select(fine, twice, lane.twice)
    lane.r1, lane.v1, lane.press1, lane.press1_second = r1, v1, force.n, force.m
    lane.r, lane.v, lane.a = either(fine, r1, r0), either(fine, v1, v0), either(fine, force.acceleration, a0)
    lane.press = select(fine, force.n, lane.press)
    lane.press_second = select(fine, force.m, lane.press_second)
    if method.laws.friction is not None:
        slip = relative(wall_velocity(moving, now, lane.first, r1), v1)
        lanes.event[i] |= select(fine & (square(slip) <= SLOWEST * scale2), STOPPED, 0)
    # Near an apex steps become shorter without end, in time or, for a slow particle, in length.
    step = lane.step
    way2 = step * step * (square(v1) + step * step * square(accelerated(gravity, ZERO, 1.0)))
    short = (step < SHORTEST * method.size / math.sqrt(scale2)) | (way2 < (_NO_WAY * method.size) ** 2)
    lanes.event[i] |= select(short, STUCK, 0)


def twice_after(slide, kept, now):
    """Return twice the energy per mass after a step: `kept` if walls do no work, else `now`."""
    return now if slide.moves() else kept

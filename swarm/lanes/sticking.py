"""Particles at rest on moving walls: each moves with its wall while friction, or a balance of forces, holds it.

Before that ends another wall may come and strike it.
"""

from ..contact import crossing, hold
from ..contact.events import ARRIVED, EVENT
from ..contact.path import StepPath
from ..contact.projection import ALLOWED
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import outlined
from ..kernel.record import Record
from ..kernel.vector import ZERO, norm, square
from .sliding import AGAIN
from .sliding_step import SLOWEST

# Halvings of the interval in which a wall lets go of a particle at rest.
_HALVINGS = 60
# The most paces at a time before the lane is checked again: a frame may have millions, and halts count between them.
# (Rejected: a halt in any of them. Motion with a wall in two parts is rounded twice.)
_MOST_PACES = 128.0
# Steps in the search for another wall that comes. A wall that is not found after this number is too near to be
# resolved; after this number in all paces the lane is also checked again.
_MOST_STEPS = 1e4


class Clear(Record):
    """The time until which no other wall is met, the wall that is met then, or -1, and the steps of the search."""

    time: float
    wall: float
    steps: float


@outlined
def stay(slide, i):
    """Move a lane with its walls while friction, or a balance of forces, holds it there; return its phase."""
    walls, lanes, contacts, lane = slide.walls, slide.lanes, slide.state.contacts, slide.lanes.lane(i)
    remaining, first = lane.remaining, lane.first
    now = walls.at(remaining)
    u, slowest = now.velocity(first, lane.r), SLOWEST * lane.scale2
    moves_on = square(lane.v - u) > slowest or _rubs(slide, now, lane, slowest)
    if moves_on or not _rests(slide, now, lane, lane.r):
        return slide.phase()
    pace, low, high, met, paces, steps = now.shortest_time_scale(), 0.0, 0.0, -1.0, 0.0, 0.0
    pressed, pressed_second = 0.0, 0.0
    while low < remaining and met < 0.0 and paces < _MOST_PACES and steps < _MOST_STEPS:
        step = min(pace, remaining - low)
        clear = _clear(slide, lane, low, remaining if low + step >= remaining else low + step)
        high = clear.time
        middle = 0.5 * (low + high)
        if not (_rests_later(slide, lane, middle) and _rests_later(slide, lane, high)):
            break
        # Simpson's rule for the impulses
        one, two, three = tuple(_press_later(slide, lane, t) for t in (low, middle, high))
        pressed += (one.n + 4.0 * two.n + three.n) * ((high - low) / 6.0)
        pressed_second += (one.m + 4.0 * two.m + three.m) * ((high - low) / 6.0)
        low, met, paces, steps = high, clear.wall, paces + 1.0, steps + clear.steps
    end, start, goes_on = low, low, met < 0.0 and (paces == _MOST_PACES or not steps < _MOST_STEPS)
    if low < remaining and met < 0.0 and not goes_on:
        for _k in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if _rests_later(slide, lane, middle):
                low = middle
            else:
                high = middle
        end = high
        one, two = _press_later(slide, lane, start), _press_later(slide, lane, low)
        pressed += 0.5 * (one.n + two.n) * (end - start)
        pressed_second += 0.5 * (one.m + two.m) * (end - start)
    after = remaining - end
    r1, then = _carried(walls, lane, end), walls.at(after)
    v1 = then.velocity(first, r1)
    twice = square(v1) + 2.0 * potential(slide.gravity, r1)
    given = twice - lane.twice
    lane.r, lane.v, lane.remaining, lane.twice, lane.keep = r1, v1, after, twice, 0.0
    slide.push(i, pressed, pressed_second)
    slide.work(i, given, 0.0)
    slide.stay(i, end)
    if goes_on or not after > 0.0:
        return AGAIN if after > 0.0 else ARRIVED
    if met >= 0.0:
        contacts.met[lanes.particle[i]] = met
        lane.r = then.project(met, r1)
        return EVENT
    force = slide.force(lane, then, r1, v1)
    lane.a, lane.press, lane.press_second = force.acceleration, force.n, force.m
    return slide.phase()


def _rubs(slide, now, lane, slowest):
    """Whether the second wall has friction and slips on a lane that moves with the first one."""
    if not isinstance(slide.kind, hold.Two):
        return False
    slip = lane.v - now.velocity(lane.second, lane.r)
    friction = slide.method.laws.friction_of(lane.second)
    return friction > 0.0 and square(slip) > slowest


@outlined
def _clear(slide, lane, low, high):
    """Return the `Clear` of a lane that moves with its first wall, from one time to another."""
    walls, remaining, active = slide.walls, lane.remaining, slide.active(lane)
    near = crossing.near(slide.method, lane.r)
    time, step, met, steps = low, high - low, -1.0, 0.0
    while steps < _MOST_STEPS:
        steps += 1.0
        end = high if time + step >= high else time + step
        start, then, path = walls.at(remaining - time), walls.at(remaining - end), _way(walls, lane, time, end)
        if not crossing.meets(start, then, active, path, near):
            if end == high:
                return Clear(high, -1.0, steps)
            time, step = end, 2.0 * step
            continue
        found = crossing.arrival(walls, active, path, near, remaining - time)
        met = found.wall
        if found.time == 0.0 or not remaining - end < remaining - time:
            break
        step = (end - time) * min(found.time, 0.5)
    # A path on which no wall is found, however short, is clear of walls.
    return Clear(time, met, steps) if met >= 0.0 else Clear(high, -1.0, steps)


@outlined
def _carried(walls, lane, t):
    """Return the place of a lane after a time t in which it moves with its first wall."""
    return walls.during(lane.remaining, lane.remaining - t).carry(lane.first, lane.r)


@outlined
def _way(walls, lane, start, end):
    """Return the path of a lane that moves with its first wall, from one time to another."""
    r0, r1 = _carried(walls, lane, start), _carried(walls, lane, end)
    v0 = walls.at(lane.remaining - start).velocity(lane.first, r0)
    v1 = walls.at(lane.remaining - end).velocity(lane.first, r1)
    return StepPath(r0, v0, r1, v1, end - start)


@outlined
def _rests(slide, now, lane, r):
    """Whether a lane that moves with its first wall continues to do so from here."""
    force, acceleration = _force_at_rest(slide, now, lane, r), now.acceleration(lane.first, r)
    pull = norm(accelerated(slide.gravity, ZERO, 1.0)) + norm(acceleration)
    pressed = not slide.kind.lets_go(force.n, force.m)
    return pressed and pull > 0.0 and norm(force.acceleration - acceleration) <= ALLOWED * pull


@outlined
def _force_at_rest(slide, now, lane, r):
    """Return the force on a lane at r that moves with its first wall."""
    return slide.force(lane, now, r, now.velocity(lane.first, r))


def _rests_later(slide, lane, t):
    return _rests(slide, slide.walls.at(lane.remaining - t), lane, _carried(slide.walls, lane, t))


def _press_later(slide, lane, t):
    return _force_at_rest(slide, slide.walls.at(lane.remaining - t), lane, _carried(slide.walls, lane, t))

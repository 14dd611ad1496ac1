"""The first hit of a flight by safe steps: in each the flight surely meets nothing, so no root is skipped.

A *look* at a flight gives the next safe step. In this file it follows from `hessian_bounds`, by the root of a parabola
above the level. Sampled surfaces, surfaces by functions and walls in motion have other kinds of looks.
"""

import math
from typing import Any

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import Vec, absolute, dot, norm, square, total
from .course import rise_time

# The most looks at one flight; near the wall each one doubles the digits. A hit that is not found by then is searched
# in the next pass. The frame may end before a fall meets the wall, so a fall has fewer looks with `hessian_bounds`.
LOOKS, FALLING_LOOKS = 200, 16
# The most bisections of an interval, down to neighbouring floats.
_BISECTIONS = 1100


# --- Any flight ------------------------------------------------------------------------------------------


class SafeStep(Record):
    """One look at a flight: it surely meets nothing for `time` from `since` on; infinite if it never does."""

    since: Any
    time: Any
    wall: Any = 0.0  # the wall that the flight is at after that time, or -1
    past: Any = -1.0  # a wall that it has passed at `since`, by more than round-off, or -1


class Search(Record):
    """A flight to search; a flight to a single wall has the fields `surface`, r, v and `pull`."""

    start, longest, looks = 0.0, math.inf, LOOKS

    def look(self, t, is_first):
        """The `SafeStep` at a time; at the first, the sign of the approach decides whether it meets a wall at once."""
        raise NotImplementedError

    def past(self: Any, t):
        """Return a wall that the flight has passed at a time, or -1."""
        surface = self.surface
        level = surface.level_of(surface.inner(self.r + t * (self.v + (0.5 * t) * self.pull)))
        return select(level > 0.0, 0.0, -1.0)


class ToWall(Search):
    """A flight to one wall, with the looks of that wall."""

    surface: Any
    r: Vec
    v: Vec
    pull: Vec
    looks: int

    def look(self, t, is_first):
        return self.surface.look(self.r, self.v, self.pull, t, is_first)


def first_met(flight):
    """Return (time, wall) of the first hit of a flight; the wall is -1 if it surely meets none until then."""
    t, before = flight.start, flight.start
    for i in range(flight.looks):
        look = flight.look(t, i == 0)
        if look.past >= 0.0:
            return bisected(flight, before, look.since, look.past)
        goes_on = look.time < flight.longest - look.since
        before, t = look.since, look.since + look.time
        if look.wall >= 0.0:
            return t, look.wall
        if not goes_on:
            # That the flight never meets a wall is final, as a hit would be.
            return flight.longest, select(flight.longest < math.inf, -1.0, 0.0)
    return t, -1.0


def bisected(flight, low, high, wall):
    """Return (the last time between two at which a flight has passed no wall, the wall that it passes then)."""
    for _i in range(_BISECTIONS):
        t = 0.5 * (low + high)
        if not low < t < high:
            break
        past = flight.past(t)
        if past >= 0.0:
            high, wall = t, past
        else:
            low = t
    return low, wall


# --- To a wall with `hessian_bounds` ---------------------------------------------------------------------


@outlined
def march(surface, r, v, pull):
    """Return `first_hit` of a single wall."""
    straight = pull.x == 0.0 and pull.y == 0.0 and pull.z == 0.0
    time, wall = first_met(ToWall(surface, r, v, pull, LOOKS if straight else surface.falling_looks))
    return time, wall >= 0.0


def safe_time_by_steps(surface, r, v, pull):
    """Return a time during which the flight surely stays admissible."""
    level, _half, step, _way, _steepness = safe_step(surface, r, v, pull, 0.0)
    return select(level > 0.0, 0.0, step)


def look(surface, r, v, pull, t, is_first):
    """Return the `SafeStep` at a wall."""
    p, w = r + t * (v + (0.5 * t) * pull), v + t * pull
    level, half, step, way, steepness = safe_step(surface, p, w, pull, 0.0)
    # The flight is past the wall by round-off, or because the surface bends more than its bounds allow.
    is_past = level > 0.0 and half > 0.0 and not is_first
    room = 2.0 * EPSILON * total(absolute(p))
    slack = room * steepness
    if not is_past and lets_go(level, half, step, slack):
        _level, _half, step, _way, _steepness = safe_step(surface, p, w, pull, slack)
        return SafeStep(t, step, -1.0, -1.0)
    straight = pull.x == 0.0 and pull.y == 0.0 and pull.z == 0.0
    if not is_past and straight and surface.passed(p, w):
        return SafeStep(t, math.inf, -1.0, -1.0)
    arrives = (not is_first or step == 0.0) and way <= room
    return SafeStep(t, step, select(arrives, 0.0, -1.0), select(is_past, 0.0, -1.0))


def lets_go(level, half, step, slack):
    """Whether a flight leaves a wall so slowly that round-off decides its safe step; `slack` is the level's round-off.

    A particle that slides leaves the wall where that bends neither towards it nor away, and flies along it. The bound
    of the curvature is above 0 there, so the step ends where the particle might be back, after 1e-16 of the way, and
    so do all later ones: the time does not change, or the rounded places drift through the wall. As
    round-off does not distinguish such a place from one on the wall, the step may end that deep outside.
    """
    return (half < 0.0) & (level >= -slack) & (-half * step <= slack)


@outlined
def safe_step(surface, r, v, pull, slack):
    """Return (level, half its derivative, a time during which the flight stays admissible, its way at most, |grad q|).

    With a `slack` the level counts as this far below 0.
    """
    n, level, most, magnitude, reach, clear = surface.bent(r)
    side = surface.side
    level = select(slack > 0.0, min(level, -slack), level)
    half = 0.5 * side * dot(n, v)
    speed2 = square(v)
    speed, g = math.sqrt(speed2), norm(pull)
    # level'' = 2 side (w.H w) + side grad q.G <= 2 M, where |w|^2 <= |v|^2 + 2 |G| s and grad q changes by 2 H s at
    # most on the way s: M = m0 + m1 s
    if g == 0.0:
        m0, m1 = most * speed2, 0.0
    else:
        most = max(most, 0.0)
        m0 = most * speed2 + 0.5 * side * dot(n, pull)
        m1 = (2.0 * most + magnitude) * g
    # The root of the parabola above the level, within the time in which its bound holds
    bound = m0 + select(m1 > 0.0, m1 * reach, 0.0)
    step = min(rise_time(level, half, bound), time_to_travel(speed, g, reach))
    if m1 > 0.0 and (step > 0.0 or m0 < 0.0):
        # Again with the M of a shorter way: twice that step, or as far as a fall off the wall surely bends away.
        shorter = min(reach, max(2.0 * travelled(speed, g, step), -0.5 * m0 / m1))
        step = max(step, min(rise_time(level, half, m0 + m1 * shorter), time_to_travel(speed, g, shorter)))
    if clear > 0.0:
        step = max(step, time_to_travel(speed, g, clear))
    return level, half, step, travelled(speed, g, step), norm(n)


def time_to_travel(speed, g, way):
    """Return the time t with speed t + g t^2/2 = way."""
    twice = speed + (speed if g == 0.0 else math.sqrt(speed * speed + 2.0 * g * way))
    return 2.0 * way / twice if twice > 0.0 else math.inf


def travelled(speed, g, t):
    """Return the longest way of a flight in a time."""
    return (speed + 0.5 * g * t) * t

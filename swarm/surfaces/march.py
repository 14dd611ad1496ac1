"""The first hit of a flight by safe steps, and a time during which it surely hits nothing, from `hessian_bounds`.

A safe step ends where a parabola above the level rises through 0, so no root is skipped.
"""

import math

from ..kernel.jit import outlined, select
from ..kernel.vector import absolute, dot, norm, square, total
from .course import rise_time

_EPSILON = 2.220446049250313e-16
# Steps of one march to the first hit; near the wall each one doubles the digits. What is not found by then goes on in
# the next pass. A fall may end before it meets the wall, which the march does not know: it looks less far ahead.
_MARCH = 200
_FALLING_MARCH = 16
# Bisections of an interval down to neighbouring numbers.
_BISECTIONS = 1100


def safe_time(surface, r, v, pull):
    """A time during which the flight surely stays admissible."""
    level, _half, step, _way, _steepness = _safe_step(surface, r, v, pull, 0.0)
    return select(level > 0.0, 0.0, step)


@outlined
def march(surface, r, v, pull):
    """Safe steps to the first root of the level along the flight."""
    straight = pull.x == 0.0 and pull.y == 0.0 and pull.z == 0.0
    t, before = 0.0, 0.0
    for i in range(_MARCH if straight else _FALLING_MARCH):
        p, w = r + t * (v + (0.5 * t) * pull), v + t * pull
        level, half, step, way, steepness = _safe_step(surface, p, w, pull, 0.0)
        if level > 0.0 and half > 0.0 and i > 0:
            # Past the wall by round-off, or because the surface bends more than its file says.
            return bisected(surface, r, v, pull, before, t), True
        room = 2.0 * _EPSILON * total(absolute(p))
        slack = room * steepness
        if lets_go(level, half, step, slack):
            _level, _half, step, _way, _steepness = _safe_step(surface, p, w, pull, slack)
            before, t = t, t + step
            continue
        if not step < math.inf or (straight and surface.passed(p, w)):
            return math.inf, True
        before, t = t, t + step
        # At t = 0 the sign of the approach decides, which rise_time has seen to.
        if (i > 0 or step == 0.0) and way <= room:
            return t, True
    return t, False


@outlined
def bisected(surface, r, v, pull, low, high):
    """The last time between two at which the level is not above 0."""
    for _i in range(_BISECTIONS):
        t = 0.5 * (low + high)
        if not low < t < high:
            break
        if surface.level_of(surface.inner(r + t * (v + (0.5 * t) * pull))) > 0.0:
            high = t
        else:
            low = t
    return low


def lets_go(level, half, step, slack):
    """Whether a flight leaves a wall so slowly that its safe step is a matter of round-off; `slack` is that of a level.

    A particle that slides lets go where the wall bends neither to it nor away, and flies on along it. A bound of the
    bend is above 0 there: the step ends where the particle may be back, after 1e-16 of what the bend takes, and the
    next one too, without end; the time does not change, or the places that these steps are rounded to drift through the
    wall. By its last digits a place is not told from one on the wall: the step may end as deep outside as that.
    """
    return (half < 0.0) & (level >= -slack) & (-half * step <= slack)


@outlined
def _safe_step(surface, r, v, pull, slack):
    """(level, half its derivative, a time during which the flight stays admissible, how far it goes at most, |grad q|).

    With a slack the level counts as so much below 0.
    """
    n = surface.inner_gradient(r)
    side, level = surface.side, surface.level_of(surface.inner(r))
    level = select(slack > 0.0, min(level, -slack), level)
    half = 0.5 * side * dot(n, v)
    most, magnitude, reach = surface.hessian_bounds(r)
    speed2 = square(v)
    speed, g = math.sqrt(speed2), norm(pull)
    # level'' = 2 side (w.H w) + side grad q.G <= 2 M, where |w|^2 <= |v|^2 + 2 |G| s and grad q turns by 2 H s at most
    # on the way s: M = m0 + m1 s
    if g == 0.0:
        m0, m1 = most * speed2, 0.0
    else:
        most = max(most, 0.0)
        m0 = most * speed2 + 0.5 * side * dot(n, pull)
        m1 = (2.0 * most + magnitude) * g
    step = _step_within(level, half, m0 + select(m1 > 0.0, m1 * reach, 0.0), _time_to_travel(speed, g, reach))
    if m1 > 0.0 and (step > 0.0 or m0 < 0.0):
        # Again with the M of a shorter way: of twice that step, or as far as a fall off the wall surely bends away.
        shorter = min(reach, max(2.0 * _travelled(speed, g, step), -0.5 * m0 / m1))
        within = _step_within(level, half, m0 + select(m1 > 0.0, m1 * shorter, 0.0), _time_to_travel(speed, g, shorter))
        step = max(step, within)
    clear = surface.clearance(r)
    if clear > 0.0:
        step = max(step, _time_to_travel(speed, g, clear))
    return level, half, step, _travelled(speed, g, step), norm(n)


def _step_within(level, half, bound, longest):
    """The root of the parabola above the level, within the time in which its bound holds."""
    return min(rise_time(level, half, bound), longest)


def _time_to_travel(speed, g, way):
    """The time t with speed t + g t^2/2 = way."""
    twice = speed + (speed if g == 0.0 else math.sqrt(speed * speed + 2.0 * g * way))
    return 2.0 * way / twice if twice > 0.0 else math.inf


def _travelled(speed, g, t):
    return (speed + 0.5 * g * t) * t

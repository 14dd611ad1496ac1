"""The time of impact of a ball on a wall of a smooth phi: Newton's method for time and foot at once, and its proof.

With f and m as in by_foot.py, a place p bounds f around it: f(p + s) <= f(p) + grad f.s + m |s|^2. So a ball of
radius R around p + w contains no point of the wall if
    f + grad f.w + m |w|^2 + R sqrt(|grad f|^2 - 4 m f) - m R^2 <= 0.
The centres for which this holds fill a ball for m > 0, and a half-space for m = 0. A flight is in it until the root of
a parabola or, in a fall, of a quartic. The bound of the place of the impact reaches up to the impact.

Newton's method may begin anywhere and may find any impact. This impact is the first one if a chain of places bounds
the flight up to it. If the chain ends before it, as where a flight grazes, safe steps follow (march.py).
"""

import math
from typing import Any

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON, TINY
from ...kernel.record import Record
from ...kernel.vector import Symmetric, Vec, absolute, dot, norm, square, total
from ..curvature import applied, inverse
from ..time_of_impact import march
from ..time_of_impact.course import Fall, Quartic, close, first_rise, rise_time

# The most places of a chain, Newton's steps, and the last step as a part of the radius: each doubles the digits.
_PLACES, _SWEEPS, _LAST = 24, 8, 1e-8
# How far behind the bound an impact may be, in roundings of the place, and still be the impact at the bound.
_SAME = 16.0 * EPSILON
# The least sine of the angle of an impact: at a smaller one its time has few digits.
_STEEP = 1e-4
# Newton's method begins again where the bound ends within this many radii.
_CLOSE = 0.1


class Sure(Record):
    """The bound by a place: f, its gradient n, and sqrt(|n|^2 - 4 m f)."""

    place: Vec
    f: Any
    n: Vec
    root: Any


class TouchOfWall(Record):
    """An impact: its time, the bound by its foot, and the speed along the normal, which is 0 if none was found."""

    time: Any
    foot: Sure
    speed: Any


@outlined
def first_impact(wall, r, v, pull):
    """`first_hit` of a ball, in a straight flight or a fall."""
    t, found = 0.0, TouchOfWall(0.0, Sure(r, 0.0, v, 0.0), 0.0)
    for _place in range(_PLACES):
        y, w = r + t * (v + (0.5 * t) * pull), v + t * pull
        speed, g = norm(w), norm(pull)
        if g == 0.0 and wall.passed(y, w):
            return math.inf, True
        sure, free = _here(wall, y, w, pull)
        if free == math.inf:
            return free, True
        if found.speed == 0.0 or march.travelled(speed, g, free) <= _CLOSE * wall.radius:
            after = y + free * (w + (0.5 * free) * pull)
            found = _impact(wall, (r, v, pull), t + free, _touched(wall, sure, after))
        if found.speed > 0.0:
            until = _free(wall, found.foot, y, w, pull)
            # At most as deep as round-off of the place
            same = _SAME * total(absolute(y) + absolute(found.foot.place)) / found.speed
            if t <= found.time <= t + until + same:
                return found.time, True
            free = max(free, until)
        if not t + free > t:
            break
        t += free
    rest, meets = march.march(wall, r + t * (v + (0.5 * t) * pull), v + t * pull, pull)
    return t + rest, meets


def _here(wall, y, v, pull):
    """Return the bound at a place of a flight, near a wall that of its foot; and how long it keeps the flight free."""
    p = wall.within(y)
    sure, near = _sure(wall, p), norm(y - p)
    if wall.known < math.inf:
        near, _n = wall.at_least(y)
    speed, g = norm(v), norm(pull)
    free = march.time_to_travel(speed, g, max(near - wall.radius, 0.0))
    if wall.known == math.inf:
        free = max(free, _free(wall, sure, y, v, pull))
    if march.travelled(speed, g, free) <= wall.radius:
        sure = _sure(wall, wall.foot(y).place)
        free = max(free, _free(wall, sure, y, v, pull))
    return sure, free


def _sure(wall, p):
    """Return the bound by a place."""
    f, n = wall.side_of_body() * wall.body.phi(p), wall.side_of_body() * wall.body.gradient(p)
    left = square(n) - 4.0 * wall.most * f
    return Sure(p, f, n, math.sqrt(select(left > 0.0, left, 0.0)))


@outlined
def _free(wall, sure, y, v, pull):
    """Return how long a ball at y meets no wall, by the bound of a place; 0 where the bound does not cover y."""
    m, w, size = wall.most, y - sure.place, norm(sure.n)
    c = sure.f + dot(sure.n + m * w, w) + wall.radius * (sure.root - m * wall.radius)
    if 2.0 * m * wall.radius > sure.root or c > _SAME * size * total(absolute(y) + absolute(sure.place)):
        return 0.0
    steep, pull2 = sure.n + (2.0 * m) * w, square(pull)
    b, a2 = 0.5 * dot(steep, v), m * square(v)
    if pull2 == 0.0:
        time = rise_time(c, b, a2)
    else:
        # The time to cross the ball of centres
        across = abs(sure.root / (2.0 * m)) if m != 0.0 else 0.0
        window = 2.0 * across / math.sqrt(square(v) + across * math.sqrt(pull2)) if m != 0.0 else math.inf
        level = Quartic(c, b, a2 + 0.5 * dot(steep, pull), m * dot(v, pull), 0.25 * m * pull2, window)
        time, _rises = first_rise(Fall(level, close(window), False))
    if wall.known < math.inf:
        # From a place on the wall the bound holds for ways up to this length.
        reach = max(4.0 * wall.known - wall.radius - norm(w), 0.0)
        time = min(time, march.time_to_travel(norm(v), math.sqrt(pull2), reach))
    return time


def _touched(wall, sure, y):
    """Return where a ball at y touches the edge of the bound by a place."""
    u = sure.n + (2.0 * wall.most) * (y - sure.place)
    size = norm(u)
    return y + (wall.radius / select(size > TINY, size, 1.0)) * u


@outlined
def _impact(wall, flight, t, z):
    """A `TouchOfWall` near a time and a place: f(z) = 0, z - k grad f(z) = y(t), k |grad f(z)| = R by Newton's method.

    With the last two, grad f.(z - y) = f + R |grad f| to first order, which is an equation for the time alone.
    """
    (r, v, pull), body, side, radius = flight, wall.body, wall.side_of_body(), wall.radius
    z = wall.within(z)
    f, n = side * body.phi(z), side * body.gradient(z)
    size = norm(n)
    share, time, speed = radius / select(size > TINY, size, 1.0), t, 0.0
    for _sweep in range(_SWEEPS):
        y, w = r + time * (v + (0.5 * time) * pull), v + time * pull
        rate, d = dot(n, w), z - y
        if not rate > _STEEP * size * norm(w):
            break
        a = inverse(matrix(wall, z, share))
        u, q = applied(a, d - share * n), applied(a, n)
        later, bottom = (dot(n, d) - f - radius * size) / rate, dot(n, q)
        more = (dot(n, u) - f - later * dot(q, w)) / select(abs(bottom) > TINY, bottom, 1.0)
        step = more * q - u + later * applied(a, w)
        time, share = time + later, share + more
        z = z + step
        is_last = norm(step) <= _LAST * radius and abs(later) * norm(w) <= _LAST * radius
        f, n = side * body.phi(z), side * body.gradient(z)
        size = norm(n)
        if is_last:
            # The rest of the time is of the order of the square of the last step.
            w = v + time * pull
            rate, d = dot(n, w), z - (r + time * (v + (0.5 * time) * pull))
            if rate > _STEEP * size * norm(w) and wall.holds(z):
                time, speed = time + (dot(n, d) - f - radius * size) / rate, rate / size
            break
    left = size * size - 4.0 * wall.most * f
    return TouchOfWall(max(time, 0.0), Sure(z, f, n, math.sqrt(select(left > 0.0, left, 0.0))), speed)


def matrix(wall, z, share):
    """I - k grad grad f"""
    h, k = wall.body.hessian(z), -2.0 * share * wall.side_of_body()
    return Symmetric(1.0 + k * h.xx, 1.0 + k * h.yy, 1.0 + k * h.zz, k * h.xy, k * h.yz, k * h.zx)

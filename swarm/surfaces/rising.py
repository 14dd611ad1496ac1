"""Until when the level of a wall that moves surely stays below 0: safe steps of one wall.

In the frame of a wall the flight is a curve whose velocity w, acceleration a and jerk j have bounds W, A and J for any
time ahead. Along it the level f of a wall with the inner function q, whose H = grad grad q/2 has eigenvalues of at most
the magnitude m, has
    f' = grad q.w,   f''/2 = w.H w + grad q.a/2,   |f'''| <= 6 m W A + |grad q| J,
the last where H is constant. A step ends where the parabola above f rises through 0; near the hit each one triples the
digits, or doubles them where only f'' has a bound.
"""

import math
from typing import Any

from ..kernel.jit import select
from ..kernel.record import Record
from ..kernel.vector import absolute, dot, norm, square, times, total
from .course import rise_time
from .levels import Between, Level
from .relative import Bounds, Seen
from .rotation import Rotated
from .shapes.plane import PlaneNumbers
from .shapes.quadratic import QuadricNumbers, form
from .shapes.slab import SlabNumbers, along, scaled
from .shapes.solid import SolidNumbers, noise
from .shapes.sphere import SphereNumbers

# The bounds of a step hold for at most so many times its length, after so many trials.
_CLOSE, _TRIALS = 2.0, 8


class Step(Record):
    """The level, half its derivative, and a time during which the flight stays admissible."""

    level: float
    half: float
    time: float


class Ahead(Record):
    """A level along a flight, and what bounds it for some time ahead."""

    def rise(self, within):
        """When it rises through 0, with bounds that hold for so long."""
        raise NotImplementedError

    def longest(self, longest):
        """The longest time, of at most this one, in which the level surely does not rise."""
        time, within, too_long = 0.0, longest, longest
        for _k in range(_TRIALS):
            time = max(time, min(self.rise(within), within))
            # The bounds grow with the time that they hold for: those of a long time say little of a short step.
            too_long = select(time < within, within, too_long)
            if not _CLOSE * time < too_long:
                break
            within = math.sqrt(time * too_long)
        return time


class Bent(Ahead):
    """Of a level whose second derivative has a bound."""

    seen: Seen
    level: float
    half: float
    steepness: float
    most: float
    magnitude: float
    reach: float
    clear: float

    def rise(self, within):
        bounds = self.seen.bounds(within)
        speed = bounds.speed
        # f''/2 <= w.H w + |grad q| A/2, where grad q turns by 2 m W t at most
        bend = max(self.most, 0.0) * speed * speed
        bend += 0.5 * bounds.acceleration * (self.steepness + 2.0 * self.magnitude * speed * within)
        some = select(speed > 0.0, speed, 1.0)
        step = min(rise_time(self.level, self.half, bend), select(speed > 0.0, self.reach / some, math.inf))
        return max(step, self.clear / some)


class Known(Ahead):
    """Of a level whose third derivative has one."""

    body: Any
    seen: Seen
    level: Any  # `Level` or `Between`

    def third(self, within):
        """The bound of f''' within that time."""
        return self.level.third(bounds_on(self.body, self.seen, within), within)

    def rise(self, within):
        here = self.level
        return rise_time(here.c, here.b, here.a2 + self.third(within) * within * (1.0 / 6.0))


# --- A safe step of one wall -----------------------------------------------------------------------------

# Bodies whose levels are known.
_LEVELED = PlaneNumbers, SphereNumbers, QuadricNumbers


def needs_bend(body):
    """Whether safe steps to a body need its `bend`."""
    return not isinstance(body, (*_LEVELED, SlabNumbers, SolidNumbers))


def safe_step(body, seen, longest):
    """The `Step` of a wall, whose time is at most the longest."""
    if isinstance(body, Rotated):
        return safe_step(body.body, _turned(body, seen), longest)
    if isinstance(body, SolidNumbers):
        return _entry_step(body, seen, longest)
    if isinstance(body, SlabNumbers):
        return _slab_step(body, seen, longest)
    if isinstance(body, _LEVELED):
        return _level_step(level_of(body, seen), body, seen, longest)
    n, level = body.slope(seen.r), body.level_of(body.inner(seen.r))
    half = 0.5 * body.side * dot(n, seen.v)
    most, magnitude, reach = body.bend(seen.r)
    bent = Bent(seen, level, half, norm(n), most, magnitude, reach, body.clearance(seen.r))
    return Step(level, half, bent.longest(longest))


def _level_step(here, body, seen, longest):
    """The `Step` of a level."""
    return Step(here.c, here.b, Known(body, seen, here).longest(min(here.own_rise(), longest)))


def _slab_step(body, seen, longest):
    x, side = along(body.normal, seen.r) - body.offset, body.side
    sign = select(x > 0.0, 1.0, -1.0)
    x, half, bend = sign * x, 0.5 * sign * along(body.normal, seen.v), 0.5 * sign * along(body.normal, seen.a)
    near = _level_step(Level(side * (x - body.radius), side * half, side * bend, 1.0, 0.0), body, seen, longest)
    far = _level_step(Level(-x - body.radius, -half, -bend, 1.0, 0.0), body, seen, longest)
    return near._replace(time=select((side > 0.0) & (far.time < near.time), far.time, near.time))


def _entry_step(body, seen, longest):
    """Of the part that the particle is least deep in: outside of one part is outside of the body."""
    found = Step(math.inf, 0.0, 0.0)
    for part in reversed(body.parts):
        here = safe_step(part, seen, longest)
        # Of a part that the particle is inside of nothing is known; on its face the sign of the approach decides.
        depth = part.gap_of(part.inner(seen.r))
        time = select(depth > noise(part, body.extent, seen.r), 0.0, here.time)
        least = here.level < found.level
        level, half = select(least, here.level, found.level), select(least, here.half, found.half)
        found = Step(level, half, select(time > found.time, time, found.time))
    return found


def _turned(body, seen):
    """What is seen, in the frame of a wall that is turned in its own."""
    return seen._replace(r=body.vector_in(seen.r), v=body.vector_in(seen.v), a=body.vector_in(seen.a))


# --- Levels and their bounds -----------------------------------------------------------------------------


def level_of(body, seen):
    """The `Level` of a wall, or `Between`."""
    if isinstance(body, Rotated):
        return level_of(body.body, _turned(body, seen))
    r, v, a = seen.r, seen.v, seen.a
    if isinstance(body, PlaneNumbers):
        n = body.normal
        return Level(dot(n, r) - body.offset, 0.5 * dot(n, v), 0.5 * dot(n, a), 1.0, 0.0)
    if isinstance(body, SlabNumbers):
        # Of the two planes: a bound of f''' of the square would be ten times as far from it.
        half = 0.5 * along(body.normal, v)
        x, bend = along(body.normal, r) - body.offset, 0.5 * along(body.normal, a)
        # Without a speed the plane behind is the near one, from which it leaves.
        sign = math.copysign(1.0, select(half == 0.0, -x, half))
        return Between(sign * x, abs(half), sign * bend, body.radius)
    side = body.side
    if isinstance(body, SphereNumbers):
        d = r - body.center
        q, bend = square(d), square(v) + dot(d, a)
        return Level(side * (q - body.radius2), side * dot(d, v), side * bend, 2.0 * math.sqrt(q), 1.0)
    n, most = body.slope(r), absolute(body.a)
    bend = form(body.a, v, v) + 0.5 * dot(n, a)
    level = body.level_of(body.inner(r))
    return Level(level, 0.5 * side * dot(n, v), side * bend, norm(n), max(most.x, most.y, most.z))


def bounds_on(body, seen, within):
    """`Bounds` in the frame of a wall, or in any other in which its level is the same function of place."""
    drive = seen.drive
    if isinstance(body, SphereNumbers):
        # In a frame that its centre carries along: it does not turn.
        spin, arm = drive.angular_speed(), norm(body.center - drive.center)
        return Bounds(
            seen.speed + seen.weight * within + drive.fastest + spin * arm,
            seen.weight + drive.hardest + spin * spin * arm,
            drive.jerk + spin * spin * spin * arm,
        )
    bounds, n = seen.bounds(within), _flat_normal(body)
    if n is None:
        return bounds
    # Only the jerk along the normal of a flat wall counts. Where a motion has none of it, a particle that leaves the
    # wall at no speed stays at it without end.
    jerk = _jerk_along(n, drive, bounds.jerk)
    return bounds._replace(jerk=select(jerk < bounds.jerk, jerk, bounds.jerk))


def _flat_normal(body):
    """The normal of a flat wall, or None."""
    if isinstance(body, Rotated):
        n = _flat_normal(body.body)
        return None if n is None else body.vector_out(n)
    if isinstance(body, SlabNumbers):
        return scaled(body.normal, 1.0)
    return body.normal if isinstance(body, PlaneNumbers) else None


def _jerk_along(n, drive, jerk):
    """The bound of the jerk along a normal, of one in any direction."""
    if drive.turn is None:
        return total(absolute(times(n, drive.jerks)))
    # Along its axis a rotation leaves a place as it is.
    axis = drive.turn.axis
    along_axis = dot(n, axis)
    return abs(along_axis) * total(absolute(times(axis, drive.jerks))) + norm(n - along_axis * axis) * jerk

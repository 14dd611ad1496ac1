"""Until when the level of a wall that moves surely stays below 0: safe steps of one wall.

In the frame of a wall the flight is a curve whose velocity w, acceleration a and jerk j have bounds W, A and J for any
time ahead. Along it the level f of a wall with the inner function q, whose H = grad grad q/2 has eigenvalues of at most
the magnitude m, has
    f' = grad q.w,   f''/2 = w.H w + grad q.a/2,   |f'''| <= 6 m W A + |grad q| J,
the last where H is constant. A step ends where the parabola above f rises through 0; near the hit each one triples the
digits, or doubles them where only f'' has a bound.
"""

import math
from typing import Any, NamedTuple

from ..kernel.jit import by_type, inlined, select
from ..kernel.vector import Vec, absolute, dot, norm, square, times, total
from . import contract
from .course import rise_time
from .drive import Turn
from .fold import Chain
from .relative import Bounds, Seen, bounds_of, turning
from .rotation import Rotated
from .shapes.plane import PlaneNumbers
from .shapes.quadratic import QuadricNumbers, form
from .shapes.rotated import own as rotated_own
from .shapes.rotated import scene as rotated_scene
from .shapes.slab import SlabNumbers, along, scaled
from .shapes.solid import SolidNumbers, noise
from .shapes.sphere import SphereNumbers

# The bounds of a step hold for at most so many times its length, after so many trials.
_CLOSE, _TRIALS = 2.0, 8


class Step(NamedTuple):
    """The level, half its derivative, and a time during which the flight stays admissible."""

    level: float
    half: float
    time: float


# --- A safe step of one wall -----------------------------------------------------------------------------


@by_type
def safe_step(body, drive, seen, longest):
    """The `Step` of a wall, whose time is at most the longest, and with a bound of f'' alone."""
    n, level = contract.slope(body, seen.r), contract.level_of(body, contract.inner(body, seen.r))
    half, steepness = 0.5 * body.side * dot(n, seen.v), norm(n)
    most, magnitude, reach = contract.bend(body, seen.r)
    clear = contract.clearance(body, seen.r)
    # The bounds grow with the time that they hold for.
    time, within, too_long = 0.0, longest, longest
    for _k in range(_TRIALS):
        bounds = bounds_of(drive, seen, within)
        speed = bounds.speed
        # f''/2 <= w.H w + |grad q| A/2, where grad q turns by 2 m W t at most
        bend = max(most, 0.0) * speed * speed
        bend += 0.5 * bounds.acceleration * (steepness + 2.0 * magnitude * speed * within)
        step = min(rise_time(level, half, bend), select(speed > 0.0, reach / select(speed > 0.0, speed, 1.0), math.inf))
        step = max(step, clear / select(speed > 0.0, speed, 1.0))
        time = max(time, min(step, within))
        too_long = select(time < within, within, too_long)
        if not _CLOSE * time < too_long:
            break
        within = math.sqrt(time * too_long)
    return Step(level, half, time)


class Level(NamedTuple):
    """A level whose third derivative has a bound: f, f'/2, f''/2, |grad q| and m."""

    level: float
    half: float
    bend: float
    steepness: float
    magnitude: float


class Between(NamedTuple):
    """The levels of the two planes of a slab: the place between them in the direction of motion, f'/2 > 0 and f''/2."""

    place: float
    half: float
    bend: float
    radius: float


@by_type
def level_of(body, seen):
    """`Level` of a wall, or `Between`."""
    raise NotImplementedError


@level_of.register(PlaneNumbers)
def _(body, seen):
    n = body.normal
    return Level(dot(n, seen.r) - body.offset, 0.5 * dot(n, seen.v), 0.5 * dot(n, seen.a), 1.0, 0.0)


@level_of.register(SlabNumbers)
def _(body, seen):
    # Of the two planes: a bound of f''' of the square would be ten times as far from it.
    half = 0.5 * along(body.normal, seen.v)
    x, bend = along(body.normal, seen.r) - body.offset, 0.5 * along(body.normal, seen.a)
    # Without a speed the plane behind is the near one, from which it leaves.
    sign = math.copysign(1.0, select(half == 0.0, -x, half))
    return Between(sign * x, abs(half), sign * bend, body.radius)


@level_of.register(SphereNumbers)
def _(body, seen):
    d, side = seen.r - body.center, body.side
    q = square(d)
    bend = square(seen.v) + dot(d, seen.a)
    return Level(side * (q - body.radius2), side * dot(d, seen.v), side * bend, 2.0 * math.sqrt(q), 1.0)


@level_of.register(QuadricNumbers)
def _(body, seen):
    n, side, a = contract.slope(body, seen.r), body.side, absolute(body.a)
    bend = form(body.a, seen.v, seen.v) + 0.5 * dot(n, seen.a)
    level = contract.level_of(body, contract.inner(body, seen.r))
    return Level(level, 0.5 * side * dot(n, seen.v), side * bend, norm(n), max(a.x, a.y, a.z))


@by_type
def bounds_on(body, drive, seen, within):
    """`Bounds` in the frame of a wall, or in any other in which its level is the same function of place."""
    return _along_normal(flat_normal(body), drive, bounds_of(drive, seen, within))


@by_type
def flat_normal(body):
    """The normal of a flat wall, or None."""
    return


flat_normal.register(PlaneNumbers, lambda body: body.normal)
flat_normal.register(SlabNumbers, lambda body: scaled(body.normal, 1.0))
flat_normal.register(Rotated, lambda body: _in_wall(flat_normal(body.body), body))


@by_type
def _in_wall(n, body):
    """A normal of its own frame in that of the wall."""
    return


_in_wall.register(Vec, lambda n, body: rotated_scene(body, n))


@by_type
def _along_normal(n, drive, bounds):
    """Bounds of a flat wall, to which only the jerk along its normal counts.

    Where a motion has none of it, a particle that leaves the wall at no speed stays at it without end.
    """
    return bounds


@_along_normal.register(Vec)
def _(n, drive, bounds):
    jerk = _jerk_along(drive.turn, n, drive, bounds.jerk)
    return Bounds(bounds.speed, bounds.acceleration, select(jerk < bounds.jerk, jerk, bounds.jerk))


@by_type
def _jerk_along(turn, n, drive, jerk):
    return total(absolute(times(n, drive.jerks)))


@_jerk_along.register(Turn)
def _(turn, n, drive, jerk):
    # Along its axis a rotation leaves a place as it is.
    along_axis = dot(n, turn.axis)
    across = norm(n - along_axis * turn.axis)
    return abs(along_axis) * total(absolute(times(turn.axis, drive.jerks))) + across * jerk


@bounds_on.register(SphereNumbers)
def _(body, drive, seen, within):
    # In a frame that its centre carries along: it does not turn.
    spin, arm = turning(drive.turn), norm(body.center - drive.center)
    return Bounds(
        seen.speed + seen.weight * within + drive.fastest + spin * arm,
        seen.weight + drive.hardest + spin * spin * arm,
        drive.jerk + spin * spin * spin * arm,
    )


@by_type
def third_of(level, bounds, within):
    """The bound of f''' within that time."""
    raise NotImplementedError


@third_of.register(Level)
def _(level, bounds, within):
    moved = level.steepness + 2.0 * level.magnitude * bounds.speed * within
    return 6.0 * level.magnitude * bounds.speed * bounds.acceleration + moved * bounds.jerk


third_of.register(Between, lambda level, bounds, within: bounds.jerk)


@inlined
def _step_of(here, body, drive, seen, longest):
    """The `Step` of a level."""
    within = min(rise_time(here.level, here.half, here.bend), longest)
    time, too_long = 0.0, within
    for _k in range(_TRIALS):
        third = third_of(here, bounds_on(body, drive, seen, within), within)
        time = max(time, min(rise_time(here.level, here.half, here.bend + third * within * (1.0 / 6.0)), within))
        # The bounds grow with the time that they hold for: those of a long time say little of a short step.
        too_long = select(time < within, within, too_long)
        if not _CLOSE * time < too_long:
            break
        within = math.sqrt(time * too_long)
    return Step(here.level, here.half, time)


def _of_level(kind: Any) -> None:
    contract.has_levels.register(kind, lambda surface: True)
    safe_step.register(
        kind, lambda body, drive, seen, longest: _step_of(level_of(body, seen), body, drive, seen, longest)
    )


_of_level(PlaneNumbers)
_of_level(SphereNumbers)
_of_level(QuadricNumbers)
# Between its planes; of a solid there is one.
contract.has_levels.register(SlabNumbers, lambda surface: surface.side > 0.0)


@safe_step.register(SlabNumbers)
def _(body, drive, seen, longest):
    x, side = along(body.normal, seen.r) - body.offset, body.side
    sign = select(x > 0.0, 1.0, -1.0)
    x, half, bend = sign * x, 0.5 * sign * along(body.normal, seen.v), 0.5 * sign * along(body.normal, seen.a)
    here, other = (
        Level(side * (x - body.radius), side * half, side * bend, 1.0, 0.0),
        Level(-x - body.radius, -half, -bend, 1.0, 0.0),
    )
    near, far = _step_of(here, body, drive, seen, longest), _step_of(other, body, drive, seen, longest)
    return Step(near.level, near.half, select((side > 0.0) & (far.time < near.time), far.time, near.time))


@inlined
def _own(body, seen):
    """What is seen, in the frame of a wall that is turned in its own."""
    return Seen(
        rotated_own(body, seen.r), rotated_own(body, seen.v), rotated_own(body, seen.a), seen.speed, seen.arm,
        seen.weight, seen.coordinates,
    )  # fmt: skip


contract.has_levels.register(Rotated, lambda surface: contract.has_levels(surface.body))
level_of.register(Rotated, lambda body, seen: level_of(body.body, _own(body, seen)))


@safe_step.register(Rotated)
def _(body, drive, seen, longest):
    return safe_step(body.body, drive, _own(body, seen), longest)


@safe_step.register(SolidNumbers)
def _(body, drive, seen, longest):
    return _entry_step(body.parts, body.extent, drive, seen, longest)


@by_type
def _entry_step(parts, extent, drive, seen, longest):
    """Of the part that the particle is least deep in: outside of one part is outside of the body."""
    return Step(math.inf, 0.0, 0.0)


@_entry_step.register(Chain)
def _(parts, extent, drive, seen, longest):
    here = safe_step(parts.first, drive, seen, longest)
    other = _entry_step(parts.rest, extent, drive, seen, longest)
    # Of a part that the particle is inside of nothing is known; on its face the sign of the approach decides.
    depth = contract.gap_of(parts.first, contract.inner(parts.first, seen.r))
    time = select(depth > noise(parts.first, extent, seen.r), 0.0, here.time)
    least = here.level < other.level
    level, half = select(least, here.level, other.level), select(least, here.half, other.half)
    return Step(level, half, select(time > other.time, time, other.time))

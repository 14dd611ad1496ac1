"""Sliding along one wall, or along the edge of two: the converged step of the scheme, composed to fourth order.

With w0 = v0 + h G/2 and P the part of w0 that the walls allow, a step of length h is
    r1 = r0 + h P,   w1 = 2 P - w0,   w0 = P + sum b n,                                                        (S)
where n is along the discrete gradient D(r0, r1) of each wall that holds the particle: |w1| = |w0| for any error of
n. Coulomb's friction slows the particle for h/2 before the step and for h/2 after it. Both are symmetric, so Suzuki's
composition p h, p h, (1 - 4p) h, p h, p h is of fourth order.
Sources: García Orden & Ortega 2007, eqs. (7), (8) in the limit V -> 0; Suzuki, Phys. Lett. A 146 (1990) 319.
"""

import math

from ..kernel.gravity import accelerated
from ..kernel.jit import select
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, absolute, dot, either, square, total
from .hold import Two, mean_drift
from .laws import of_wall
from .reflection import relative, wall_velocity

# p of Suzuki's composition of fourth order
OUTER = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
MIDDLE = 1.0 - 4.0 * OUTER
PARTS = 5
# Sweeps until r1 and the discrete gradients agree: each gains the digits of h |v|/R.
SWEEPS = 40
# The last sweep but one leaves r1 wrong by no more than this fraction of itself, or of the allowed error of a step.
_STILL, _SLACK = 64.0 * EPSILON, 0.1
# A sweep leaves at most this multiple of the error of r1 times the turn of the velocity in a composed step over |v|;
# it is 1/3, half of the turn of the longest part, if the wall is as curved along the path as across.
_GAIN = 1.5
# Round-off of the terms of `defect`, in units of the last place of a coordinate.
_NOISE = 8.0 * EPSILON
# The error of a composed step over its defect: the error of ten crossings on the surfaces of the tests is then 1 to 4
# times the allowed error of one.
_ERROR = 0.7
# Steps change by no more than these factors, and aim at this part of the tolerance.
_SHRINK, _GROW, _SAFE = 0.2, 5.0, 0.85
# |v|^2 is restored from the energy if it is more than this fraction of its scale: at a turning point it has no digits.
_FAST = 1e-12
# The fraction of the time to a stop that a step may take: each step leaves a thousandth of the speed.
_BEFORE_STOP = 0.999
# Sliding needs these functions of every wall.
NEEDS = (
    "unit_normal", "step_normal", "outward_acceleration", "project", "distance",
    "first_hit", "inner", "discrete_gradient", "level_of",
)  # fmt: skip


# --- Friction --------------------------------------------------------------------------------------------


def _grip(friction, active, presses):
    """Return sum mu b over the walls, which press with b."""
    b, c = presses
    first = of_wall(friction, active.first) * b
    return first + (of_wall(friction, active.second) * c if isinstance(active, Two) else 0.0)


class Slowed(Record):
    """A velocity after friction, and the loss of |v|^2."""

    v: Vec
    lost: float


def slow(friction, active, walls, gravity, r, motion, h):
    """Return the velocity after a time h of friction alone; `motion` is (v, the direction of sliding, u).

    u is the velocity of the wall, or None; the direction and the speed are relative to it.

    The force of the walls is k s^2 + l s + c at the speed s, where l is of moving walls: the midpoint rule for
    ds/dt = -(k s^2 + l s + c), with the sum of mu k, mu l and mu c of the walls, is a quadratic equation. Back in time
    gravity may turn a slow particle round between two steps: s is then below 0.
    """
    v, towards, u = motion
    if friction is None:
        return Slowed(v, 0.0)
    slip = relative(u, v)
    speed = math.sqrt(square(slip))
    moving = speed > 0.0
    sign = select(dot(slip, towards) < 0.0, -1.0, 1.0)
    direction = either(moving, slip * (sign / select(moving, speed, 1.0)), towards)
    k, linear, c = _force_of_speed(friction, active, walls, gravity, r, (direction, speed, u))
    # s1 = 2 s - s0 with s = s0 - h/2 (k s^2 + l s + c)
    a, b = 0.5 * h * k, sign * speed - 0.5 * h * c
    one = 1.0 + 0.5 * h * linear
    root2 = one * one + 4.0 * a * b
    s0, middle = sign * speed, 2.0 * b / (one + math.sqrt(select(root2 > 0.0, root2, 0.0)))
    s1 = 2.0 * middle - s0
    return Slowed(v + (s1 - s0) * direction, s0 * s0 - s1 * s1)


def _force_of_speed(friction, active, walls, gravity, r, slip):
    """Return (k, l, c) of the force of friction, k s^2 + l s + c; `slip` is (its direction, its speed, u)."""
    direction, speed, u = slip
    pull = accelerated(gravity, ZERO, 1.0)
    if u is None:
        k = _grip(friction, active, active.presses(walls, r, direction, ZERO))
        return k, 0.0, _grip(friction, active, active.presses(walls, r, ZERO, pull))
    step = select(speed > 0.0, speed, 1.0)
    none = _grip(friction, active, active.presses(walls, r, u, pull))
    ahead = _grip(friction, active, active.presses(walls, r, u + step * direction, pull))
    back = _grip(friction, active, active.presses(walls, r, u - step * direction, pull))
    # Where this force is negative, the wall lets go.
    k, slope = 0.5 * (ahead + back) - none, 0.5 * (ahead - back)
    return k / (step * step), slope / step, none


def direction(friction, v, a):
    """Return the direction of sliding: that of the velocity, or of the acceleration of a particle at rest."""
    if friction is None:
        return ZERO
    way = either(square(v) > 0.0, v, a)
    length = math.sqrt(square(way))
    return way / select(length > 0.0, length, 1.0)


# --- Forces ----------------------------------------------------------------------------------------------


class Force(Record):
    """The acceleration of a sliding particle, and the force of each wall on it, per mass; m is the second wall's."""

    acceleration: Vec
    n: float
    m: float


def force(laws, active, walls, gravity, r, v):
    """Return the `Force` on a particle that slides with this velocity along the walls."""
    pull, moving, friction = accelerated(gravity, ZERO, 1.0), laws.moving, laws.friction
    n, m = active.presses(walls, r, v, pull)
    taken = active.split_at(walls, None, r, v)
    a = pull - n * taken.n - m * taken.m
    if friction is None:
        return Force(a, n, m)
    slip = relative(wall_velocity(moving, walls, active.first, r), v)
    drive = relative(None if moving is None else walls.acceleration(active.first, r), a)
    return Force(a - _drag(_grip(friction, active, (n, m)), slip, drive), n, m)


def _drag(grip, v, a):
    """Return Coulomb's friction against the velocity, or at rest against the acceleration, and no more than that."""
    speed2, pulled = square(v), math.sqrt(square(a))
    moving = speed2 > 0.0
    against = select(moving, 1.0 / math.sqrt(select(moving, speed2, 1.0)), 0.0) * v
    share = select(pulled > 0.0, grip / select(pulled > 0.0, pulled, 1.0), 0.0)
    held_back = select(moving, 0.0, select(share < 1.0, share, 1.0))
    return grip * against + held_back * a


def longest(friction, v, a):
    """Return a time within which a particle that slides with friction surely does not stop."""
    if friction is None:
        return math.inf
    # At the present rate it stops after |v|^2/(-v.a).
    slowing = -dot(v, a)
    return select(slowing > 0.0, _BEFORE_STOP * square(v) / select(slowing > 0.0, slowing, 1.0), math.inf)


# --- A step ----------------------------------------------------------------------------------------------


def still(r, v, taken, allowed):
    """Return the most that the last sweep but one may move r1, if the walls change v by `taken` in a composed step."""
    least = _STILL * total(absolute(r))
    least = select(least > _SLACK * allowed, least, _SLACK * allowed)
    turn, whole = _GAIN * total(absolute(taken)), total(absolute(v))
    return select(turn < whole, least * whole / select(turn > 0.0, turn, 1.0), least)


class SlidingSweep(Record):
    """One sweep of a step: r1, and whether it needs more than one further sweep."""

    r: Vec
    moves: bool


def sweep(moving, active, walls, h, step, still):
    """Make one sweep of (S): the step with the discrete gradients of the last r1; `step` is (r0, r1, w0)."""
    r0, r1, w = step
    end = r0 + h * active.along(walls, mean_drift(moving, active, walls, r0, r1, h), r0, r1, w)
    return SlidingSweep(end, not (total(absolute(end - r1)) <= still))


def part(k):
    """Return the length of step k of the composition, in units of the length of the composition."""
    return select(k == 2, MIDDLE, OUTER)


def before(k):
    """Return the part of the composition before its step k."""
    return select(k < 3, OUTER * select(k < 3, 1.0 * k, 0.0), 1.0 - OUTER * (5.0 - k))


def inverse_part(k):
    """Return 1 over the length of step k of the composition."""
    return select(k == 2, 1.0 / MIDDLE, 1.0 / OUTER)


def lead(k):
    """Return the lead of the acceleration of step k over the mean of the last step, as a part of its last change.

    For constant jerk the mean of a step is the value in its middle, and r1 - r0 - h v0 is h^2/2 times the value after
    its first third.
    """
    first, middle, last = _lead(0.0, OUTER, OUTER), _lead(OUTER, OUTER, MIDDLE), _lead(MIDDLE, OUTER, OUTER)
    turned = _lead(OUTER, MIDDLE, OUTER)
    return select(k == 1, first, select(k == 2, middle, select(k == 3, turned, select(k == 4, last, 0.0))))


def _lead(before, last, now):
    return (0.5 * last + now / 3.0) / (0.5 * (before + last))


# --- The end of a composed step --------------------------------------------------------------------------


def restored(v, speed2, scale2):
    """Return a velocity along the walls with |v|^2 from the energy, if the energy has more digits of it than v."""
    now = square(v)
    f = 0.5 * (speed2 - now) / select(now > 0.0, now, 1.0)
    return v * (1.0 + select((now > _FAST * scale2) & (abs(f) < 0.1), f, 0.0))


def error(h, start, end, allowed):
    """Return the error of a composed step over the allowed error; start and end are (r, v, a).

    The defect of the step, r1 - r0 - h (v0 + v1)/2 - h^2 (a0 - a1)/12, is of fifth order like the error of the step,
    and vanishes like it if the motion is a parabola.
    """
    r0, v0, a0 = start
    r1, v1, a1 = end
    defect = (r1 - r0) - (0.5 * h) * (v0 + v1) - (h * h / 12.0) * (a0 - a1)
    off = total(absolute(defect)) - _NOISE * (total(absolute(r0)) + total(absolute(r1)))
    return select(off > 0.0, _ERROR * off / allowed, 0.0)


def next_step(h, ratio):
    """Return the length of the next step after one with `ratio` times the allowed error."""
    some = ratio > 0.0
    # The error over the time of the step is of fourth order.
    factor = _SAFE / math.sqrt(math.sqrt(select(some, ratio, 1.0)))
    factor = select(some & (factor < _GROW), factor, _GROW)
    return h * select(factor > _SHRINK, factor, _SHRINK)

"""When a flight meets walls in any motion: safe steps, so that no hit is skipped.

In the frame of a wall the flight is a curve whose velocity w, acceleration a and jerk j have bounds W, A and J for any
time ahead. Along it the level f of a wall with the inner function q, whose H = grad grad q/2 has eigenvalues of at most
the magnitude m, has
    f' = grad q.w,   f''/2 = w.H w + grad q.a/2,   |f'''| <= 6 m W A + |grad q| J,
the last where H is constant. A step ends where the parabola above f rises through 0; near the hit each one triples the
digits, or doubles them where only f'' has a bound.
"""

import math
from typing import Any, NamedTuple

from ..kernel.gravity import accelerated
from ..kernel.jit import by_type, by_type_outlined, inlined, outlined, select
from ..kernel.vector import ZERO, Vec, absolute, dot, norm, square, total
from ..motion import Guide
from . import contract
from .course import rise_time
from .drive import Drive, Turn, drive_of, pose
from .flights import NEVER, Hit, hit, sooner
from .fold import Chain
from .moving import Following, Marched, Moving, Translated, at
from .posed import Drifting, Posed, arm_length, frame_pull, in_frame, own_place
from .rotation import Rotated
from .shapes.plane import PlaneNumbers
from .shapes.quadratic import QuadricNumbers, form
from .shapes.rotated import own as rotated_own
from .shapes.slab import SlabNumbers, along
from .shapes.solid import SolidNumbers, noise
from .shapes.sphere import SphereNumbers
from .surface import Surface

_EPSILON = 2.220446049250313e-16
# Safe steps of one flight; what is not found by then goes on in the next pass.
_MARCH = 200
# A flight that is past a wall by so many times the round-off of its place is at it.
_ROUND_OFF = 8.0
# The bounds of a step hold for at most so many times its length, after so many trials.
_CLOSE, _TRIALS = 2.0, 8
# Bisections of an interval down to neighbouring numbers.
_BISECTIONS = 1100


class Flight(NamedTuple):
    """A free flight, and how much of the frame is left at its start [s]."""

    r: Vec
    v: Vec
    pull: Vec
    left: float
    speed: float  # |v|
    weight: float  # |G|


class Seen(NamedTuple):
    """A particle in the frame of a wall at one time of its flight, and what bounds its way from there."""

    r: Vec
    v: Vec
    a: Vec
    speed: float  # a bound of |v| in the scene
    arm: float  # its distance from the centre of the rotation; 0 where there is none
    weight: float  # |G|
    coordinates: float  # what the round-off of its place is relative to [m]


class Framed(NamedTuple):
    """The motion of a wall, and the particle in its frame."""

    drive: Drive
    seen: Seen


class Step(NamedTuple):
    """The level, half its derivative, and a time during which the flight stays admissible."""

    level: float
    half: float
    time: float


class Nearest(NamedTuple):
    """The shortest safe step of all walls, its wall and how far it goes; a wall that is passed, or -1, and how far."""

    time: float
    wall: float
    way: float
    room: float  # what way counts as none
    past: float
    depth: float


_NOBODY = Nearest(math.inf, -1.0, math.inf, 0.0, -1.0, 0.0)


@inlined
def _flight(r, v, pull, left):
    return Flight(r, v, pull, left, norm(v), norm(pull))


# --- Where the particle is -------------------------------------------------------------------------------


@inlined
def _seen(drive, flight, t):
    """The particle at a time of its flight, in the frame of a wall with this motion."""
    left = flight.left - t
    place = pose(drive, left)
    now = Posed(0.0, place, place, drive, left, left)
    p, v = flight.r + t * (flight.v + (0.5 * t) * flight.pull), flight.v + t * flight.pull
    coordinates = total(absolute(p)) + total(absolute(place.shift))
    speed = flight.speed + t * flight.weight
    return Seen(
        own_place(now, p), in_frame(now, p, v), frame_pull(now, p, v, flight.pull), speed,
        arm_length(place.turn, now, p), flight.weight, coordinates,
    )  # fmt: skip


class Bounds(NamedTuple):
    """Of the speed, the acceleration and the jerk in the frame of a wall for some time."""

    speed: float
    acceleration: float
    jerk: float


@inlined
def _bounds(drive, seen, within):
    spin = _rate(drive.turn)
    # Derivatives of A^T (r - c - d), where each of A^T turns by the rate once more
    speed = seen.speed + seen.weight * within + drive.fastest
    arm, hard = seen.arm + speed * within, seen.weight + drive.hardest
    return Bounds(
        speed + spin * arm,
        hard + spin * (2.0 * speed + spin * arm),
        drive.jerk + spin * (3.0 * hard + spin * (3.0 * speed + spin * arm)),
    )


@by_type
def _rate(turn):
    return 0.0


_rate.register(Turn, lambda turn: abs(turn.rate))

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
        bounds = _bounds(drive, seen, within)
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


@inlined
def _step_of(level, half, bend, steepness, magnitude, drive, seen, longest):
    """The `Step` where H is constant, from f''/2 now and the bound of f'''."""
    within = min(rise_time(level, half, bend), longest)
    time, too_long = 0.0, within
    for _k in range(_TRIALS):
        bounds = _bounds(drive, seen, within)
        third = 6.0 * magnitude * bounds.speed * bounds.acceleration
        third += (steepness + 2.0 * magnitude * bounds.speed * within) * bounds.jerk
        time = max(time, min(rise_time(level, half, bend + third * within * (1.0 / 6.0)), within))
        # The bounds grow with the time that they hold for: those of a long time say little of a short step.
        too_long = select(time < within, within, too_long)
        if not _CLOSE * time < too_long:
            break
        within = math.sqrt(time * too_long)
    return Step(level, half, time)


@safe_step.register(PlaneNumbers)
def _(body, drive, seen, longest):
    n = body.normal
    return _step_of(
        dot(n, seen.r) - body.offset, 0.5 * dot(n, seen.v), 0.5 * dot(n, seen.a), 1.0, 0.0, drive, seen, longest
    )


@safe_step.register(SlabNumbers)
def _(body, drive, seen, longest):
    # Of the two planes: a bound of f''' of the square would be ten times as far from it.
    x, side = along(body.normal, seen.r) - body.offset, body.side
    sign = select(x > 0.0, 1.0, -1.0)
    x, half, bend = sign * x, 0.5 * sign * along(body.normal, seen.v), 0.5 * sign * along(body.normal, seen.a)
    near = _step_of(side * (x - body.radius), side * half, side * bend, 1.0, 0.0, drive, seen, longest)
    far = _step_of(-x - body.radius, -half, -bend, 1.0, 0.0, drive, seen, longest)
    return Step(near.level, near.half, select((side > 0.0) & (far.time < near.time), far.time, near.time))


@safe_step.register(SphereNumbers)
def _(body, drive, seen, longest):
    d, side = seen.r - body.center, body.side
    q = square(d)
    bend = square(seen.v) + dot(d, seen.a)
    return _step_of(
        side * (q - body.radius2), side * dot(d, seen.v), side * bend, 2.0 * math.sqrt(q), 1.0, drive, seen, longest
    )


@safe_step.register(QuadricNumbers)
def _(body, drive, seen, longest):
    n, side, a = contract.slope(body, seen.r), body.side, absolute(body.a)
    bend = form(body.a, seen.v, seen.v) + 0.5 * dot(n, seen.a)
    level = contract.level_of(body, contract.inner(body, seen.r))
    magnitude = max(a.x, a.y, a.z)
    return _step_of(level, 0.5 * side * dot(n, seen.v), side * bend, norm(n), magnitude, drive, seen, longest)


@safe_step.register(Rotated)
def _(body, drive, seen, longest):
    own = Seen(
        rotated_own(body, seen.r), rotated_own(body, seen.v), rotated_own(body, seen.a), seen.speed, seen.arm,
        seen.weight, seen.coordinates,
    )  # fmt: skip
    return safe_step(body.body, drive, own, longest)


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


# --- Of all walls ----------------------------------------------------------------------------------------


@by_type
def _nearest(chain, number, last, flight, t, longest):
    """The `Nearest` of all walls that are met by safe steps; `last` is `Framed` of the wall before."""
    return _NOBODY


@_nearest.register(Chain)
def _(chain, number, last, flight, t, longest):
    mine = _motion(chain.first, last, flight, t)
    rest = _nearest(chain.rest, number + 1.0, mine, flight, t, longest)
    return _nearer(mine, chain.first, number, rest, longest)


@by_type
def _motion(wall, last, flight, t):
    """`Framed` of a wall; None of one that is not met by safe steps."""
    return


@_motion.register(Moving)
def _(wall, last, flight, t):
    return Framed(wall.drive, _seen(wall.drive, flight, t))


_motion.register(Translated, lambda wall, last, flight, t: None)
_motion.register(Following, lambda wall, last, flight, t: last)


@by_type
def _nearer(mine, wall, number, rest, longest):
    """The `Nearest` of one wall and the rest."""
    return rest


@_nearer.register(Framed)
def _(mine, wall, number, rest, longest):
    seen = mine.seen
    step = safe_step(wall.body, mine.drive, seen, longest)
    is_past = (step.level > 0.0) & (step.half > 0.0)
    speed, room = _bounds(mine.drive, seen, 0.0).speed, 2.0 * _EPSILON * seen.coordinates
    depth, way = speed * (0.5 * step.level / select(is_past, step.half, 1.0)), speed * step.time
    sooner_one = step.time < rest.time
    return Nearest(
        select(sooner_one, step.time, rest.time),
        select(sooner_one, number, rest.wall),
        select(sooner_one, way, rest.way),
        select(sooner_one, room, rest.room),
        select(is_past, number, rest.past),
        select(is_past, depth, rest.depth),
    )


@outlined
def _march(chain, flight, longest):
    """The first `Hit` with the walls that are met by safe steps, if there is one before the longest time."""
    t, before = 0.0, 0.0
    for i in range(_MARCH):
        near = _nearest(chain, 0.0, None, flight, t, longest - t)
        if i > 0 and near.past >= 0.0:
            # By round-off: a wall that bends as is said is not passed by more.
            if near.depth <= _ROUND_OFF * near.room:
                return Hit(t, near.past)
            return _last_inside(chain, flight, before, t, near.past)
        before, t = t, t + near.time
        if (i > 0 or near.time == 0.0) and near.way <= near.room:
            return Hit(t, near.wall)
        if not t < longest:
            return Hit(longest, -1.0)
    return Hit(t, -1.0)


@outlined
def _last_inside(chain, flight, low, high, wall):
    """The last time between two at which no wall is passed: at the second one is, by round-off."""
    for _i in range(_BISECTIONS):
        t = 0.5 * (low + high)
        if not low < t < high:
            break
        past = _nearest(chain, 0.0, None, flight, t, 0.0).past
        if past >= 0.0:
            high, wall = t, past
        else:
            low = t
    return Hit(low, wall)


def lacks_bend(surface: Surface) -> bool:
    """Whether a surface moves so that its hits need safe steps, and does not bound its bend."""
    return _needs_steps(surface) and any(_is_unknown(wall) for wall in surface.walls())


def _needs_steps(surface: Surface) -> bool:
    if surface.mass is not None:
        return isinstance(surface.motion, Guide) and surface.motion.stiffness > 0.0
    if surface.motion is None:
        return False
    drive = drive_of(surface, 0.0)
    return drive.swings is not None or drive.track is not None or drive.turn is not None


def _is_unknown(wall: Any) -> bool:
    if isinstance(wall, Rotated):
        return _is_unknown(wall.body)
    own = safe_step.dispatch(type(wall)) is safe_step.dispatch(object)
    return own and contract.bend.dispatch(type(wall)) is contract.bend.dispatch(object)


# --- First hits ------------------------------------------------------------------------------------------


@by_type_outlined
def first_hit(chain, gravity, r, v, left):
    """The first `Hit` of a free flight with the walls of a scene, with so much of the frame left [s]."""
    return NEVER


@first_hit.register(Marched)
def _(chain, gravity, r, v, left):
    found = _closed_hit(at(chain, left), gravity, r, v)
    longest = select(found.time < left, found.time, left)
    met = _march(chain.walls, _flight(r, v, accelerated(gravity, ZERO, 1.0), left), longest)
    if met.wall >= 0.0 or met.time < longest:
        return met
    return found


@by_type
def _closed_hit(chain, gravity, r, v):
    """The first hit with the walls that have a closed form."""
    return NEVER


@_closed_hit.register(Chain)
def _(chain, gravity, r, v):
    rest = _closed_hit(chain.rest, gravity, r, v)
    time, found = _closed(chain.first, gravity, r, v)
    return sooner(time, found, rest)


@by_type
def _closed(surface, gravity, r, v):
    return hit(gravity, surface, r, v)


_closed.register(Posed, lambda surface, gravity, r, v: (math.inf, True))
_closed.register(Drifting, lambda surface, gravity, r, v: hit(gravity, surface, r, v))


@outlined
def _alone(surface, r, v, pull):
    """When a flight leaves the admissible side of this wall: (time, whether it does then)."""
    found = _march(Chain(Moving(surface.body, surface.drive), None), _flight(r, v, pull, surface.left), surface.left)
    return found.time, found.wall >= 0.0


contract.first_hit.register(Posed, lambda surface, r, v: _alone(surface, r, v, ZERO))
contract.falling_hit.register(Posed, lambda surface, r, v, pull: _alone(surface, r, v, pull))

"""Walls that move: every function of a surface but its flights, asked in the frame in which it is given.

A wall xi of the frame is at x = c + d + A (xi - c), with the displacement d(t) and the rotation A(t) about c. `at` and
`during` make of the walls of a scene those at one instant, or over one step, which are surfaces like any other; a scene
without motion has none of this around its walls and pays nothing. Times count back from the end of the frame under way,
so that they have the digits of a frame and not those of the run.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from .. import motion as motions
from ..kernel.jit import Array, by_type, inlined, select
from ..kernel.vector import ZERO, Vec, cross, dot, norm, vec
from . import contract
from .fold import Chain, length
from .surface import Surface

# A motion changes little in this part of a radian, or of a piece of a path.
_SLOW = 0.05


class Swing(NamedTuple):
    """C (cos(w t) - 1) + S sin(w t), with the time t since the end of the frame."""

    cosine: Vec
    sine: Vec
    rate: float


class Track(NamedTuple):
    """A spline: d(t) less its value at the end of the frame, which is at the time `now`."""

    times: Array  # (knots,)
    cubics: Array  # (4, 3, pieces)
    end: Vec
    now: float


class Turn(NamedTuple):
    """The rotation about an axis through the centre: the rows of A at the end of the frame, and the rate [rad/s]."""

    x: Vec
    y: Vec
    z: Vec
    axis: Vec
    rate: float


class Drive(NamedTuple):
    """The motion of a wall, as kernels take it in one frame."""

    shift: Vec  # d at the end of the frame
    velocity: Vec
    swings: Any  # None or a Chain of `Swing`
    track: Any  # None or `Track`
    turn: Any  # None or `Turn`; None also where the rotation leaves the surface as it is
    spin: Any  # the angular velocity, or None
    center: Vec
    fastest: float  # bound of |d'| [m/s]
    hardest: float  # bound of |d''| [m/s^2]
    jerk: float  # bound of |d'''| [m/s^3]
    pace: float  # a time in which it changes little [s]


class Moving(NamedTuple):
    """A wall and its motion."""

    body: Any
    drive: Drive


class Translated(Moving):
    """A wall in uniform translation, with or without a spin that leaves the surface as it is."""


class Following(NamedTuple):
    """A wall that moves with the one before it: both are of one surface."""

    body: Any


class Carried(NamedTuple):
    """The walls of a scene, some of which move, all of them uniformly."""

    walls: Chain


class Marched(Carried):
    """The same where others move in any other way: flights to these end by safe steps."""


class Pose(NamedTuple):
    """Where a wall is at one instant: d, d', d'' and the rows of A, or None."""

    shift: Vec
    velocity: Vec
    acceleration: Vec
    turn: Any


class Rows(NamedTuple):
    """The rows of a matrix."""

    x: Vec
    y: Vec
    z: Vec


class Posed(NamedTuple):
    """A wall at one instant, or over one step."""

    body: Any
    pose: Pose
    end: Pose  # at the end of the step
    drive: Drive
    left: float  # of the frame [s]
    after: float  # of the frame, at the end of the step [s]


class Drifting(Posed):
    """The same of a wall in uniform translation: a flight ends as at a wall at rest."""


length.register(Carried, lambda chain: length(chain.walls))

# --- From a description ----------------------------------------------------------------------------------


def carried(surfaces: tuple[Surface, ...], moment: float) -> Chain | Carried | None:
    """The walls of a scene in the frame that ends at a moment [s]."""
    made = [wall for surface in surfaces for wall in _walls_of(surface, moment)]
    chain = None
    for wall in reversed(made):
        chain = Chain(wall, chain)
    if chain is None or all(surface.motion is None for surface in surfaces):
        return chain
    return Marched(chain) if any(type(wall) is Moving for wall in made) else Carried(chain)


def _walls_of(surface: Surface, moment: float) -> list[Any]:
    """The walls of a surface in the frame that ends at a moment [s]."""
    first, *others = surface.walls()
    if surface.motion is None:
        return [first, *others]
    drive = drive_of(surface, moment)
    uniform = drive.swings is None and drive.track is None and drive.turn is None
    return [(Translated if uniform else Moving)(first, drive), *map(Following, others)]


def drive_of(surface: Surface, moment: float) -> Drive:
    """The motion of a surface in the frame that ends at a moment [s]."""
    # A guide says how impacts move a wall, which is at rest before.
    parts = [one for one in motions.parts_of(surface.motion) if not isinstance(one, motions.Guide)]
    velocity, swings, track, turn, spin, center = np.zeros(3), None, None, None, None, ZERO
    fastest = hardest = jerk = 0.0
    pace = math.inf
    for one in parts:
        if isinstance(one, motions.Translation):
            velocity = velocity + np.array(one.velocity)
        elif isinstance(one, motions.Oscillation):
            led = one.harmonic((0.0, 0.0, 0.0))
            c, s = math.cos(led.rate * moment), math.sin(led.rate * moment)
            # C cos(a + b) + S sin(a + b), with the angle a at the end of the frame
            swings = Chain(
                Swing(_vector(c * led.cosine + s * led.sine), _vector(c * led.sine - s * led.cosine), led.rate), swings
            )
            amplitude, pace = math.hypot(*one.amplitude), min(pace, _SLOW / led.rate)
            fastest += amplitude * led.rate
            hardest += amplitude * led.rate**2
            jerk += amplitude * led.rate**3
        elif isinstance(one, motions.Path):
            if track is not None:
                raise NotImplementedError
            cubics = one.cubics()
            track = Track(np.array(one.times), cubics, _vector(one.displacement(moment)), moment)
            # Within a piece the velocity is largest at an end or where the second derivative is 0.
            h = np.diff(one.times)
            pace = min(pace, _SLOW * float(h.min()))
            ends = cubics[1], cubics[1] + h * (2.0 * cubics[2] + 3.0 * h * cubics[3])
            bends = 2.0 * cubics[2], 2.0 * cubics[2] + 6.0 * h * cubics[3]
            jerk += float(6.0 * np.sqrt((cubics[3] ** 2).sum(axis=0)).max())
            hardest += float(max(np.sqrt((bend**2).sum(axis=0)).max() for bend in bends))
            fastest += float(max(np.sqrt((end**2).sum(axis=0)).max() for end in ends)) + float(h.max()) * hardest
        else:
            axis = motions.unit_axis(one)
            pace = min(pace, _SLOW / abs(one.rate)) if one.rate else pace
            center, spin = _vector(one.center), _vector(one.rate * axis)
            if not surface.is_unturned_by(tuple(axis.tolist()), one.center):
                rows = motions.pose(one, moment).turn
                x, y, z = map(vec, rows.tolist())
                turn = Turn(x, y, z, _vector(axis), one.rate)
    shift = motions.pose(surface.motion, moment).shift
    fastest += math.hypot(*velocity)
    return Drive(_vector(shift), _vector(velocity), swings, track, turn, spin, center, fastest, hardest, jerk, pace)


def _vector(values: Any) -> Vec:
    return vec(np.asarray(values, np.float64).tolist())


# --- Poses -----------------------------------------------------------------------------------------------


@by_type
def _swung(swings, t):
    """What oscillations add to d, d' and d''."""
    return ZERO, ZERO, ZERO


@_swung.register(Chain)
def _(swings, t):
    one = swings.first
    d, v, a = _swung(swings.rest, t)
    angle = one.rate * t
    half = math.sin(0.5 * angle)
    # cos a - 1 = -2 sin^2(a/2) has no cancellation.
    versine, s = 2.0 * half * half, math.sin(angle)
    c = 1.0 - versine
    return (
        d + one.sine * s - one.cosine * versine,
        v + one.rate * (one.sine * c - one.cosine * s),
        a - (one.rate * one.rate) * (one.sine * s + one.cosine * c),
    )


@by_type
def _tracked(track, t):
    """What a spline adds."""
    return ZERO, ZERO, ZERO


@_tracked.register(Track)
def _(track, t):
    now = track.now + t
    low, high = 0, track.times.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if track.times[middle] <= now:
            low = middle
        else:
            high = middle
    s, cubics = now - track.times[low], track.cubics
    a, b = (
        Vec(cubics[0, 0, low], cubics[0, 1, low], cubics[0, 2, low]),
        Vec(cubics[1, 0, low], cubics[1, 1, low], cubics[1, 2, low]),
    )
    c, d = (
        Vec(cubics[2, 0, low], cubics[2, 1, low], cubics[2, 2, low]),
        Vec(cubics[3, 0, low], cubics[3, 1, low], cubics[3, 2, low]),
    )
    return (
        (a - track.end) + s * (b + s * (c + s * d)),
        b + s * (2.0 * c + (3.0 * s) * d),
        2.0 * c + (6.0 * s) * d,
    )


@by_type
def _turned(turn, t):
    """The rows of A."""
    return


@_turned.register(Turn)
def _(turn, t):
    # A(t) = A R, with the rotation R about the same axis: the rows of A, turned back.
    angle = turn.rate * t
    half = math.sin(0.5 * angle)
    versine, s = 2.0 * half * half, math.sin(angle)
    return Rows(_spun(turn, turn.x, versine, s), _spun(turn, turn.y, versine, s), _spun(turn, turn.z, versine, s))


@inlined
def _spun(turn, row, versine, s):
    """A row, turned back about the axis: row cos a + (1 - cos a) k (k.row) - sin a k x row."""
    k = turn.axis
    return row + versine * (dot(k, row) * k - row) - s * cross(k, row)


@inlined
def pose(drive, left):
    """The `Pose` when so much of the frame is left [s]."""
    t = -left
    d, v, a = _swung(drive.swings, t)
    e, w, b = _tracked(drive.track, t)
    return Pose(drive.shift + t * drive.velocity + d + e, drive.velocity + v + w, a + b, _turned(drive.turn, t))


@by_type
def at(chain, left):
    """The walls when so much of the frame is left [s]: themselves, where none moves."""
    return chain


@by_type
def during(chain, left, after):
    """The walls over a step, at whose start and end so much of the frame is left [s]."""
    return chain


at.register(Carried, lambda chain, left: _during(chain.walls, None, left, left))
during.register(Carried, lambda chain, left, after: _during(chain.walls, None, left, after))


@by_type
def _during(chain, last, left, after):
    """The walls of a chain; `last` is the one before them."""
    return


@_during.register(Chain)
def _(chain, last, left, after):
    made = _wall(chain.first, last, left, after)
    return Chain(made, _during(chain.rest, made, left, after))


@by_type
def _wall(wall, last, left, after):
    return wall


@_wall.register(Moving)
def _(wall, last, left, after):
    return Posed(wall.body, pose(wall.drive, left), pose(wall.drive, after), wall.drive, left, after)


@_wall.register(Translated)
def _(wall, last, left, after):
    return Drifting(wall.body, pose(wall.drive, left), pose(wall.drive, after), wall.drive, left, after)


_wall.register(Following, lambda wall, last, left, after: _with(last, wall.body))


@by_type
def _with(last, body):
    """Another wall in the place of one at an instant."""
    return


_with.register(Posed, lambda last, body: Posed(body, last.pose, last.end, last.drive, last.left, last.after))
_with.register(Drifting, lambda last, body: Drifting(body, last.pose, last.end, last.drive, last.left, last.after))


# --- The frame of a wall ---------------------------------------------------------------------------------


@by_type
def _back(turn, a):
    """A vector of the scene in the frame of the wall."""
    return a


@by_type
def _out(turn, a):
    """A vector of the frame of the wall in the scene."""
    return a


_back.register(Rows, lambda turn, a: turn.x * a.x + turn.y * a.y + turn.z * a.z)
_out.register(Rows, lambda turn, a: Vec(dot(turn.x, a), dot(turn.y, a), dot(turn.z, a)))


@by_type
def _place(turn, center, a):
    """c + A^T (a - c) of a point, less its displacement."""
    return a


@by_type
def _scene_place(turn, center, a):
    """c + A (a - c)"""
    return a


_place.register(Rows, lambda turn, center, a: center + _back(turn, a - center))
_scene_place.register(Rows, lambda turn, center, a: center + _out(turn, a - center))


@inlined
def own_place(surface, r):
    """A point in the frame of the wall, at the start of the step."""
    return _place(surface.pose.turn, surface.drive.center, r - surface.pose.shift)


@inlined
def own_end(surface, r):
    """A point in the frame of the wall, at its end."""
    return _place(surface.end.turn, surface.drive.center, r - surface.end.shift)


@inlined
def _arm(surface, r):
    """From the centre of the rotation to a point."""
    return r - surface.drive.center - surface.pose.shift


@by_type
def _carried_along(turn, spin, arm):
    """The velocity w x a of what the rotation moves."""
    return ZERO


@_carried_along.register(Rows)
def _(turn, spin, arm):
    return cross(spin, arm)


@inlined
def _frame_velocity(surface, r):
    """The velocity of the frame of the wall at a point."""
    return surface.pose.velocity + _carried_along(surface.pose.turn, surface.drive.spin, _arm(surface, r))


@by_type
def _fictitious(turn, spin, arm, w):
    """The accelerations of a rotating frame, -2 w x v - w x (w x a)."""
    return ZERO


@_fictitious.register(Rows)
def _(turn, spin, arm, w):
    return -1.0 * (2.0 * cross(spin, w) + cross(spin, cross(spin, arm)))


@inlined
def _relative_pull(surface, r, w, pull):
    """The acceleration of a free particle with the relative velocity w in the frame of the wall."""
    given = _fictitious(surface.pose.turn, surface.drive.spin, _arm(surface, r), w)
    return _back(surface.pose.turn, pull - surface.pose.acceleration + given)


@by_type
def _surface_velocity(spin, surface, r):
    return surface.pose.velocity


@_surface_velocity.register(Vec)
def _(spin, surface, r):
    return surface.pose.velocity + cross(spin, _arm(surface, r))


@inlined
def in_frame(surface, r, v):
    """The velocity of a particle in the frame of the wall."""
    return _back(surface.pose.turn, v - _frame_velocity(surface, r))


@by_type
def arm_length(turn, surface, r):
    """The distance of a point from the centre of the rotation; 0 where there is none."""
    return 0.0


arm_length.register(Rows, lambda turn, surface, r: norm(_arm(surface, r)))


@inlined
def frame_pull(surface, r, v, pull):
    """The acceleration of a free particle in the frame of the wall."""
    return _relative_pull(surface, r, v - _frame_velocity(surface, r), pull)


contract.velocity.register(Posed, lambda surface, r: _surface_velocity(surface.drive.spin, surface, r))


@by_type
def _surface_acceleration(spin, surface, r):
    return surface.pose.acceleration


@_surface_acceleration.register(Vec)
def _(spin, surface, r):
    return surface.pose.acceleration + cross(spin, cross(spin, _arm(surface, r)))


contract.acceleration.register(Posed, lambda surface, r: _surface_acceleration(surface.drive.spin, surface, r))


@by_type
def _carried_to(spin, surface, r):
    return surface.end.shift - surface.pose.shift + r


@_carried_to.register(Vec)
def _(spin, surface, r):
    rate = norm(spin)
    k = spin / select(rate > 0.0, rate, 1.0)
    angle, arm = rate * (surface.left - surface.after), _arm(surface, r)
    half = math.sin(0.5 * angle)
    turned = arm + (2.0 * half * half) * (dot(k, arm) * k - arm) + math.sin(angle) * cross(k, arm)
    return surface.drive.center + surface.end.shift + turned


contract.carry.register(Posed, lambda surface, r: _carried_to(surface.drive.spin, surface, r))
contract.pace.register(Posed, lambda surface: surface.drive.pace)


# The mean of a velocity over a step, not the difference of two places over its length: of a short step that has no
# digits left, and a particle that friction stops takes ever shorter ones.


@by_type
def _mean_of_swings(swings, middle, h):
    """Of C (cos w t - 1) + S sin w t: w sinc(w h/2) (S cos w m - C sin w m) at the middle m."""
    return ZERO


@_mean_of_swings.register(Chain)
def _(swings, middle, h):
    one = swings.first
    angle = one.rate * middle
    here = one.sine * math.cos(angle) - one.cosine * math.sin(angle)
    return _mean_of_swings(swings.rest, middle, h) + (one.rate * _sinc(0.5 * one.rate * h)) * here


@inlined
def _sinc(x):
    return select(abs(x) > 0.0, math.sin(x) / select(abs(x) > 0.0, x, 1.0), 1.0)


@by_type
def _mean_of_track(track, middle, h):
    """By Simpson's rule, exact within a piece."""
    return ZERO


@_mean_of_track.register(Track)
def _(track, middle, h):
    _d, first, _a = _tracked(track, middle - 0.5 * h)
    _d, second, _a = _tracked(track, middle)
    _d, third, _a = _tracked(track, middle + 0.5 * h)
    return (first + 4.0 * second + third) * (1.0 / 6.0)


@by_type
def _mean_of_turn(turn, surface, r0, r1, h):
    """(A1 - A0) rho/h of the mean of both ends in the frame of the wall: w sinc(w h/2) k x A(m) rho."""
    return ZERO


@_mean_of_turn.register(Turn)
def _(turn, surface, r0, r1, h):
    mean = 0.5 * (own_place(surface, r0) + own_end(surface, r1)) - surface.drive.center
    middle = _turned(turn, -0.5 * (surface.left + surface.after))
    return (turn.rate * _sinc(0.5 * turn.rate * h)) * cross(turn.axis, _out(middle, mean))


@contract.mean_velocity.register(Posed)
def _(surface, r0, r1, h):
    drive, middle = surface.drive, -0.5 * (surface.left + surface.after)
    moved = drive.velocity + _mean_of_swings(drive.swings, middle, h) + _mean_of_track(drive.track, middle, h)
    return moved + _mean_of_turn(drive.turn, surface, r0, r1, h)


@by_type
def _halfway(turn, surface, n):
    """A normal of the frame of the wall, of a step, in the scene."""
    return n


@_halfway.register(Rows)
def _(turn, surface, n):
    # rho1 - rho0 = M^-1 (r1 - r0 - way) with M = (A0 + A1)/2, so n becomes M^-T n = M S^-2 n, where S is cos(a/2)
    # across the axis and 1 along it, with the angle a of the step.
    k = surface.drive.turn.axis
    half = math.sin(0.5 * surface.drive.turn.rate * (surface.left - surface.after))
    along = dot(k, n) * k
    n = along + (n - along) * (1.0 / (1.0 - half * half))
    return 0.5 * (_out(surface.pose.turn, n) + _out(surface.end.turn, n))


# --- Its functions ---------------------------------------------------------------------------------------


def _of(made: Any, *functions: Any) -> None:
    for function in functions:
        function.register(Posed, made(function))


_of(lambda f: lambda surface: f(surface.body), contract.flat, contract.chord_sweeps, contract.farthest_push)
_of(lambda f: lambda surface, q: f(surface.body, q), contract.gap_of, contract.level_of)
_of(lambda f: lambda surface, q0, q1: f(surface.body, q0, q1), contract.gap_slope)
_of(
    lambda f: lambda surface, r: f(surface.body, own_place(surface, r)),
    contract.phi, contract.inner, contract.distance, contract.gap_scale,
)  # fmt: skip
_of(
    lambda f: lambda surface, r: _out(surface.pose.turn, f(surface.body, own_place(surface, r))),
    contract.gradient, contract.slope, contract.unit_normal,
)  # fmt: skip


@contract.settle.register(Posed)
def _(surface, r):
    settled = contract.settle(surface.body, own_place(surface, r))
    return _scene_place(surface.pose.turn, surface.drive.center, settled) + surface.pose.shift


@contract.outward_acceleration.register(Posed)
def _(surface, r, v, pull):
    own_v = in_frame(surface, r, v)
    return contract.outward_acceleration(surface.body, own_place(surface, r), own_v, frame_pull(surface, r, v, pull))


_of(
    lambda f: (
        lambda surface, r0, r1: _halfway(
            surface.pose.turn, surface, f(surface.body, own_place(surface, r0), own_end(surface, r1))
        )
    ),
    contract.inner_gradient,
)


@contract.step_normal.register(Posed)
def _(surface, r0, r1):
    n = contract.step_normal(surface.body, own_place(surface, r0), own_end(surface, r1))
    return _unit(surface.pose.turn, _halfway(surface.pose.turn, surface, n))


@by_type
def _unit(turn, n):
    return n


@_unit.register(Rows)
def _(turn, n):
    return n / norm(n)


@by_type
def rising(surface, n, r, v):
    """The speed of a particle along the normal n of a wall, relative to it."""
    return dot(n, v)


rising.register(Posed, lambda surface, n, r, v: dot(n, v - contract.velocity(surface, r)))


@by_type
def straight_hit(surface, end, r0, r1):
    """When a straight way from r0 at one instant to r1 at another meets a wall, which is `end` there."""
    return contract.first_hit(surface, r0, r1 - r0)


@straight_hit.register(Posed)
def _(surface, end, r0, r1):
    own = own_place(surface, r0)
    return contract.first_hit(surface.body, own, own_place(end, r1) - own)


# --- Flight ----------------------------------------------------------------------------------------------

contract.is_quartic.register(Drifting, lambda surface: contract.is_quartic(surface.body))
contract.may_be_far.register(Drifting, lambda surface: contract.may_be_far(surface.body))


@contract.first_hit.register(Drifting)
def _(surface, r, v):
    return contract.first_hit(surface.body, r - surface.pose.shift, v - surface.pose.velocity)


@contract.falling_hit.register(Drifting)
def _(surface, r, v, pull):
    return contract.falling_hit(surface.body, r - surface.pose.shift, v - surface.pose.velocity, pull)


@contract.course.register(Drifting)
def _(surface, r, v, pull):
    return contract.course(surface.body, r - surface.pose.shift, v - surface.pose.velocity, pull)


@contract.safe_time.register(Drifting)
def _(surface, r, v, pull):
    return contract.safe_time(surface.body, r - surface.pose.shift, v - surface.pose.velocity, pull)

"""How a wall moves: its motion as kernels take it in one frame, and where it is at one instant.

A wall xi of the frame is at x = c + d + A (xi - c), with the displacement d(t) and the rotation A(t) about c. Times
count back from the end of the frame under way, so that they have the digits of a frame and not those of the run.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from .. import motion as motions
from ..kernel.angle import sine_and_versine
from ..kernel.jit import Array, by_type, inlined
from ..kernel.vector import ZERO, Vec, cross, dot, vec
from .fold import Chain
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
    late: float  # its fastest speed times the time [m], which the round-off of its place is relative to
    jerks: Vec  # bounds of the components of d''' [m/s^3]


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


# --- From a description ----------------------------------------------------------------------------------


def drive_of(surface: Surface, moment: float) -> Drive:
    """The motion of a surface in the frame that ends at a moment [s]."""
    # A guide says how impacts move a wall, which is at rest before.
    parts = [one for one in motions.parts_of(surface.motion) if not isinstance(one, motions.Guide)]
    velocity, swings, track, turn, spin, center = np.zeros(3), None, None, None, None, ZERO
    fastest = hardest = jerk = 0.0
    pace, jerks = math.inf, np.zeros(3)
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
            jerks += np.abs(one.amplitude) * led.rate**3
        elif isinstance(one, motions.Path):
            cubics = one.cubics()
            track = Track(np.array(one.times), cubics, _vector(one.displacement(moment)), moment)
            # Within a piece the velocity is largest at an end or where the second derivative is 0.
            h = np.diff(one.times)
            pace = min(pace, _SLOW * float(h.min()))
            ends = cubics[1], cubics[1] + h * (2.0 * cubics[2] + 3.0 * h * cubics[3])
            bends = 2.0 * cubics[2], 2.0 * cubics[2] + 6.0 * h * cubics[3]
            jerk += float(6.0 * np.sqrt((cubics[3] ** 2).sum(axis=0)).max())
            jerks += 6.0 * np.abs(cubics[3]).max(axis=1)
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
    bounds = fastest, hardest, jerk, pace, fastest * moment, _vector(jerks)
    return Drive(_vector(shift), _vector(velocity), swings, track, turn, spin, center, *bounds)


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
    s, versine = sine_and_versine(one.rate * t)
    c = 1.0 - versine
    return (
        d + one.sine * s - one.cosine * versine,
        v + one.rate * (one.sine * c - one.cosine * s),
        a - (one.rate * one.rate) * (one.sine * s + one.cosine * c),
    )


@by_type
def tracked(track, t):
    """What a spline adds."""
    return ZERO, ZERO, ZERO


@tracked.register(Track)
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
def turned(turn, t):
    """The rows of A."""
    return


@turned.register(Turn)
def _(turn, t):
    # A(t) = A R, with the rotation R about the same axis: the rows of A, turned back.
    s, versine = sine_and_versine(turn.rate * t)
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
    e, w, b = tracked(drive.track, t)
    return Pose(drive.shift + t * drive.velocity + d + e, drive.velocity + v + w, a + b, turned(drive.turn, t))

"""The motion of a wall in one frame, as a record for kernels, and its pose at one instant.

A point xi of the wall's frame is at x = c + d + A (xi - c), with the displacement d(t) and the rotation A(t) about c.
Times count back from the end of the current frame, so that they have the digits of a frame and not those of the run.
"""

import math
from typing import Any

import numpy as np

from ... import motion as motions
from ...kernel.arrays import index
from ...kernel.elementary import sine_and_versine
from ...kernel.jit import Array, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, cross, dot, square, vec
from ..surface import Surface

# A motion changes little in this part of a radian, or of a piece of a path.
_SLOW = 0.05
# Up to this angle a, a^4/24 is round-off.
LITTLE_ANGLE = (24.0 * EPSILON) ** 0.25


class RotationRows(Record):
    """The rows of the matrix of a rotation A."""

    x: Vec
    y: Vec
    z: Vec

    def out(self, a):
        """Return A a."""
        return Vec(dot(self.x, a), dot(self.y, a), dot(self.z, a))

    def back(self, a):
        """Return A^T a."""
        return self.x * a.x + self.y * a.y + self.z * a.z


class PoseDerivatives(Record):
    """The pose of a wall at one instant: d, d', d'' and the rows of A, or None."""

    shift: Vec
    velocity: Vec
    acceleration: Vec
    turn: Any

    def out(self, a):
        """Return a direction of the frame of the wall in the scene."""
        return a if self.turn is None else self.turn.out(a)

    def back(self, a):
        """Return a direction of the scene in the frame of the wall."""
        return a if self.turn is None else self.turn.back(a)

    def place_out(self, center, r):
        """Return a point of the frame of the wall in the scene: c + d + A (r - c)."""
        return (r if self.turn is None else center + self.turn.out(r - center)) + self.shift

    def place_back(self, center, r):
        """Return a point of the scene in the frame of the wall."""
        r = r - self.shift
        return r if self.turn is None else center + self.turn.back(r - center)


class Wave(Record):
    """The sine and the versine of the angle of a swing, or of a rotation, at one instant."""

    sine: float
    versine: float

    def later(self, angle):
        """Return the wave of an angle that is larger by at most `LITTLE_ANGLE`, without another sine."""
        cosine, versine = 1.0 - self.versine, 0.5 * (angle * angle)
        sine = angle - angle * versine * (1.0 / 3.0)
        return Wave(
            self.sine + (cosine * sine - self.sine * versine), self.versine + (self.sine * sine + cosine * versine)
        )


def wave_of(angle):
    """Return the `Wave` of an angle."""
    return Wave(*sine_and_versine(angle))


class Swing(Record):
    """C (cos(w t) - 1) + S sin(w t), with the time t since the end of the frame."""

    cosine: Vec
    sine: Vec
    rate: float

    def at(self, wave):
        """Return its displacement and the first two derivatives, from the `Wave` of its angle."""
        s, versine = wave
        c = 1.0 - versine
        return (
            self.sine * s - self.cosine * versine,
            self.rate * (self.sine * c - self.cosine * s),
            -(self.rate * self.rate) * (self.sine * s + self.cosine * c),
        )

    def amplitude(self):
        """Return the largest |C cos a + S sin a|."""
        c, s, both = square(self.cosine), square(self.sine), dot(self.cosine, self.sine)
        half = 0.5 * (c - s)
        return math.sqrt(0.5 * (c + s) + math.sqrt(half * half + both * both))

    def mean_velocity(self, middle, h):
        """Return w sinc(w h/2) (S cos w m - C sin w m) over a time h around the middle m."""
        angle = self.rate * middle
        here = self.sine * math.cos(angle) - self.cosine * math.sin(angle)
        return (self.rate * _sinc(0.5 * self.rate * h)) * here


class Swings(Record):
    """All swings of a motion, s(t) = sum_k C_k (cos - 1) + S_k sin relative to their middle, and their bounds.

    |s|^2 + |s'|^2/w^2 of one swing is |C|^2 + |S|^2 = Q^2 at any time.
    """

    each: tuple[Any, ...]

    def turned(self, vector_in):
        """Return the swings in a frame that is turned."""
        return Swings(tuple(Swing(vector_in(one.cosine), vector_in(one.sine), one.rate) for one in self.each))

    def amplitude(self):
        """Return a bound of |s|."""
        found = 0.0
        for swing in self.each:
            found += swing.amplitude()
        return found

    def along(self, n):
        """Return bounds of |n.s| and |n.s'|."""
        amplitude = speed = 0.0
        for swing in self.each:
            c, s = dot(n, swing.cosine), dot(n, swing.sine)
            mine = math.sqrt(c * c + s * s)
            amplitude, speed = amplitude + mine, speed + abs(swing.rate) * mine
        return amplitude, speed

    def moments(self):
        """Return sum_k Q_k w_k^p for p = 0 to 3."""
        found = 0.0, 0.0, 0.0, 0.0
        for swing in self.each:
            rate, mine = abs(swing.rate), math.sqrt(square(swing.cosine) + square(swing.sine))
            first = rate * mine
            second = rate * first
            found = found[0] + mine, found[1] + first, found[2] + second, found[3] + rate * second
        return found


class Track(Record):
    """A spline: d(t) less its value at the end of the frame, which is at the time `now`."""

    times: Array  # (knots,)
    cubics: Array  # (4, 3, pieces)
    end: Vec
    now: float
    often: float  # the mean number of pieces in a second
    piece: Any = None  # the piece at the instant of evaluation, if it is known

    def piece_at(self, t):
        """Return the piece at a time."""
        now, last = self.now + t, self.times.size - 2
        # The guess is right for pieces of one length.
        guess = int(min(max((now - self.times[0]) * self.often, 0.0), float(last)))
        if self.times[guess] <= now < self.times[guess + 1]:
            return guess
        # Without a branch: no processor predicts which half of the rest it is in.
        low, rest = 0, last + 1
        while rest > 1:
            half = rest // 2
            low = select(self.times[low + half] <= now, low + half, low)
            rest -= half
        return low

    def at(self, t):
        """Return its value and first two derivatives."""
        low = index(self.piece_at(t) if self.piece is None else self.piece)
        s, cubics = self.now + t - self.times[low], self.cubics
        a, b, c, d = (Vec(cubics[k, 0, low], cubics[k, 1, low], cubics[k, 2, low]) for k in range(4))
        return (
            (a - self.end) + s * (b + s * (c + s * d)),
            b + s * (2.0 * c + (3.0 * s) * d),
            2.0 * c + (6.0 * s) * d,
        )

    def mean_velocity(self, middle, h):
        """Return the mean velocity by Simpson's rule, exact within a piece."""
        first, second, third = self.at(middle - 0.5 * h)[1], self.at(middle)[1], self.at(middle + 0.5 * h)[1]
        return (first + 4.0 * second + third) * (1.0 / 6.0)


class Turn(Record):
    """The rotation about an axis through the centre: the rows of A at the end of the frame, and the rate [rad/s]."""

    x: Vec
    y: Vec
    z: Vec
    axis: Vec
    rate: float

    def at(self, wave):
        """Return the rows of A, from the `Wave` of its angle."""
        # A(t) = A R, with the rotation R about the same axis: the rows of A, turned back.
        s, versine = wave
        k = self.axis
        # row cos a + (1 - cos a) k (k.row) - sin a k x row
        return RotationRows(
            *(row + versine * (dot(k, row) * k - row) - s * cross(k, row) for row in (self.x, self.y, self.z))
        )

    def mean_velocity(self, middle, h, arm):
        """Return (A1 - A0) rho/h of an arm rho in the frame of the wall: w sinc(w h/2) k x A(m) rho."""
        turned = self.at(wave_of(self.rate * middle)).out(arm)
        return (self.rate * _sinc(0.5 * self.rate * h)) * cross(self.axis, turned)


def _sum(some, others):
    """Return the sums of a displacement and its derivatives; None is 0, and costs a lane no addition."""
    if some is None or others is None:
        return others if some is None else some
    return tuple(b if a is None else a + b for a, b in zip(some, others, strict=True))


def _sinc(x):
    return select(abs(x) > 0.0, math.sin(x) / select(abs(x) > 0.0, x, 1.0), 1.0)


class Drive(Record):
    """The motion of a wall in one frame, as a record for kernels."""

    # A motion without one of these parts adds no zeros in lanes.
    shift: Any  # d at the end of the frame, or None
    velocity: Any  # velocity of the translation, or None
    swings: tuple[Any, ...]  # each a `Swing`
    track: Any  # None or `Track`
    turn: Any  # None or `Turn`; None also if the rotation leaves the surface unchanged
    spin: Any  # the angular velocity, or None
    center: Vec
    fastest: float  # bound of |d'| [m/s]
    hardest: float  # bound of |d''| [m/s^2]
    jerk: float  # bound of |d'''| [m/s^3]
    time_scale: float  # a time in which it changes little [s]
    late: float  # its largest speed times the time [m], the scale of the round-off of its place
    jerks: Vec  # bounds of the components of d''' [m/s^3]
    waves: Any = None  # the waves at the instant of evaluation, if they are known: see `waves_at`

    def rates(self):
        """Return the rate of each angle: of the swings, then of the rotation."""
        rates = tuple(swing.rate for swing in self.swings)
        return rates if self.turn is None else (*rates, self.turn.rate)

    def waves_at(self, remaining):
        """Return the `Wave` of each angle when `remaining` is left of the frame [s]."""
        return tuple(wave_of(rate * -remaining) for rate in self.rates())

    def on_piece(self, piece):
        """Return the motion at one instant, at which a path is on this piece."""
        return self if self.track is None else self._replace(track=self.track._replace(piece=piece))

    def pose(self, remaining):
        """Return the `PoseDerivatives` when `remaining` is left of the frame [s]."""
        waves = self.waves_at(remaining) if self.waves is None else self.waves
        turn = None if self.turn is None else self.turn.at(waves[len(self.swings)])
        swung: Any = None
        for k, swing in enumerate(self.swings):
            swung = _sum(swung, swing.at(waves[k]))
        moved = _sum((self.middle(-remaining), self.velocity, None), swung)
        if self.track is not None:
            moved = _sum(moved, self.track.at(-remaining))
        return PoseDerivatives(*(ZERO if one is None else one for one in moved), turn)

    def mean_velocity(self, middle, h):
        """Return the mean of d' over a time h around the middle."""
        # Not the difference of two places over the time: for a short step it has no digits left, and a particle that
        # friction stops takes ever shorter ones.
        swings = ZERO
        for swing in self.swings:
            swings = swings + swing.mean_velocity(middle, h)
        steady = ZERO if self.velocity is None else self.velocity
        return steady + swings + (ZERO if self.track is None else self.track.mean_velocity(middle, h))

    def middle(self, t):
        """Return its displacement without swings and spline at a time since the end of the frame, or None."""
        return self.shift if self.velocity is None else self.shift + t * self.velocity

    def swing_center(self, t):
        """Return its displacement without swings at a time since the end of the frame, if it has no other motion."""
        middle = self.middle(t)
        for swing in self.swings:
            middle = middle - swing.cosine
        return middle

    def passage(self, body, r, v, remaining):
        """Return the `Passage` of a straight flight through the core of a surface, with `remaining` left of the frame.

        None if the surface has no core, or has other motions than swings.
        """
        if not self.only_swings() or not body.has_core:
            return None
        w = v if self.velocity is None else v - self.velocity
        return body.passage(r - self.swing_center(-remaining), w, Swings(self.swings))

    def only_swings(self):
        """Whether its motion is uniform except for swings."""
        return self.turn is None and self.track is None

    def angular_speed(self):
        """Return the angular speed of the surface [rad/s]."""
        return 0.0 if self.turn is None else abs(self.turn.rate)


# --- From a description ----------------------------------------------------------------------------------


def drive_of(surface: Surface, moment: float) -> Drive:
    """Return the motion of a surface in the frame that ends at a moment [s]."""
    # A guide describes how impacts move a wall, which is at rest before.
    parts = [one for one in motions.parts_of(surface.motion) if not isinstance(one, motions.Guide)]
    velocity, track, turn, spin, center = None, None, None, None, ZERO
    harmonics: list[motions.Led] = []
    shift = motions.pose(surface.motion, moment).shift
    fastest = hardest = jerk = 0.0
    time_scale, jerks = math.inf, np.zeros(3)
    for one in parts:
        if isinstance(one, motions.Translation):
            velocity = np.array(one.velocity) + (0.0 if velocity is None else velocity)
        elif isinstance(one, motions.Oscillation):
            harmonics.append(one.harmonic((0.0, 0.0, 0.0)))
        elif isinstance(one, motions.Path):
            cubics = one.cubics
            often = (len(one.knots) - 1) / float(one.knots[-1] - one.knots[0])
            track = Track(one.knots, cubics, _vector(one.displacement(moment)), moment, often)
            h, moves = np.diff(one.knots), cubics[1:].any(axis=(0, 1))
            time_scale = min(time_scale, _SLOW * float(h[moves].min(initial=math.inf)))
            # The velocity of each half of a piece lies within the triangle of the control points of its Bezier form.
            first, last = cubics[1], cubics[1] + h * (2.0 * cubics[2] + 3.0 * h * cubics[3])
            between = cubics[1] + h * cubics[2]
            left, right = 0.5 * (first + between), 0.5 * (between + last)
            controls = first, left, 0.5 * (left + right), right, last
            bends = 2.0 * cubics[2], 2.0 * cubics[2] + 6.0 * h * cubics[3]
            jerk += float(6.0 * np.sqrt((cubics[3] ** 2).sum(axis=0)).max())
            jerks += 6.0 * np.abs(cubics[3]).max(axis=1)
            hardest += float(max(np.sqrt((bend**2).sum(axis=0)).max() for bend in bends))
            fastest += float(max(np.sqrt((control**2).sum(axis=0)).max() for control in controls))
        else:
            axis = motions.unit_axis(one)
            direction, center, spin = tuple(axis.tolist()), _vector(one.center), _vector(one.rate * axis)
            time_scale = min(time_scale, _SLOW / abs(one.rate)) if one.rate else time_scale
            if surface.is_unturned_by(direction, one.center):
                continue
            about = surface.turning_center(direction) if one.rate else None
            if about is None:
                x, y, z = map(vec, motions.pose(one, moment).turn.tolist())
                turn = Turn(x, y, z, _vector(axis), one.rate)
            else:
                # It moves along a circle, and turns about its own centre, which leaves it unchanged.
                circle = one.harmonic(about)
                harmonics.append(circle)
                center, shift = _vector(about), shift + circle.position(moment) - circle.start
    swings = tuple(_swing(led, moment) for led in harmonics)
    for swing, led in zip(swings, harmonics, strict=True):
        amplitude, rate = swing.amplitude(), abs(led.rate)
        time_scale = min(time_scale, _SLOW / rate)
        fastest += amplitude * rate
        hardest += amplitude * rate**2
        jerk += amplitude * rate**3
        jerks += np.hypot(led.cosine, led.sine) * rate**3
    fastest += math.hypot(*(() if velocity is None else velocity))
    bounds = fastest, hardest, jerk, time_scale, fastest * moment, _vector(jerks)
    at_end = None if turn is not None and len(parts) == 1 else shift
    return Drive(*map(_vector_or_none, (at_end, velocity)), swings, track, turn, spin, center, *bounds)


def _swing(led: motions.Led, moment: float) -> Swing:
    """Return the swing of a led motion, in the frame that ends at a moment [s]."""
    c, s = math.cos(led.rate * moment), math.sin(led.rate * moment)
    # C cos(a + b) + S sin(a + b), with the angle a at the end of the frame
    return Swing(_vector(c * led.cosine + s * led.sine), _vector(c * led.sine - s * led.cosine), led.rate)


def _vector(values: Any) -> Vec:
    return vec(np.asarray(values, np.float64).tolist())


def _vector_or_none(values: Any) -> Vec | None:
    return None if values is None else _vector(values)

"""A wall that turns about an axis, and whose weight turns it: theta'' = -k sin(theta - rest).

From one lease to the next the angle is its Taylor polynomial. Its radius of convergence is above 1/(sqrt(k) + |rate|),
of which a lease lasts a part so small that the last term is round-off.
"""

import math
from typing import Any, NamedTuple

from ..kernel.jit import index, inlined
from ..kernel.vector import ZERO, Vec, cross, dot, norm
from ..surfaces.drive import Drive, Pose, Turn
from ..surfaces.moving import Driven
from ..surfaces.posed import Posed
from .freedoms import arm_of, drive_of, mobility, pose_of, posed, push, renew, rows_about, stays

# Terms of the polynomial, and the part of the radius that it is for.
TERMS, _PART = 17, 0.1


class Pendulum(NamedTuple):
    """A wall on an axis, and what gravity does to it."""

    row: int
    lightness: float  # 1/I
    axis: Vec
    center: Vec
    stiffness: float  # k [1/s^2]
    rest: float  # the angle at which it hangs [rad]


class Swaying(Driven):
    """A pendulum as flights meet it, from a time on."""

    body: Any
    drive: Drive  # what bounds its motion
    freedom: Pendulum
    walls: Any
    start: float

    def seen(self, flight, t):
        """A particle as safe steps to the pendulum see it."""
        freedom, walls, time = self.freedom, self.walls, self.start + t
        now = posed(freedom, self.body, walls, time)
        euler = angle_at(freedom, walls, time).acceleration * cross(freedom.axis, arm_of(freedom, flight.place(t)))
        return flight.seen(t, now, flight.pull - euler)._replace(drive=self.drive)


# --- The angle -------------------------------------------------------------------------------------------


@inlined
def expand(freedom, walls):
    """The Taylor coefficients of theta, sin(theta - rest) and cos(theta - rest) from where the wall is now."""
    k, series = index(freedom.row), walls.series
    sines, cosines = TERMS, 2 * TERMS
    series[0, k], series[1, k] = walls.angle[k], walls.rate[k]
    away = walls.angle[k] - freedom.rest
    series[sines, k], series[cosines, k] = math.sin(away), math.cos(away)
    for n in range(TERMS - 2):
        # (n + 1)(n + 2) theta_n+2 = -k s_n
        series[n + 2, k] = -freedom.stiffness * series[sines + n, k] / ((n + 1) * (n + 2))
        # (n + 1) s_n+1 = sum (j + 1) theta_j+1 c_n-j, and the same of the cosine
        s, c = 0.0, 0.0
        for j in range(n + 1):
            slope = (j + 1) * series[j + 1, k]
            s += slope * series[cosines + n - j, k]
            c -= slope * series[sines + n - j, k]
        series[sines + n + 1, k], series[cosines + n + 1, k] = s / (n + 1), c / (n + 1)


class Angle(NamedTuple):
    """The angle and its first two derivatives."""

    angle: float
    rate: float
    acceleration: float


@inlined
def angle_at(freedom, walls, t):
    """The `Angle` at a time of the frame, by Horner's scheme."""
    k = index(freedom.row)
    t = t - walls.time[k]
    angle, rate, half = 0.0, 0.0, 0.0
    for n in range(TERMS - 1, -1, -1):
        half = half * t + rate
        rate = rate * t + angle
        angle = angle * t + walls.series[n, k]
    return Angle(angle, rate, 2.0 * half)


# --- As of any wall that reacts --------------------------------------------------------------------------


@pose_of.register(Pendulum)
def _(freedom, walls, t):
    return Pose(ZERO, ZERO, ZERO, rows_about(freedom.axis, angle_at(freedom, walls, t).angle))


@drive_of.register(Pendulum)
def _(freedom, walls, t):
    spin = angle_at(freedom, walls, t).rate * freedom.axis
    return Drive(ZERO, ZERO, None, None, None, spin, freedom.center, 0.0, 0.0, 0.0, math.inf, 0.0, ZERO)


@posed.register(Pendulum)
def _(freedom, body, walls, t):
    here = pose_of(freedom, walls, t)
    return Posed(body, here, here, drive_of(freedom, walls, t), 0.0, 0.0)


arm_of.register(Pendulum, lambda freedom, r: r - freedom.center)


@inlined
def _lever(freedom, n, arm):
    return dot(cross(arm, n), freedom.axis)


@mobility.register(Pendulum)
def _(freedom, n, arm):
    lever = _lever(freedom, n, arm)
    return freedom.lightness * lever * lever


@push.register(Pendulum)
def _(freedom, walls, t, impulse, arm):
    k, here = index(freedom.row), angle_at(freedom, walls, t)
    walls.angle[k], walls.rate[k] = here.angle, here.rate + freedom.lightness * _lever(freedom, impulse, arm)
    walls.time[k] = t
    expand(freedom, walls)


@renew.register(Pendulum)
def _(freedom, walls, t):
    push(freedom, walls, t, ZERO, ZERO)
    k = index(freedom.row)
    walls.turning[k] = walls.rate[k]
    _extend(freedom, walls)


@stays.register(Pendulum)
def _(freedom, walls):
    k = index(freedom.row)
    _extend(freedom, walls)
    return abs(walls.rate[k] - walls.turning[k]) < walls.width[k]


@inlined
def _extend(freedom, walls):
    """The lease lasts as long as the weight leaves the rate in it, and the polynomial is good."""
    k, most = index(freedom.row), freedom.stiffness
    left = (walls.width[k] - abs(walls.rate[k] - walls.turning[k])) / most
    walls.until[k] = walls.time[k] + min(left, _PART / (math.sqrt(most) + abs(walls.rate[k])))


# --- Flights to it ---------------------------------------------------------------------------------------


@inlined
def swaying(freedom, body, walls, flight, longest):
    """The wall as safe steps of a flight know it, for so long [s]."""
    k, stiffness = index(freedom.row), freedom.stiffness
    # rate^2/2 - k cos(theta - rest) is constant.
    fastest = math.sqrt(walls.rate[k] * walls.rate[k] + 4.0 * stiffness)
    speed = norm(flight.v) + longest * norm(flight.pull)
    arm = norm(arm_of(freedom, flight.r)) + longest * speed
    # Of A^T x: theta'' x, and theta''' x + 3 theta'' (x' + theta' x)
    hard, jerk = stiffness * arm, stiffness * (4.0 * fastest * arm + 3.0 * speed)
    turn, jerks = Turn(ZERO, ZERO, ZERO, freedom.axis, fastest), Vec(jerk, jerk, jerk)
    bounds = Drive(ZERO, ZERO, None, None, turn, ZERO, freedom.center, 0.0, hard, jerk, math.inf, 0.0, jerks)
    return Swaying(body, bounds, freedom, walls, flight.time)

"""Walls that turn about an axis: freely, or by their weight, as theta'' = -k sin(theta - rest).

Within a lease the angle of a pendulum is its Taylor polynomial. The radius of convergence is above
1/(sqrt(k) + |rate|), and a lease lasts for a part of it so small that the last term is round-off.
"""

import math
from typing import Any, NamedTuple

from ...kernel.arrays import index
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, cross, dot, norm
from ...surfaces.in_motion.drive import Drive, PoseDerivatives, RotationRows, Turn
from ...surfaces.in_motion.posed import Posed
from ...surfaces.time_of_impact.course import rise_time
from .freedoms import Freedom, exact_sum, march

# The terms of the polynomial, and the part of the radius of convergence in which it is used.
TERMS, _PART = 17, 0.1


class Turning(Freedom):
    """A wall that turns about an `axis` through a `center`."""

    def arm(self: Any, r):
        return r - self.center

    def lever(self: Any, n, arm):
        """The lever of an impulse along n at the end of the arm."""
        return dot(cross(arm, n), self.axis)

    def along(self: Any, arm):
        return cross(self.axis, arm)

    def mobility(self: Any, n, arm):
        lever = self.lever(n, arm)
        return self.lightness * lever * lever

    def begin_lease(self: Any, walls, t):
        k = index(self.row)
        walls.turning[k] = walls.rate[k]

    def away(self: Any, walls):
        k = index(self.row)
        return abs(walls.rate[k] - walls.turning[k])

    def reach(self: Any, body, walls, flight):
        # No point of the wall within |arm| + clearance of the axis is faster than the rate times that distance.
        k = index(self.row)
        arm, turn = self.arm(flight.r), self.pose(walls, flight.time).turn
        own = self.center + turn.x * arm.x + turn.y * arm.y + turn.z * arm.z
        clear = max(body.far(own), 0.0)
        fastest = (abs(walls.turning[k]) + walls.width[k]) * (norm(arm) + clear) + norm(flight.v)
        return rise_time(-clear, 0.5 * fastest, 0.5 * norm(flight.pull))


class Hinged(Turning):
    """A wall that turns about an axis through its centre of mass."""

    row: int
    lightness: float
    axis: Vec
    center: Vec

    def pose(self, walls, t):
        k = index(self.row)
        angle = walls.angle[k] + walls.rate[k] * (t - walls.time[k])
        return PoseDerivatives(ZERO, ZERO, ZERO, rows_about(self.axis, angle))

    def drive(self, walls, t):
        rate, turn = walls.rate[index(self.row)], self.pose(walls, t).turn
        turning, spin = Turn(turn.x, turn.y, turn.z, self.axis, rate), rate * self.axis
        return Drive(ZERO, ZERO, (), None, turning, spin, self.center, 0.0, 0.0, 0.0, math.inf, 0.0, ZERO)

    def push(self, walls, t, impulse, arm):
        k = index(self.row)
        walls.angle[k] += walls.rate[k] * (t - walls.time[k])
        change = self.lightness * self.lever(impulse, arm)
        walls.rate[k], walls.rate_rest[k] = exact_sum(walls.rate[k], change + walls.rate_rest[k])
        walls.time[k] = t

    def keeps(self, walls, more):
        return math.inf


def rows_about(axis, angle):
    """The rows of the rotation about an axis by an angle (Rodrigues)."""
    a, c, s = axis, math.cos(angle), math.sin(angle)
    b = 1.0 - c
    return RotationRows(
        Vec(c + b * a.x * a.x, b * a.x * a.y - s * a.z, b * a.x * a.z + s * a.y),
        Vec(b * a.y * a.x + s * a.z, c + b * a.y * a.y, b * a.y * a.z - s * a.x),
        Vec(b * a.z * a.x - s * a.y, b * a.z * a.y + s * a.x, c + b * a.z * a.z),
    )


class Swaying(Record):
    """A pendulum as safe steps of flights take it, from a time on."""

    body: Any
    drive: Drive  # the bounds of its motion
    freedom: Any
    walls: Any
    start: float

    accelerates = True

    def count(self):
        """The number of walls of a field."""
        return self.body.count()

    def seen(self, flight, t):
        """A particle in the frame of the pendulum, for safe steps."""
        freedom, walls, time = self.freedom, self.walls, self.start + t
        now = freedom.posed(self.body, walls, time)
        euler = freedom.angle(walls, time).acceleration * cross(freedom.axis, freedom.arm(flight.place(t)))
        return flight.seen(t, now, (ZERO if flight.pull is None else flight.pull) - euler)._replace(drive=self.drive)


class Angle(NamedTuple):
    """The angle and its first two derivatives."""

    angle: float
    rate: float
    acceleration: float


class Pendulum(Turning):
    """A wall on an axis, with the stiffness that gravity gives it."""

    row: int
    lightness: float  # 1/I
    axis: Vec
    center: Vec
    stiffness: float  # k [1/s^2]
    rest: float  # the angle at which it hangs [rad]

    def expand(self, walls):
        """Set the Taylor coefficients of theta, sin(theta - rest) and cos(theta - rest) about the present angle."""
        k, series = index(self.row), walls.series
        sines, cosines = TERMS, 2 * TERMS
        series[0, k], series[1, k] = walls.angle[k], walls.rate[k]
        away = walls.angle[k] - self.rest
        series[sines, k], series[cosines, k] = math.sin(away), math.cos(away)
        for n in range(TERMS - 2):
            # (n + 1)(n + 2) theta_n+2 = -k s_n
            series[n + 2, k] = -self.stiffness * series[sines + n, k] / ((n + 1) * (n + 2))
            # (n + 1) s_n+1 = sum (j + 1) theta_j+1 c_n-j, and (n + 1) c_n+1 = -sum (j + 1) theta_j+1 s_n-j
            s, c = 0.0, 0.0
            for j in range(n + 1):
                slope = (j + 1) * series[j + 1, k]
                s += slope * series[cosines + n - j, k]
                c -= slope * series[sines + n - j, k]
            series[sines + n + 1, k], series[cosines + n + 1, k] = s / (n + 1), c / (n + 1)

    def angle(self, walls, t):
        """The `Angle` at a time of the frame, by Horner's scheme."""
        k = index(self.row)
        t = t - walls.time[k]
        angle, rate, half = 0.0, 0.0, 0.0
        for n in range(TERMS - 1, -1, -1):
            half = half * t + rate
            rate = rate * t + angle
            angle = angle * t + walls.series[n, k]
        return Angle(angle, rate, 2.0 * half)

    def pose(self, walls, t):
        return PoseDerivatives(ZERO, ZERO, ZERO, rows_about(self.axis, self.angle(walls, t).angle))

    def drive(self, walls, t):
        spin = self.angle(walls, t).rate * self.axis
        return Drive(ZERO, ZERO, (), None, None, spin, self.center, 0.0, 0.0, 0.0, math.inf, 0.0, ZERO)

    def posed(self, body, walls, t):
        here = self.pose(walls, t)
        return Posed(body, here, here, self.drive(walls, t), 0.0, 0.0)

    def push(self, walls, t, impulse, arm):
        k, here = index(self.row), self.angle(walls, t)
        walls.angle[k], walls.rate[k] = here.angle, here.rate + self.lightness * self.lever(impulse, arm)
        walls.time[k] = t
        self.expand(walls)

    def begin_lease(self, walls, t):
        self.push(walls, t, ZERO, ZERO)
        super().begin_lease(walls, t)

    def keeps(self, walls, more):
        # The weight changes the rate by at most k a second, and the polynomial is accurate in a part of its radius.
        most, rate = self.stiffness, walls.rate[index(self.row)]
        return min(more / most, _PART / (math.sqrt(most) + abs(rate)))

    def hit(self, body, gravity, walls, flight):
        # The flight is looked at again when the lease ends.
        longest = min(flight.longest, max(walls.until[index(self.row)] - flight.time, 0.0))
        return march(self.swaying(body, walls, flight, longest), flight, longest)

    def swaying(self, body, walls, flight, longest):
        """The wall with the bounds that safe steps of a flight need for `longest` [s]."""
        k, stiffness = index(self.row), self.stiffness
        # rate^2/2 - k cos(theta - rest) is constant.
        fastest = math.sqrt(walls.rate[k] * walls.rate[k] + 4.0 * stiffness)
        speed = norm(flight.v) + longest * norm(flight.pull)
        arm = norm(self.arm(flight.r)) + longest * speed
        # The derivatives of A^T x are bounded by those of theta'' x, and theta''' x + 3 theta'' (x' + theta' x).
        hard, jerk = stiffness * arm, stiffness * (4.0 * fastest * arm + 3.0 * speed)
        turn, jerks = Turn(ZERO, ZERO, ZERO, self.axis, fastest), Vec(jerk, jerk, jerk)
        bounds = Drive(ZERO, ZERO, (), None, turn, ZERO, self.center, 0.0, hard, jerk, math.inf, 0.0, jerks)
        return Swaying(body, bounds, self, walls, flight.time)

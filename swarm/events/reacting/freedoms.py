"""The degrees of freedom of reacting walls: freely without turning, along a guide, on a spring, about an axis.

Between two impacts the motion of a wall is known. A lease bounds the effect of impacts on it: until the wall leaves the
lease, its velocity stays within a width of a middle velocity, so that bounds of the times of far particles hold.
"""

import math
from typing import Any, NamedTuple

from ...kernel.arrays import index
from ...kernel.gravity import Gravity, as_vector
from ...kernel.jit import Array, select
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, column, dot, norm, put, square
from ...surfaces.fields.members import Members
from ...surfaces.in_motion.drive import Drive, PoseDerivatives, Swing
from ...surfaces.in_motion.moving import Moving
from ...surfaces.in_motion.posed import Posed
from ...surfaces.time_of_impact import flights, safe
from ...surfaces.time_of_impact.rising import flight_of
from ...surfaces.walls import Field, Walls

# The width of the first leases, relative to the speed of the particles. Leases that end before `TOO_SHORT` events a
# particle are too narrow; leases that last for more than `TOO_LONG` are too wide.
WIDTH, TOO_SHORT, TOO_LONG = 0.1, 4.0, 32.0


class Freedoms(NamedTuple):
    """The motion of the reacting walls: arrays with one column a wall."""

    shift: Array  # (3, K) the displacement at `time` [m]
    velocity: Array  # (3, K) [m/s]
    rest: Array  # (3, K) the round-off lost from the velocity, as light particles strike a heavy wall a million times
    angle: Array  # (K,) [rad]
    rate: Array  # (K,) [rad/s]
    rate_rest: Array  # (K,)
    series: Array  # (.., K) the Taylor coefficients of the angles of pendulums, about `time`
    time: Array  # (K,) since the start of the frame [s]
    middle: Array  # (3, K) the middle velocity of the lease [m/s]
    turning: Array  # (K,) the middle rate of the lease [rad/s]
    width: Array  # (K,) the largest deviation from it within the lease, [m/s] or [rad/s]
    until: Array  # (K,) the time until which forces alone surely leave the wall in its lease [s]


class ParticleFlight(NamedTuple):
    """A particle at a time of the frame, and the longest time ahead that matters [s]."""

    r: Vec
    v: Vec
    pull: Vec
    time: float
    longest: float


class Lease(Record):
    """A particle in the frame that moves with the middle velocity of a lease: the wall is nearly at rest there.

    There the wall stays within the width times the time of its place. For a plane and a ball, the first time at which
    a flight is as near to this place is the root of a parabola.
    """

    r: Vec
    v: Vec
    a: Vec
    width: float
    axis: Any  # the axis along which the wall may deviate, or None for all directions
    longest: float

    def width_along(self, n):
        """The width along a unit vector."""
        return self.width if self.axis is None else self.width * abs(dot(self.axis, n))


class Falling(Posed):
    """A wall at an instant of a free motion with a constant acceleration, which may be 0."""

    def first_hit(self, r, v):
        return self.body.first_hit(r - self.pose.shift, v - self.pose.velocity)

    def falling_hit(self, r, v, pull):
        way, speed = r - self.pose.shift, v - self.pose.velocity
        return self.body.falling_hit(way, speed, pull - self.pose.acceleration)

    def field_hit(self, gravity, r, v):
        felt = None if gravity is None else Gravity(*(as_vector(gravity) - self.pose.acceleration))
        return self.body.field_hit(felt, r - self.pose.shift, v - self.pose.velocity)


_AT_REST = Drive(ZERO, ZERO, (), None, None, None, ZERO, 0.0, 0.0, 0.0, math.inf, 0.0, ZERO)


class Spread(Record):
    """A map of velocities relative to a reacting wall to velocities of the same particle at a fixed wall.

    Let A = 1/m + (the velocity that a unit impulse gives the wall), and A = S S/m. The energy of the relative velocity
    w = S y, w.A^-1 w/2, is m y.y/2. In y an elastic impact is the reflection about S n, and a law for a fixed wall acts
    in y. A law that conserves energy then conserves it together with that of the wall, and a gas in equilibrium with
    a wall of its temperature stays in equilibrium.
    """

    way: Any  # the direction along which S differs from 1, or None
    factor: float  # S, if there is no way
    more: float  # S = 1 + more way way^T
    less: float  # S^-1 = 1 + less way way^T

    def out(self, y):
        """S y."""
        return self.factor * y if self.way is None else y + (self.more * dot(y, self.way)) * self.way

    def back(self, w):
        """S^-1 w."""
        return (1.0 / self.factor) * w if self.way is None else w + (self.less * dot(w, self.way)) * self.way


class Freedom(Record):
    """A degree of freedom of a wall: its `row` in `walls`, its `lightness`, 1/M or 1/I; times are those of a frame."""

    def pose(self, walls, t):
        """The `PoseDerivatives` of the wall at a time."""
        raise NotImplementedError

    def drive(self, walls, t):
        """The motion from a time on, as the `Drive` of a wall with a prescribed motion in a frame that ends then."""
        raise NotImplementedError

    def posed(self, body, walls, t):
        """The wall at a time, as a surface."""
        drive = self.drive(walls, t)
        here = drive.pose(0.0)
        return Posed(body, here, here, drive, 0.0, 0.0)

    def arm(self, r):
        """The vector from the centre of the rotation to a point."""
        return r

    def mobility(self, n, arm):
        """The velocity along n that a unit impulse along n gives the wall at the end of the arm [1/kg]."""
        raise NotImplementedError

    def along(self, arm):
        """The velocity of the end of the arm in a unit motion of the wall, the only possible one; None if any is."""
        raise NotImplementedError

    def response(self, impulse, arm):
        """The velocity that an impulse at the end of the arm gives this end [m/s]."""
        b, lightness = self.along(arm), self.lightness
        return lightness * impulse if b is None else (lightness * dot(impulse, b)) * b

    def spread(self, mass, arm):
        """Return the `Spread` of the velocities of a particle of this mass relative to the end of the arm."""
        b, part = self.along(arm), mass * self.lightness
        if b is None:
            return Spread(None, math.sqrt(1.0 + part), 0.0, 0.0)
        s = math.sqrt(1.0 + part * square(b))
        return Spread(b, 1.0, part / (s + 1.0), -part / (s * (s + 1.0)))

    def push(self, walls, t, impulse, arm):
        """Give the wall an impulse at a time, at the end of an arm from its centre."""
        raise NotImplementedError

    def begin_lease(self, walls, t):
        """Make the velocity at a time the middle of a lease."""
        raise NotImplementedError

    def away(self, walls):
        """The distance of the velocity from the middle of its lease."""
        raise NotImplementedError

    def keeps(self, walls, more):
        """How long forces surely leave the wall in its lease [s], if its velocity may change by `more`."""
        raise NotImplementedError

    def renew(self, walls, t):
        """Begin a new lease at a time, about the velocity of the wall."""
        k = index(self.row)
        self.begin_lease(walls, t)
        walls.until[k] = t + self.keeps(walls, walls.width[k])

    def stays(self, walls):
        """Store until when the lease of a wall that was just struck holds; return whether the wall is within it."""
        k, away = index(self.row), self.away(walls)
        walls.until[k] = walls.time[k] + self.keeps(walls, walls.width[k] - away)
        return away < walls.width[k]

    def reach(self, body, walls, flight):
        """A time in which the flight surely does not meet this wall, at most the longest time that matters."""
        raise NotImplementedError

    def hit(self, body, gravity, walls, flight):
        """Return the `Hit` of a flight on the wall, with the number 0, or on a wall of a field."""
        return march(Moving(body, self.drive(walls, flight.time)), flight, flight.longest)


def march(wall, flight, longest):
    """Return the `Hit` of a flight on a wall within `longest` [s], by safe steps."""
    return safe.march_moving(alone(wall), flight_of(flight.r, flight.v, flight.pull, 0.0), longest)


def alone(wall):
    """Return the walls of a scene with only this wall, or field."""
    return Walls((Field(wall) if isinstance(wall.body, Members) else wall,))


# --- Walls that do not turn ------------------------------------------------------------------------------


class Shifted(Freedom):
    """A wall that does not turn, pulled by its weight: it moves freely, or along a guide, where it may have a spring.

    The spring is relaxed at the given place of the wall.
    """

    row: int
    lightness: float
    pull: Vec  # along the axis, if there is one
    axis: Any  # of the guide, or None
    rate: Any  # the angular frequency of the spring [rad/s], or None

    def pose(self, walls, t):
        k = index(self.row)
        t = t - walls.time[k]
        if self.rate is not None:
            # s = s_e + (s0 - s_e) cos wt + V/w sin wt about the equilibrium s_e = a/w^2
            rate, (away, speed) = self.rate, self.swing(column(walls.shift, 0, k), column(walls.velocity, 0, k))
            c, s = math.cos(rate * t), math.sin(rate * t)
            here = c * away + s * speed
            return PoseDerivatives(
                self.equilibrium() + here, rate * (c * speed - s * away), (-rate * rate) * here, None
            )
        # s = s0 + V t + a t^2/2
        v, pull = column(walls.velocity, 0, k), self.pull
        return PoseDerivatives(column(walls.shift, 0, k) + t * (v + (0.5 * t) * pull), v + t * pull, pull, None)

    def equilibrium(self):
        """The displacement of the wall in equilibrium on the spring."""
        return self.pull / (self.rate * self.rate)

    def swing(self, shift, velocity):
        """Return the distance of a displacement from equilibrium, and the velocity over the rate."""
        return shift - self.equilibrium(), velocity / self.rate

    def drive(self, walls, t):
        found, rate = self.pose(walls, t), self.rate
        away, speed = self.swing(found.shift, found.velocity)
        most = math.sqrt(square(away) + square(speed))
        bounds = rate * most, rate * rate * most, rate * rate * rate * most
        swings, jerks = (Swing(away, speed, rate),), Vec(bounds[2], bounds[2], bounds[2])
        return Drive(found.shift, ZERO, swings, None, None, None, ZERO, *bounds, math.inf, 0.0, jerks)

    def posed(self, body, walls, t):
        if self.rate is not None:
            return super().posed(body, walls, t)
        here = self.pose(walls, t)
        return Falling(body, here, here, _AT_REST, 0.0, 0.0)

    def along(self, arm):
        return self.axis

    def mobility(self, n, arm):
        if self.axis is None:
            return self.lightness * square(n)
        along = dot(n, self.axis)
        return self.lightness * along * along

    def push(self, walls, t, impulse, arm):
        change = self.lightness * impulse
        if self.axis is not None:
            change = (self.lightness * dot(impulse, self.axis)) * self.axis
        k, here = index(self.row), self.pose(walls, t)
        velocity, rest = exact_sum(here.velocity, change + column(walls.rest, 0, k))
        put(walls.shift, 0, k, here.shift)
        put(walls.velocity, 0, k, velocity)
        put(walls.rest, 0, k, rest)
        walls.time[k] = t

    def hardest(self, walls):
        """A bound of the acceleration of the wall between impacts [m/s^2]."""
        if self.rate is None:
            return norm(self.pull)
        k = index(self.row)
        away, speed = self.swing(column(walls.shift, 0, k), column(walls.velocity, 0, k))
        return self.rate * self.rate * math.sqrt(square(away) + square(speed))

    def begin_lease(self, walls, t):
        put(walls.middle, 0, index(self.row), self.pose(walls, t).velocity)

    def away(self, walls):
        k = index(self.row)
        return norm(column(walls.velocity, 0, k) - column(walls.middle, 0, k))

    def keeps(self, walls, more):
        most = self.hardest(walls)
        return select(most > 0.0, more / select(most > 0.0, most, 1.0), math.inf)

    def reach(self, body, walls, flight):
        k = index(self.row)
        r, v = flight.r - self.pose(walls, flight.time).shift, flight.v - column(walls.middle, 0, k)
        return body.reach(Lease(r, v, flight.pull, walls.width[k], self.axis, flight.longest))

    def hit(self, body, gravity, walls, flight):
        if self.rate is not None:
            return super().hit(body, gravity, walls, flight)
        return flights.first_hit(alone(self.posed(body, walls, flight.time)), gravity, flight.r, flight.v)


def exact_sum(a, b):
    """Return a + b and its round-off error (Knuth)."""
    found = a + b
    other = found - a
    return found, (a - (found - other)) + (b - other)

"""The ways in which a wall that reacts may move: freely without turning, along a guide, on a spring, about an axis.

Between two impacts its motion is known. What impacts may make of it is bounded by a lease: until the wall has left it,
the velocity stays within a width of a middle one, so that what was said of far particles holds.
"""

import math
from typing import Any, NamedTuple, cast

from ..kernel.arrays import index
from ..kernel.jit import Array, select
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, column, dot, norm, put, square
from ..surfaces import flights, safe
from ..surfaces.drive import Drive, Pose, Swing
from ..surfaces.moving import Moving
from ..surfaces.posed import Posed
from ..surfaces.rising import flight_of
from ..surfaces.walls import Walls
from .reach import Seen, reach_of


class Freedoms(NamedTuple):
    """The motion of the walls that react: arrays of one column a wall."""

    shift: Array  # (3, K) the displacement at `time` [m]
    velocity: Array  # (3, K) [m/s]
    rest: Array  # (3, K) what round-off took of it: a heavy wall is struck a million times by what is light
    angle: Array  # (K,) [rad]
    rate: Array  # (K,) [rad/s]
    rate_rest: Array  # (K,)
    series: Array  # (.., K) of pendulums, the Taylor coefficients of the angle from that time on
    time: Array  # (K,) since the start of the frame [s]
    middle: Array  # (3, K) of the velocities of its lease
    turning: Array  # (K,) of the rates of its lease
    width: Array  # (K,) by how much both may differ from that, [m/s] or [rad/s]
    until: Array  # (K,) when it may leave the lease by what pulls it [s]


class Flight(NamedTuple):
    """A particle at a time of the frame, and how far ahead of it matters [s]."""

    r: Vec
    v: Vec
    pull: Vec
    time: float
    longest: float


class Falling(Posed):
    """A wall at one instant of a free motion with a constant acceleration, or none."""

    def first_hit(self, r, v):
        return self.body.first_hit(r - self.pose.shift, v - self.pose.velocity)

    def falling_hit(self, r, v, pull):
        way, speed = r - self.pose.shift, v - self.pose.velocity
        return self.body.falling_hit(way, speed, pull - self.pose.acceleration)


_AT_REST = Drive(ZERO, ZERO, (), None, None, None, ZERO, 0.0, 0.0, 0.0, math.inf, 0.0, ZERO)


class Freedom(Record):
    """A way to move of a wall, by its `row` among the `walls` and its `lightness`, 1/M or 1/I; times are of a frame."""

    def pose(self, walls, t):
        """Its `Pose` at a time."""
        raise NotImplementedError

    def drive(self, walls, t):
        """Its motion from a time on as that of a wall whose motion is given, whose frame ends then."""
        raise NotImplementedError

    def posed(self, body, walls, t):
        """The wall at a time, as a surface."""
        drive = self.drive(walls, t)
        here = drive.pose(0.0)
        return Posed(body, here, here, drive, 0.0, 0.0)

    def arm(self, r):
        """From the centre of the rotation to a point."""
        return r

    def mobility(self, n, arm):
        """The velocity along n that a unit impulse along n gives the wall at the end of the arm [1/kg]."""
        raise NotImplementedError

    def push(self, walls, t, impulse, arm):
        """Give the wall an impulse at a time, at the end of an arm from its centre."""
        raise NotImplementedError

    def renew(self, walls, t):
        """A new lease from a time on, about the velocity that the wall has."""
        raise NotImplementedError

    def stays(self, walls):
        """Whether a wall that was just struck is within its lease; says until when."""
        raise NotImplementedError

    def reach(self, body, walls, flight):
        """A time during which the flight surely does not meet this wall, at most the longest that matters."""
        raise NotImplementedError

    def hit(self, body, gravity, walls, flight):
        """When a flight meets the wall: (time, whether it does then)."""
        return march(Moving(body, self.drive(walls, flight.time)), flight, flight.longest)


def march(wall, flight, longest):
    """`Freedom.hit` of a wall that is met by safe steps, within so long [s]."""
    found = safe.march(Walls((wall,)), flight_of(flight.r, flight.v, flight.pull, 0.0), longest)
    return found.time, found.wall >= 0.0


# --- Without turning -------------------------------------------------------------------------------------


class Shifted(Freedom):
    """A wall that does not turn, pulled by its weight: in any direction, or along the `axis` of a guide."""

    axis = cast(Any, None)

    def pose(self: Any, walls, t):
        # s = s0 + V t + a t^2/2
        k = index(self.row)
        t = t - walls.time[k]
        v, pull = column(walls.velocity, 0, k), self.pull
        return Pose(column(walls.shift, 0, k) + t * (v + (0.5 * t) * pull), v + t * pull, pull, None)

    def posed(self: Any, body, walls, t):
        here = self.pose(walls, t)
        return Falling(body, here, here, _AT_REST, 0.0, 0.0)

    def mobility(self: Any, n, arm):
        if self.axis is None:
            return self.lightness * square(n)
        along = dot(n, self.axis)
        return self.lightness * along * along

    def push(self: Any, walls, t, impulse, arm):
        change = self.lightness * impulse
        if self.axis is not None:
            change = (self.lightness * dot(impulse, self.axis)) * self.axis
        k, here = index(self.row), self.pose(walls, t)
        more = change + column(walls.rest, 0, k)
        x, y, z = (
            exact_sum(here.velocity.x, more.x),
            exact_sum(here.velocity.y, more.y),
            exact_sum(here.velocity.z, more.z),
        )
        put(walls.shift, 0, k, here.shift)
        put(walls.velocity, 0, k, Vec(x[0], y[0], z[0]))
        put(walls.rest, 0, k, Vec(x[1], y[1], z[1]))
        walls.time[k] = t

    def hardest(self: Any, walls):
        """A bound of the wall's acceleration between impacts [m/s^2]."""
        return norm(self.pull)

    def renew(self: Any, walls, t):
        put(walls.middle, 0, index(self.row), self.pose(walls, t).velocity)
        self._extend(walls, t, 0.0)

    def stays(self: Any, walls):
        k = index(self.row)
        away = norm(column(walls.velocity, 0, k) - column(walls.middle, 0, k))
        self._extend(walls, walls.time[k], away)
        return away < walls.width[k]

    def _extend(self: Any, walls, t, away):
        k, most = index(self.row), self.hardest(walls)
        walls.until[k] = select(most > 0.0, t + (walls.width[k] - away) / select(most > 0.0, most, 1.0), math.inf)

    def reach(self: Any, body, walls, flight):
        k = index(self.row)
        r, v = flight.r - self.pose(walls, flight.time).shift, flight.v - column(walls.middle, 0, k)
        return reach_of(body, Seen(r, v, flight.pull, walls.width[k], self.axis, flight.longest))

    def hit(self: Any, body, gravity, walls, flight):
        return flights.hit(gravity, self.posed(body, walls, flight.time), flight.r, flight.v)


class Free(Shifted):
    """A wall that moves in any direction."""

    row: int
    lightness: float
    pull: Vec


class Guided(Shifted):
    """A wall that moves along a guide."""

    row: int
    lightness: float
    pull: Vec  # along the axis
    axis: Vec


class Sprung(Shifted):
    """A wall on a guide with a spring, which is relaxed where the wall is given."""

    row: int
    lightness: float
    pull: Vec
    axis: Vec
    rate: float  # of its vibration [rad/s]

    def pose(self, walls, t):
        # s = s_e + (s0 - s_e) cos wt + V/w sin wt about the equilibrium s_e = a/w^2
        k, rate = index(self.row), self.rate
        angle = rate * (t - walls.time[k])
        rest = self.pull / (rate * rate)
        c, s = math.cos(angle), math.sin(angle)
        away, speed = column(walls.shift, 0, k) - rest, column(walls.velocity, 0, k) / rate
        here = c * away + s * speed
        return Pose(rest + here, rate * (c * speed - s * away), (-rate * rate) * here, None)

    def drive(self, walls, t):
        found, rate = self.pose(walls, t), self.rate
        away, speed = found.shift - self.pull / (rate * rate), found.velocity / rate
        most = math.sqrt(square(away) + square(speed))
        bounds = rate * most, rate * rate * most, rate * rate * rate * most
        swings, jerks = (Swing(away, speed, rate),), Vec(bounds[2], bounds[2], bounds[2])
        return Drive(found.shift, ZERO, swings, None, None, None, ZERO, *bounds, math.inf, 0.0, jerks)

    def hardest(self, walls):
        k, rate = index(self.row), self.rate
        away, speed = column(walls.shift, 0, k) - self.pull / (rate * rate), column(walls.velocity, 0, k) / rate
        return rate * rate * math.sqrt(square(away) + square(speed))

    posed, hit = Freedom.posed, Freedom.hit


def exact_sum(a, b):
    """a + b and what round-off takes of it (Knuth)."""
    found = a + b
    other = found - a
    return found, (a - (found - other)) + (b - other)

"""A free flight in the frame of a wall that moves: where the particle is, and what bounds its way from there."""

from typing import Any

from ..kernel.record import Record
from ..kernel.vector import Vec, absolute, norm, total


class Flight(Record):
    """A free flight, and how much of the frame is left at its start [s]."""

    r: Vec
    v: Vec
    pull: Vec
    remaining: float
    speed: float  # |v|
    weight: float  # |G|

    def place(self, t):
        """Where the particle is after a time."""
        return self.r + t * (self.v + (0.5 * t) * self.pull)

    def velocity(self, t):
        """Its velocity then."""
        return self.v + t * self.pull

    def seen(self, t, wall, pull):
        """The particle after a time as `Seen` in the frame of a wall `Posed` then, where this pulls it."""
        p, v = self.place(t), self.velocity(t)
        return Seen(
            wall.drive, wall.own_place(p), wall.own_velocity(p, v), wall.own_pull(p, v, pull),
            self.speed + t * self.weight, wall.arm_length(p), self.weight,
            total(absolute(p)) + total(absolute(wall.pose.shift)),
        )  # fmt: skip


class Bounds(Record):
    """Of the speed, the acceleration and the jerk in the frame of a wall for some time."""

    speed: float
    acceleration: float
    jerk: float


class Seen(Record):
    """A particle in the frame of a wall at one time of its flight, and what bounds its way from there."""

    drive: Any  # a `Drive`
    r: Vec
    v: Vec
    a: Vec
    speed: float  # a bound of |v| in the scene
    arm: float  # its distance from the centre of the rotation; 0 where there is none
    weight: float  # |G|
    coordinates: float  # what the round-off of its place is relative to [m]

    def bounds(self, within):
        """`Bounds` that hold for so long [s]."""
        drive, spin = self.drive, self.drive.angular_speed()
        # Derivatives of A^T (r - c - d), where each of A^T turns by the rate once more
        speed = self.speed + self.weight * within + drive.fastest
        arm, hard = self.arm + speed * within, self.weight + drive.hardest
        return Bounds(
            speed + spin * arm,
            hard + spin * (2.0 * speed + spin * arm),
            drive.jerk + spin * (3.0 * hard + spin * (3.0 * speed + spin * arm)),
        )


def flight_of(r, v, pull, remaining):
    """The flight of a particle."""
    return Flight(r, v, pull, remaining, norm(v), norm(pull))

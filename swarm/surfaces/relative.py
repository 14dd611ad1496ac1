"""A free flight in the frame of a wall that moves: where the particle is, and what bounds its way from there."""

from typing import NamedTuple

from ..kernel.jit import by_type, inlined
from ..kernel.vector import Vec, absolute, norm, total
from .drive import Drive, Turn, pose
from .moving import Following, Moving, Translated
from .posed import Posed, arm_length, frame_pull, in_frame, own_place


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


@inlined
def flight_of(r, v, pull, left):
    """The flight of a particle."""
    return Flight(r, v, pull, left, norm(v), norm(pull))


@inlined
def seen_at(drive, flight, t):
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
def bounds_of(drive, seen, within):
    """`Bounds` that hold for so long [s]."""
    spin = turning(drive.turn)
    # Derivatives of A^T (r - c - d), where each of A^T turns by the rate once more
    speed = seen.speed + seen.weight * within + drive.fastest
    arm, hard = seen.arm + speed * within, seen.weight + drive.hardest
    return Bounds(
        speed + spin * arm,
        hard + spin * (2.0 * speed + spin * arm),
        drive.jerk + spin * (3.0 * hard + spin * (3.0 * speed + spin * arm)),
    )


@by_type
def turning(turn):
    """The angular speed [rad/s]."""
    return 0.0


turning.register(Turn, lambda turn: abs(turn.rate))


@by_type
def motion_of(wall, last, flight, t):
    """`Framed` of a wall; None of one that is not met by safe steps."""
    return


@motion_of.register(Moving)
def _(wall, last, flight, t):
    return Framed(wall.drive, seen_at(wall.drive, flight, t))


motion_of.register(Translated, lambda wall, last, flight, t: None)
motion_of.register(Following, lambda wall, last, flight, t: last)

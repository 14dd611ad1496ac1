"""Given motions: how a point that is led, or a wall, moves in time.

All led points have one form, so that one kernel serves every motion:
    s(t) = start + velocity t + cosine (cos(rate t) - 1) + sine sin(rate t).
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..common import checks
from ..common.checks import Vector
from ..common.validated import Bounded, Number, PositiveMagnitude, Validated
from ..errors import SceneError
from ..state import Floats

# The largest angle of a motion [rad], where float64 numbers are 1.2e-7 rad apart; the sine of larger ones is inexact.
LARGEST_ANGLE = 1e9


def vector_of(name: str, value: Vector) -> Vector:
    """Return `value` as three numbers with finite squares."""
    x, y, z = (checks.bounded(f"{name}[{i}]", part) for i, part in enumerate(checks.vector(name, value)))
    return x, y, z


def axis_of(name: str, value: Vector) -> Vector:
    """Return `value` as the direction of an axis."""
    axis = vector_of(name, value)
    if not any(axis):
        raise SceneError(f"{name} must have a direction, got (0, 0, 0)")
    return axis


BoundedVector = Annotated[Vector, vector_of]
Axis = Annotated[Vector, axis_of]


class Led(NamedTuple):
    """The path of one point.

    Attributes:
        start: (3,) its place at time 0 [m].
        velocity: (3,) of the steady part [m/s].
        cosine: (3,) the factor of cos(rate t) - 1 [m].
        sine: (3,) the factor of sin(rate t) [m].
        rate: the rate of the angle [rad/s].
    """

    start: Floats
    velocity: Floats
    cosine: Floats
    sine: Floats
    rate: float

    def position(self, time: ArrayLike) -> Floats:
        """Return the place (3,) at a time [s], or the places (3, T) at T times."""
        t = np.asarray(time, dtype=np.float64)
        start, velocity, cosine, sine = (part.reshape(3, *(1,) * t.ndim) for part in self[:4])
        half = np.sin(0.5 * self.rate * t)
        # cos a - 1 = -2 sin^2(a/2) has no cancellation.
        return np.asarray(start + velocity * t - cosine * (2.0 * half * half) + sine * np.sin(self.rate * t))

    def velocity_at(self, time: float) -> Floats:
        """Return its velocity (3,) at a time [s]."""
        angle = self.rate * time
        return self.velocity + self.rate * (self.sine * math.cos(angle) - self.cosine * math.sin(angle))


class Given(Validated):
    """A given motion; motions add up: `Translation(...) + Rotation(...)`."""

    # The most motions of its kind in a sum, and the advice for more.
    most: ClassVar[float] = math.inf
    instead: ClassVar[str] = ""

    def __add__(self, other: "Given") -> "Sum":
        return Sum((self, other)) if isinstance(other, Given) else NotImplemented

    def __radd__(self, other: Any) -> "Given":
        return self if other == 0 else NotImplemented


@dataclass(frozen=True)
class Translation(Given):
    """Steady motion along a straight line.

    Args:
        velocity: three numbers, each from -1e100 to 1e100 [m/s].

    Raises:
        SceneError: an argument is out of its range.

    >>> Translation(velocity=(2.0, 0.0, 0.0)).harmonic((0.0, 0.0, 1.0)).position(3.0)
    array([6., 0., 1.])
    """

    velocity: BoundedVector

    def harmonic(self, start: ArrayLike) -> Led:
        """Return the path of a point that is at `start` (3,) [m] at time 0."""
        return Led(point_of(start), np.array(self.velocity), np.zeros(3), np.zeros(3), 0.0)


@dataclass(frozen=True)
class Oscillation(Given):
    """Displacement amplitude (sin(2 pi frequency t + phase) - sin(phase)).

    Args:
        amplitude: three numbers, each from -1e100 to 1e100 [m].
        frequency: above 0 [1/s].
        phase: the angle at time 0, from -1e9 to 1e9 [rad].

    Raises:
        SceneError: an argument is out of its range.

    >>> Oscillation(amplitude=(0.0, 0.0, 0.1), frequency=5.0).harmonic((1.0, 0.0, 0.0)).position(0.05)
    array([1. , 0. , 0.1])
    """

    amplitude: BoundedVector
    frequency: PositiveMagnitude
    phase: Number = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        phase = self.phase
        if abs(phase) > LARGEST_ANGLE:
            raise SceneError(
                f"phase must be from {-LARGEST_ANGLE:g} to {LARGEST_ANGLE:g} rad, got {phase:g}, next to which float64 "
                f"numbers are {math.ulp(phase):.1g} rad apart; take it modulo 2 pi"
            )

    def harmonic(self, start: ArrayLike) -> Led:
        """Return the path of a point that is at `start` (3,) [m] at time 0."""
        amplitude = np.array(self.amplitude)
        # sin(a + phase) - sin(phase) = sin(phase) (cos a - 1) + cos(phase) sin a
        cosine, sine = amplitude * math.sin(self.phase), amplitude * math.cos(self.phase)
        return Led(point_of(start), np.zeros(3), cosine, sine, 2.0 * math.pi * self.frequency)


@dataclass(frozen=True)
class Rotation(Given):
    """Steady rotation about an axis that is fixed in space.

    Args:
        axis: three numbers, not all 0; its length does not matter. The rotation is right-handed about it.
        rate: from -1e100 to 1e100 [rad/s].
        center: a point of the axis [m]; the origin by default.

    Raises:
        SceneError: an argument is out of its range.

    >>> import math
    >>> path = Rotation(axis=(0.0, 0.0, 1.0), rate=math.pi, center=(0.0, 0.0, 0.0)).harmonic((1.0, 0.0, 5.0))
    >>> path.position(0.5).round(12)
    array([0., 1., 5.])
    """

    axis: Axis
    rate: Bounded
    center: BoundedVector = (0.0, 0.0, 0.0)
    most: ClassVar[float] = 1
    instead: ClassVar[str] = "about one axis their rates add up to that of a single one"

    def harmonic(self, start: ArrayLike) -> Led:
        """Return the path of a point that is at `start` (3,) [m] at time 0."""
        point, axis = point_of(start), unit_axis(self)
        arm = point - self.center
        radius = arm - (arm * axis).sum() * axis
        return Led(point, np.zeros(3), radius, np.cross(axis, radius), self.rate)


@dataclass(frozen=True)
class Sum(Given):
    """Several motions of a wall at once: displacements add up.

    Args:
        parts: at least one motion: at most one rotation, at most one path, and no guide. The
            centre of a rotation moves with the displacements.

    Raises:
        SceneError: no part, a part that is not a motion, two rotations, two paths, or a guide.

    >>> both = Translation((1.0, 0.0, 0.0)) + Rotation((0.0, 0.0, 1.0), rate=2.0, center=(0.0, 0.0, 0.0))
    >>> len(both.parts)
    2
    """

    parts: tuple[Given, ...]

    def __post_init__(self) -> None:
        parts = tuple(part for one in self.parts for part in parts_of(one))
        if not parts or not all(isinstance(one, Given) for one in parts):
            raise SceneError(f"a sum must have motions as its parts, at least one, got {self.parts!r:.200}")
        checks.assign(self, parts=parts)
        for kind in dict.fromkeys(type(one) for one in parts):
            count = sum(isinstance(one, kind) for one in parts)
            if count > kind.most:
                raise SceneError(
                    f"a sum of motions must have at most {kind.most} {kind.__name__}, got {count}; {kind.instead}"
                )


def parts_of(motion: Any) -> tuple[Any, ...]:
    """Return the parts of a sum, or the motion itself; () for None."""
    if motion is None:
        return ()
    return motion.parts if isinstance(motion, Sum) else (motion,)


Motion = Translation | Oscillation | Rotation


def led(motion: Motion | None, start: ArrayLike) -> Led:
    """Return the path of a point that is at `start` (3,) [m] at time 0; without a motion it is fixed in space."""
    return Translation((0.0, 0.0, 0.0)).harmonic(start) if motion is None else motion.harmonic(start)


def require_angle(name: str, part: Any, until: float) -> None:
    """Raise a `SceneError` if a part of the motion called `name` turns by more than LARGEST_ANGLE until a time [s]."""
    oscillates = isinstance(part, Oscillation)
    if not oscillates and not isinstance(part, Rotation):
        return
    rate = 2.0 * math.pi * part.frequency if oscillates else abs(part.rate)
    if rate * until > LARGEST_ANGLE:
        key, value, unit = ("frequency", part.frequency, "1/s") if oscillates else ("rate", part.rate, "rad/s")
        raise SceneError(
            f"{name}.{key} must be such that the angle is at most {LARGEST_ANGLE:g} rad at the end, where float64 "
            f"numbers are {math.ulp(LARGEST_ANGLE):.1g} rad apart, got {value:g} {unit} and thus "
            f"{rate * until:.3g} rad at {until:g} s"
        )


def unit_axis(rotation: Any) -> Floats:
    """Return the unit vector (3,) along the axis."""
    # Divided by the largest part first: the squares of small components are 0.
    axis = np.array(rotation.axis) / np.abs(rotation.axis).max()
    return np.asarray(axis / np.sqrt((axis**2).sum()))


def point_of(start: ArrayLike) -> Floats:
    """Return a point as an array."""
    return np.array(checks.vector("start", start))

"""Given motions: how a point that is led, or a wall, moves in time.

A led point has one form for all, so that one kernel serves every motion:
    s(t) = start + velocity t + cosine (cos(rate t) - 1) + sine sin(rate t).
A wall that is given at rest as the points xi is at time t where
    x(t) = c + d(t) + A(t) (xi - c),
with the displacement d, and the rotation A about the centre c, both of one motion or of the sum of several.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks
from .checks import Vector
from .errors import SceneError

Floats = NDArray[np.float64]


class Led(NamedTuple):
    """The path of one point.

    Attributes:
        start: (3,) its place at time 0 [m].
        velocity: (3,) of the steady part [m/s].
        cosine: (3,) what cos(rate t) - 1 multiplies [m].
        sine: (3,) what sin(rate t) multiplies [m].
        rate: of the angle [rad/s].
    """

    start: Floats
    velocity: Floats
    cosine: Floats
    sine: Floats
    rate: float

    def position(self, time: ArrayLike) -> Floats:
        """The place (3,) at a time [s], or the places (3, T) at T times."""
        t = np.asarray(time, dtype=np.float64)
        start, velocity, cosine, sine = (part.reshape(3, *(1,) * t.ndim) for part in self[:4])
        half = np.sin(0.5 * self.rate * t)
        # cos a - 1 = -2 sin^2(a/2) has no cancellation.
        return np.asarray(start + velocity * t - cosine * (2.0 * half * half) + sine * np.sin(self.rate * t))

    def velocity_at(self, time: float) -> Floats:
        """Its velocity (3,) at a time [s]."""
        angle = self.rate * time
        return self.velocity + self.rate * (self.sine * math.cos(angle) - self.cosine * math.sin(angle))


class Given:
    """A motion that is given; motions add up: `Translation(...) + Rotation(...)`."""

    def __add__(self, other: "Given") -> "Sum":
        return Sum((*parts_of(self), *parts_of(other)))

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

    velocity: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "velocity", _vector("velocity", self.velocity))

    def harmonic(self, start: ArrayLike) -> Led:
        """The path of a point that is at `start` (3,) [m] at time 0."""
        return Led(_point(start), np.array(self.velocity), np.zeros(3), np.zeros(3), 0.0)


@dataclass(frozen=True)
class Oscillation(Given):
    """Displacement amplitude (sin(2 pi frequency t + phase) - sin(phase)).

    Args:
        amplitude: three numbers, each from -1e100 to 1e100 [m].
        frequency: above 0 [1/s].
        phase: the angle at time 0 [rad].

    Raises:
        SceneError: an argument is out of its range.

    >>> Oscillation(amplitude=(0.0, 0.0, 0.1), frequency=5.0).harmonic((1.0, 0.0, 0.0)).position(0.05)
    array([1. , 0. , 0.1])
    """

    amplitude: Vector
    frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", _vector("amplitude", self.amplitude))
        frequency = checks.positive("frequency", self.frequency)
        checks.magnitude("frequency", frequency)
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "phase", checks.number("phase", self.phase))

    def harmonic(self, start: ArrayLike) -> Led:
        """The path of a point that is at `start` (3,) [m] at time 0."""
        amplitude = np.array(self.amplitude)
        # sin(a + phase) - sin(phase) = sin(phase) (cos a - 1) + cos(phase) sin a
        cosine, sine = amplitude * math.sin(self.phase), amplitude * math.cos(self.phase)
        return Led(_point(start), np.zeros(3), cosine, sine, 2.0 * math.pi * self.frequency)


@dataclass(frozen=True)
class Rotation(Given):
    """Steady rotation about an axis that is fixed in space.

    Args:
        axis: three numbers, not all 0; its length does not matter. The rotation is right-handed about it.
        rate: from -1e100 to 1e100 [rad/s].
        center: a point of the axis [m].

    Raises:
        SceneError: an argument is out of its range.

    >>> import math
    >>> path = Rotation(axis=(0.0, 0.0, 1.0), rate=math.pi, center=(0.0, 0.0, 0.0)).harmonic((1.0, 0.0, 5.0))
    >>> path.position(0.5).round(12)
    array([0., 1., 5.])
    """

    axis: Vector
    rate: float
    center: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", _axis(self.axis))
        rate = checks.number("rate", self.rate)
        checks.magnitude("|rate|", abs(rate))
        object.__setattr__(self, "rate", rate)
        object.__setattr__(self, "center", _vector("center", self.center))

    def harmonic(self, start: ArrayLike) -> Led:
        """The path of a point that is at `start` (3,) [m] at time 0."""
        point, axis = _point(start), unit_axis(self)
        arm = point - self.center
        radius = arm - (arm * axis).sum() * axis
        return Led(point, np.zeros(3), radius, np.cross(axis, radius), self.rate)


Motion = Translation | Oscillation | Rotation


@dataclass(frozen=True)
class Path(Given):
    """Displacement along a cubic spline, which is C^2: of a wall, not of a point.

    Args:
        times: at least two, ascending [s].
        positions: for each time three numbers, the displacement from where the wall is given [m].

    The second derivative is 0 at both ends (the natural spline); there is no motion beyond them.

    Raises:
        SceneError: an argument is out of its range.

    >>> Path(times=(0.0, 1.0, 2.0), positions=((0, 0, 0), (0, 0, 1), (0, 0, 0))).displacement(0.5)
    array([0.    , 0.    , 0.6875])
    """

    times: tuple[float, ...]
    positions: tuple[Vector, ...]

    def __post_init__(self) -> None:
        times = checks.array("times", self.times)
        if times.ndim != 1 or times.size < 2 or not (np.diff(times) > 0.0).all():
            wrong = np.flatnonzero(~(np.diff(times) > 0.0)) if times.ndim == 1 else np.empty(0)
            came = f"{times[wrong[0]]:g} before {times[wrong[0] + 1]:g}" if wrong.size else f"the shape {times.shape}"
            raise SceneError(f"times must be at least two, ascending, got {came}")
        if not np.isfinite(times).all():
            raise SceneError(f"times must be finite, got {times[~np.isfinite(times)][0]:g}")
        if isinstance(self.positions, (str, bytes)) or len(self.positions) != times.size:
            raise SceneError(f"positions must be one for each of the {times.size} times, got {len(self.positions)}")
        object.__setattr__(self, "times", tuple(times.tolist()))
        places = tuple(_vector(f"positions[{k}]", place) for k, place in enumerate(self.positions))
        object.__setattr__(self, "positions", places)

    def cubics(self) -> Floats:
        """The coefficients (4, 3, pieces) of each piece in powers of the time since its start."""
        t, x = np.array(self.times), np.array(self.positions).T
        h, slope = np.diff(t), np.diff(x) / np.diff(t)
        bends = np.zeros_like(x)  # second derivatives at the knots
        # h_k-1 m_k-1 + 2 (h_k-1 + h_k) m_k + h_k m_k+1 = 6 (slope_k - slope_k-1), a tridiagonal system
        upper, right = np.zeros(t.size), np.zeros_like(x)
        for k in range(1, t.size - 1):
            pivot = 2.0 * (h[k - 1] + h[k]) - h[k - 1] * upper[k - 1]
            upper[k] = h[k] / pivot
            right[:, k] = (6.0 * (slope[:, k] - slope[:, k - 1]) - h[k - 1] * right[:, k - 1]) / pivot
        for k in range(t.size - 2, 0, -1):
            bends[:, k] = right[:, k] - upper[k] * bends[:, k + 1]
        first = slope - h * (2.0 * bends[:, :-1] + bends[:, 1:]) / 6.0
        return np.array([x[:, :-1], first, 0.5 * bends[:, :-1], np.diff(bends) / (6.0 * h)])

    def displacement(self, time: float) -> Floats:
        """The displacement (3,) at a time [s]."""
        k = min(max(int(np.searchsorted(self.times, time, "right")) - 1, 0), len(self.times) - 2)
        s, (a, b, c, d) = time - self.times[k], self.cubics()[:, :, k]
        return np.asarray(a + s * (b + s * (c + s * d)))


@dataclass(frozen=True)
class Sum(Given):
    """Several motions of a wall at once: displacements add up.

    Args:
        parts: at least one motion, of which at most one is a rotation, at most one a path, and none a guide. The
            centre of a rotation moves with the displacements.

    Raises:
        SceneError: two rotations, two paths, or a guide.

    >>> both = Translation((1.0, 0.0, 0.0)) + Rotation((0.0, 0.0, 1.0), rate=2.0, center=(0.0, 0.0, 0.0))
    >>> len(both.parts)
    2
    """

    parts: "tuple[WallMotion, ...]"

    def __post_init__(self) -> None:
        for one in self.parts:
            if isinstance(one, Guide):
                raise SceneError(f"a sum of motions must have no guide, which needs a mass of its own, got {one}")
        for kind in (Rotation, Path):
            parts = [one for one in self.parts if isinstance(one, kind)]
            if len(parts) > 1:
                raise SceneError(f"a sum of motions must have at most one {kind.__name__}, got {len(parts)}")


@dataclass(frozen=True)
class Guide(Given):
    """A straight guide, and a spring: how a wall with a mass may move. It starts where it is given.

    Args:
        axis: three numbers, not all 0; its length does not matter.
        speed: along the axis at the start, from -1e100 to 1e100 [m/s].
        stiffness: of a spring that is relaxed where the wall is given, from 0 to 1e100 [N/m]; 0: no spring.

    Gravity pulls the wall along the axis.

    Raises:
        SceneError: an argument is out of its range.

    >>> import swarm
    >>> piston = swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=10.0, motion=Guide(axis=(0.0, 0.0, 1.0), stiffness=40.0))
    >>> piston.motion.speed
    0.0
    """

    axis: Vector
    speed: float = 0.0
    stiffness: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", _axis(self.axis))
        speed = checks.number("speed", self.speed)
        checks.magnitude("|speed|", abs(speed))
        object.__setattr__(self, "speed", speed)
        object.__setattr__(self, "stiffness", checks.magnitude("stiffness", self.stiffness))

    def harmonic(self, start: ArrayLike) -> Led:
        """Where a point of the wall is before anything moves it."""
        return Led(_point(start), np.zeros(3), np.zeros(3), np.zeros(3), 0.0)


@dataclass(frozen=True)
class Placed(Given):
    """A wall that stays where a run has moved it: what is given at xi is at position + orientation xi.

    Args:
        position: three numbers [m].
        orientation: a unit quaternion (w, x, y, z).
        turn: its matrix, (3, 3).
    """

    position: Vector
    orientation: tuple[float, float, float, float]
    turn: tuple[Vector, ...]


WallMotion = Translation | Oscillation | Rotation | Path | Sum | Guide | Placed
# The motions by their kind in a scene file.
KINDS: dict[str, Any] = {
    "translation": Translation, "oscillation": Oscillation, "rotation": Rotation, "path": Path,
    "guide": Guide,
}  # fmt: skip


class Pose(NamedTuple):
    """Where a wall is: x = center + shift + turn (xi - center)."""

    shift: Floats  # (3,) [m]
    turn: Floats  # (3, 3)
    center: Floats  # (3,) [m]
    quaternion: tuple[float, float, float, float]  # of the turn, (w, x, y, z)

    def position(self) -> Floats:
        """Where the origin of the frame in which the wall is given is now, (3,)."""
        return np.asarray(self.center + self.shift - _product(self.turn, self.center))

    def placed(self, points: Floats) -> Floats:
        """Points (3, N) of the wall as it is given, where they are now."""
        middle = self.center[:, None]
        return np.asarray(middle + self.shift[:, None] + _product(self.turn, points - middle))

    def turned(self, vectors: Floats) -> Floats:
        """Vectors (3, N) of the frame of the wall in the scene."""
        return _product(self.turn, vectors)

    def given(self, points: Floats) -> Floats:
        """Points (3, N) of the scene in the frame in which the wall is given."""
        middle = self.center[:, None]
        return np.asarray(middle + _product(self.turn.T, points - self.shift[:, None] - middle))


def pose(motion: "WallMotion | None", time: float) -> Pose:
    """Where a wall with this motion is at a time [s]."""
    found, center, turn, quaternion = np.zeros(3), np.zeros(3), np.eye(3), (1.0, 0.0, 0.0, 0.0)
    for one in parts_of(motion):
        if isinstance(one, Placed):
            found, quaternion, turn = np.array(one.position), one.orientation, np.array(one.turn)
        elif isinstance(one, Rotation):
            center, turn, half = np.array(one.center), _turned_by(one, one.rate * time), 0.5 * one.rate * time
            x, y, z = (math.sin(half) * unit_axis(one)).tolist()
            quaternion = (math.cos(half), x, y, z)
        else:
            found = found + displacement(one, time)
    return Pose(found, turn, center, quaternion)


def displacement(motion: "Translation | Oscillation | Path | Guide", time: float) -> Floats:
    """The displacement (3,) of a wall at a time [s]."""
    if isinstance(motion, Path):
        return motion.displacement(time)
    return motion.harmonic((0.0, 0.0, 0.0)).position(time)


def parts_of(motion: Any) -> tuple[Any, ...]:
    """What a motion is the sum of; nothing of None."""
    if motion is None:
        return ()
    return motion.parts if isinstance(motion, Sum) else (motion,)


def unit_axis(rotation: Rotation | Guide) -> Floats:
    """The unit vector (3,) along its axis."""
    # By the largest part first: the squares of small components are 0.
    axis = np.array(rotation.axis) / np.abs(rotation.axis).max()
    return np.asarray(axis / np.sqrt((axis**2).sum()))


def parts_of_wall(value: Any) -> "WallMotion | None":
    """`value` as the motion of a wall: None, a motion, its table, or a list of several.

    Raises:
        SceneError: it is none of these.
    """
    if value is None or isinstance(value, WallMotion):
        return value
    if isinstance(value, Mapping):
        kind = checks.one_of("motion.kind", value.get("kind"), KINDS)
        given = {key: part for key, part in value.items() if key != "kind"}
        names = list(KINDS[kind].__dataclass_fields__)
        for key in given:
            if key not in names:
                raise SceneError(
                    f"motion.{key}: unknown key, expected {checks.listed(names)}{checks.closest(key, names)}"
                )
        for name in names:
            if name not in given and KINDS[kind].__dataclass_fields__[name].default is MISSING:
                raise SceneError(
                    f"motion.{name}: expected a value where kind is '{kind}', got nothing; add {name} = ..."
                )
        return KINDS[kind](**given)  # type: ignore[no-any-return]
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) and len(value):
        parts = [part for one in value for part in parts_of(parts_of_wall(one))]
        return parts[0] if len(parts) == 1 else Sum(tuple(parts))
    raise SceneError(
        f"motion must be None, swarm.Translation, Oscillation, Rotation, Path, Guide or a sum of them, got {value!r}"
    )


def require_freedom(motion: "WallMotion | None", mass: float | None, inertia: float | None) -> None:
    """Raise a `SceneError` where a wall with this mass or inertia has a motion that is none for it."""
    if isinstance(motion, Guide) and mass is None:
        raise SceneError("mass must go with a Guide, along which impacts move the wall, got None; give mass= [kg]")
    if mass is not None and inertia is None and not (motion is None or isinstance(motion, Translation | Guide)):
        raise SceneError(
            f"motion must be None, a Translation or a Guide where a mass is given, got {motion}; a wall on a spring is "
            "a Guide with a stiffness, one that turns has an inertia"
        )
    if inertia is not None and not isinstance(motion, Rotation):
        raise SceneError(f"motion must be a Rotation where an inertia is given, got {motion}")


def table_of(motion: "WallMotion") -> Any:
    """The table of a wall's motion, of a sum a list of tables."""
    names = {cls: kind for kind, cls in KINDS.items()}
    tables = [{"kind": names[type(one)], **asdict(one)} for one in parts_of(motion)]
    return tables[0] if len(tables) == 1 else tables


def led(motion: Motion | None, start: ArrayLike) -> Led:
    """The path of a point that is at `start` (3,) [m] at time 0; without a motion it is fixed in space."""
    return Translation((0.0, 0.0, 0.0)).harmonic(start) if motion is None else motion.harmonic(start)


def _turned_by(rotation: Rotation, angle: float) -> Floats:
    """The matrix (3, 3) of a rotation by an angle [rad]."""
    # Rodrigues: cos a + (1 - cos a) k k^T + sin a [k], where 1 - cos a = 2 sin^2(a/2)
    k, half = unit_axis(rotation), math.sin(0.5 * angle)
    across = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    versine = 2.0 * half * half
    return np.asarray((1.0 - versine) * np.eye(3) + versine * np.multiply.outer(k, k) + math.sin(angle) * across)


def _product(matrix: Floats, rows: Floats) -> Floats:
    """(3, 3) times (3, N), rounded term by term: the last bit of BLAS depends on the processor."""
    return np.asarray(sum(np.multiply.outer(matrix[:, k], rows[k]) for k in range(3)))


def _axis(value: Vector) -> Vector:
    """`value` as the direction of an axis."""
    axis = _vector("axis", value)
    if not any(axis):
        raise SceneError("axis must have a direction, got (0, 0, 0)")
    return axis


def _vector(name: str, value: Vector) -> Vector:
    parts = checks.vector(name, value)
    for i, part in enumerate(parts):
        checks.magnitude(f"|{name}[{i}]|", abs(part))
    return parts


def _point(start: ArrayLike) -> Floats:
    return np.array(checks.vector("start", start))

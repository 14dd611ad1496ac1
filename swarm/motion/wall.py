"""Motions of walls: along a path, of several at once, along a guide; their tables in scene files; and poses.

A wall that is given at rest as the points xi is at time t at
    x(t) = c + d(t) + A(t) (xi - c),
with the displacement d, and the rotation A about the centre c, both of one motion or of the sum of several.
"""

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, fields
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..common import checks
from ..common.checks import Vector
from ..common.validated import Bounded, Magnitude
from ..errors import SceneError
from ..state import Floats
from .given import Axis, Given, Led, Oscillation, Rotation, Sum, Translation, parts_of, point_of, unit_axis, vector_of

# A path with more times is shown without them.
_FEW = 4


@dataclass(frozen=True, repr=False)
class Path(Given):
    """Displacement along a cubic spline, which is C^2, of a wall, not of a point, and without a rotation.

    Args:
        times: at least two, ascending [s].
        positions: for each time three numbers, the displacement from the given place of the wall [m].

    The second derivative is 0 at both ends (the natural spline). The times must cover the run. Between two equal
    consecutive positions the wall is at rest. It comes to rest with a velocity and an acceleration of 0;
    so the way from or to a rest is two cubics, each for half of the time, and the way between two rests three.

    Raises:
        SceneError: an argument is out of its range.

    >>> Path(times=(0.0, 1.0, 2.0), positions=((0, 0, 0), (0, 0, 1), (0, 0, 0))).displacement(0.5)
    array([0.    , 0.    , 0.6875])
    >>> Path(times=(0.0, 1.0, 2.0), positions=((0, 0, 0), (0, 0, 0), (0, 0, 1))).displacement(0.5)
    array([0., 0., 0.])
    """

    times: tuple[float, ...]
    positions: tuple[Vector, ...]
    most: ClassVar[float] = 1
    instead: ClassVar[str] = "their displacements add up to those of a single one"

    def __post_init__(self) -> None:
        times = _times(self.times)
        given = checks.parts_of(self.positions)
        if given is None:
            came = checks.shown(self.positions)
            raise SceneError(f"positions must be three numbers for each of the times, got {came}")
        places = tuple(vector_of(f"positions[{k}]", place) for k, place in enumerate(given))
        if len(places) != len(times):
            raise SceneError(f"positions must be one for each of the {len(times)} times, got {len(places)}")
        checks.assign(self, times=times, positions=places)
        with np.errstate(all="ignore"):
            large = ~(np.abs(self.cubics) <= checks.LARGEST).all(axis=(0, 1))
        if large.any():
            k = int(np.searchsorted(times, self.knots[int(large.argmax())], "right")) - 1
            raise SceneError(
                f"times must be so far apart that the coefficients of the spline are at most {checks.LARGEST:g}, got "
                f"{times[k]:g} s at {places[k]} and {times[k + 1]:g} s at {places[k + 1]}"
            )

    def __repr__(self) -> str:
        """Return the call that makes it; of many times only their number and ends, as messages contain it."""
        if len(self.times) > _FEW:
            return f"Path(<{len(self.times)} times from {self.times[0]:g} to {self.times[-1]:g} s>)"
        return f"Path(times={self.times}, positions={self.positions})"

    @functools.cached_property
    def knots(self) -> Floats:
        """The times at which the cubics begin, and the end of the last: the given times and those beside rests."""
        return self._spline[0]

    @functools.cached_property
    def cubics(self) -> Floats:
        """The coefficients (4, 3, pieces) of each piece in powers of the time since its start."""
        t, x, bends = self._spline
        h, slope = np.diff(t), np.diff(x) / np.diff(t)
        first = slope - h * (2.0 * bends[:, :-1] + bends[:, 1:]) / 6.0
        return np.array([x[:, :-1], first, 0.5 * bends[:, :-1], np.diff(bends) / (6.0 * h)])

    @functools.cached_property
    def _spline(self) -> tuple[Floats, Floats, Floats]:
        """The knots, and the positions and second derivatives (3, knots) at them."""
        t, x = np.array(self.times), np.array(self.positions).T
        h, slope = np.diff(t), np.diff(x) / np.diff(t)
        is_rest = (np.diff(x) == 0.0).all(axis=0)
        rests = np.append(is_rest, False) | np.append(False, is_rest)
        begins, ends = rests[:-1] & ~is_rest, rests[1:] & ~is_rest  # of a way that begins, or ends, at a rest
        # The way from a rest to t_k arrives there with the speed 2 slope + h m_k/6, one cubic would with
        # slope + h (m_k-1 + 2 m_k)/6: the knot in its middle gives the speed 0 at the rest.
        one = begins ^ ends
        steep, wide = np.where(one, 2.0, 1.0) * slope, np.where(one, 1.0, 2.0) * h
        bends = np.zeros_like(x)  # second derivatives at the knots
        # h_k-1 m_k-1 + 2 (h_k-1 + h_k) m_k + h_k m_k+1 = 6 (slope_k - slope_k-1), a tridiagonal system
        upper, right = np.zeros(t.size), np.zeros_like(x)
        for k in range(1, t.size - 1):
            if rests[k]:
                continue
            pivot = wide[k - 1] + wide[k] - h[k - 1] * upper[k - 1]
            upper[k] = h[k] / pivot
            right[:, k] = (6.0 * (steep[:, k] - steep[:, k - 1]) - h[k - 1] * right[:, k - 1]) / pivot
        for k in range(t.size - 2, 0, -1):
            bends[:, k] = right[:, k] - upper[k] * bends[:, k + 1]
        # m = 4 slope/h - m_k/6 in the middle of such a way; 9 slope/h and -9 slope/h at the thirds of one between rests
        part, rate = np.where(one, 0.5, 1.0 / 3.0) * h, np.where(one, 4.0, 9.0) * slope / h
        after, before = rate - bends[:, 1:] / 6.0, -rate - bends[:, :-1] / 6.0
        where = 1 + np.concatenate([np.flatnonzero(begins), np.flatnonzero(ends)])
        made = (
            (t, t[:-1] + part, t[1:] - part),
            (x, x[:, :-1] + after * part**2 / 6.0, x[:, 1:] + before * part**2 / 6.0),
            (bends, after, before),
        )
        knots, places, bends = (
            np.insert(given, where, np.concatenate([from_rest[..., begins], to_rest[..., ends]], axis=-1), axis=-1)
            for given, from_rest, to_rest in made
        )
        return knots, places, bends

    def displacement(self, time: float) -> Floats:
        """Return the displacement (3,) at a time [s]."""
        k = min(max(int(np.searchsorted(self.knots, time, "right")) - 1, 0), len(self.knots) - 2)
        s, (a, b, c, d) = time - self.knots[k], self.cubics[:, :, k]
        return np.asarray(a + s * (b + s * (c + s * d)))


@dataclass(frozen=True)
class Guide(Given):
    """A straight guide with a spring, for a wall with a mass. The wall starts at its given place.

    Args:
        axis: three numbers, not all 0; its length does not matter.
        speed: along the axis at the start, from -1e100 to 1e100 [m/s].
        stiffness: of a spring that is relaxed at the given place of the wall, from 0 to 1e100 [N/m]; 0: no spring.

    Gravity pulls the wall along the axis.

    Raises:
        SceneError: an argument is out of its range.

    >>> import swarm
    >>> piston = swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=10.0, motion=Guide(axis=(0.0, 0.0, 1.0), stiffness=40.0))
    >>> piston.motion.speed
    0.0
    """

    axis: Axis
    speed: Bounded = 0.0
    stiffness: Magnitude = 0.0
    most: ClassVar[float] = 0
    instead: ClassVar[str] = "impacts move the wall along it and nothing else does; give it alone"

    def harmonic(self, start: ArrayLike) -> Led:
        """Return the path of a point of the wall without its motion along the guide: a point at rest."""
        return Led(point_of(start), np.zeros(3), np.zeros(3), np.zeros(3), 0.0)


def speed_at_start(motion: Any) -> Floats:
    """Return the initial velocity (3,) of a wall that has a mass and does not turn [m/s]."""
    if isinstance(motion, Translation):
        return np.array(motion.velocity, np.float64)
    return motion.speed * unit_axis(motion) if isinstance(motion, Guide) else np.zeros(3)


@dataclass(frozen=True)
class Placed(Given):
    """A wall that stays where a run has moved it: a point given as xi is at position + orientation xi.

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


def parts_of_wall(where: str, value: Any, within: tuple[Any, ...] = ()) -> "WallMotion | None":
    """Return `value` as the motion of a wall: None, a motion, its table, or a list of several; `where` is for errors.

    `within` are the lists that contain it.

    Raises:
        SceneError: `value` is not one of these.
    """
    if value is None or isinstance(value, WallMotion):
        return value
    if isinstance(value, Mapping):
        return _of_table(value, where)
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) and len(value):
        if any(value is one for one in within):
            raise SceneError(f"{where} must not contain itself, got a list that does")
        parts = [parts_of_wall(f"{where}[{k}]", one, (*within, value)) for k, one in enumerate(value)]
        try:
            return parts[0] if len(parts) == 1 else Sum(tuple(parts))  # type: ignore[arg-type]
        except SceneError as error:
            raise SceneError(f"{where}: {error}") from None
    raise SceneError(
        f"{where} must be None, swarm.Translation, Oscillation, Rotation, Path, Guide or a sum of them, or in a file "
        f"a table with a kind, got {checks.shown(value)}{checks.brackets(value)}"
    )


def _of_table(table: Mapping[str, Any], where: str) -> "WallMotion":
    """Return the motion that a table describes."""
    if "kind" not in table:
        raise SceneError(f"{where}.kind: expected one of {checks.listed(KINDS)}, got nothing")
    kind = checks.one_of(f"{where}.kind", table["kind"], KINDS)
    given = {key: part for key, part in table.items() if key != "kind"}
    needed = {one.name: one.default is MISSING for one in fields(KINDS[kind])}
    checks.known_keys(f"{where}.", given, needed)
    for name in needed:
        if needed[name] and name not in given:
            raise SceneError(f"{where}.{name}: expected a value where kind is '{kind}', got nothing; add {name} = ...")
    try:
        return KINDS[kind](**given)  # type: ignore[no-any-return]
    except SceneError as error:
        raise SceneError(checks.located(where, error)) from None


def _times(value: ArrayLike) -> tuple[float, ...]:
    """Return `value` as the times of a path."""
    times = checks.array("times", value)
    if times.ndim != 1 or times.size < 2:
        came = times.size if times.ndim == 1 else f"an array of shape {times.shape}"
        raise SceneError(f"times must be a list of at least two numbers, got {came}")
    parts = [checks.bounded(f"times[{k}]", part) for k, part in enumerate(times.tolist())]
    for k, (one, other) in enumerate(itertools.pairwise(parts)):
        if not one < other:
            raise SceneError(f"times must ascend, got times[{k}] = {one:g} before times[{k + 1}] = {other:g}")
    return tuple(parts)


def require_freedom(motion: "WallMotion | None", mass: float | None, inertia: float | None) -> None:
    """Raise a `SceneError` if a wall with this mass or inertia cannot have this motion."""
    if isinstance(motion, Guide) and mass is None:
        raise SceneError("mass must go with a Guide, along which impacts move the wall, got None; give mass= [kg]")
    if mass is not None and inertia is None and not (motion is None or isinstance(motion, Translation | Guide)):
        raise SceneError(
            f"motion must be None, a Translation or a Guide where a mass is given, got {motion}; a wall on a spring is "
            "a Guide with a stiffness, a wall that turns has an inertia"
        )
    if inertia is not None and not isinstance(motion, Rotation):
        raise SceneError(f"motion must be a Rotation where an inertia is given, got {motion}")


def table_of(motion: "WallMotion") -> Any:
    """Return the table of a wall's motion, for a sum a list of tables."""
    names = {cls: kind for kind, cls in KINDS.items()}
    tables = [{"kind": names[type(one)], **asdict(one)} for one in parts_of(motion)]
    return tables[0] if len(tables) == 1 else tables


# --- Poses -----------------------------------------------------------------------------------------------


class Pose(NamedTuple):
    """The place and orientation of a wall: x = center + shift + turn (xi - center)."""

    shift: Floats  # (3,) [m]
    turn: Floats  # (3, 3)
    center: Floats  # (3,) [m]
    quaternion: tuple[float, float, float, float]  # of the turn, (w, x, y, z)

    def position(self) -> Floats:
        """Return the place (3,) of the origin of the frame in which the wall is given."""
        return np.asarray(self.center + self.shift - product(self.turn, self.center))

    def placed(self, points: Floats) -> Floats:
        """Return the present places of points (3, N) of the wall as it is given."""
        middle = self.center[:, None]
        return np.asarray(middle + self.shift[:, None] + product(self.turn, points - middle))

    def turned(self, vectors: Floats) -> Floats:
        """Return vectors (3, N) of the frame of the wall in the scene."""
        return product(self.turn, vectors)

    def given(self, points: Floats) -> Floats:
        """Return points (3, N) of the scene in the frame in which the wall is given."""
        middle = self.center[:, None]
        return np.asarray(middle + product(self.turn.T, points - self.shift[:, None] - middle))


def pose(motion: WallMotion | None, time: float) -> Pose:
    """Return the pose of a wall with this motion at a time [s]."""
    found, center, turn, quaternion = np.zeros(3), np.zeros(3), np.eye(3), (1.0, 0.0, 0.0, 0.0)
    for one in parts_of(motion):
        if isinstance(one, Placed):
            found, quaternion, turn = np.array(one.position), one.orientation, np.array(one.turn)
        elif isinstance(one, Rotation):
            center, turn, half = np.array(one.center), _turned_by(one, one.rate * time), 0.5 * one.rate * time
            x, y, z = (math.sin(half) * unit_axis(one)).tolist()
            quaternion = (math.cos(half), x, y, z)
        elif isinstance(one, Path):
            found = found + one.displacement(time)
        else:
            found = found + one.harmonic((0.0, 0.0, 0.0)).position(time)
    return Pose(found, turn, center, quaternion)


def _turned_by(rotation: Rotation, angle: float) -> Floats:
    """Return the matrix (3, 3) of a rotation by an angle [rad]."""
    # Rodrigues: cos a + (1 - cos a) k k^T + sin a [k], where 1 - cos a = 2 sin^2(a/2)
    k, half = unit_axis(rotation), math.sin(0.5 * angle)
    across = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    versine = 2.0 * half * half
    return np.asarray((1.0 - versine) * np.eye(3) + versine * np.multiply.outer(k, k) + math.sin(angle) * across)


def product(matrix: Floats, other: ArrayLike) -> Floats:
    """Return (3, 3) times (3,) or (3, n), rounded term by term: the last bit of BLAS depends on the processor."""
    rows = np.asarray(other)
    return np.asarray(sum(np.multiply.outer(matrix[:, k], rows[k]) for k in range(3)))

"""Rotations as unit quaternions (w, x, y, z): the forms of the argument, and their use."""

import logging
import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ..common import rows
from ..common.checks import Vector, array, number, parts_of, shown, vector
from ..errors import SceneError
from ..kernel.gravity import Gravity, as_vector
from ..kernel.limits import TINY, UNIT_LENGTH
from ..kernel.vector import Vec, absolute, dot, vec
from ..motion.wall import product as product
from .frames import Framed

_LOG = logging.getLogger("swarm")
Quaternion = tuple[float, float, float, float]
# How far the products of the rows of a rotation matrix may be from those of unit vectors: single precision in a file.
_ORTHONORMAL = 1e-6


def quaternion(name: str, value: Any) -> Quaternion | None:
    """Return a rotation as a unit quaternion, or None for the identity.

    Args:
        name: the argument's name, for errors.
        value: None, four numbers (w, x, y, z) not all 0, {"axis": three numbers not all 0, "angle": radians}, or three
            rows of a rotation matrix, from the surface's own frame to the scene's.

    Raises:
        SceneError: `value` has another form, is of length 0, or is a matrix that does not keep lengths or that mirrors.

    >>> quaternion("rotation", {"axis": (0, 0, 2), "angle": math.pi})
    (6.123233995736766e-17, 0.0, 0.0, 1.0)
    """
    if value is None:
        return None
    if isinstance(value, Mapping):
        if set(value) != {"axis", "angle"}:
            raise SceneError(f"{name} must have the keys axis and angle, got {sorted(map(str, value))}")
        axis = unit(f"{name}.axis", value["axis"])
        angle = number(f"{name}.angle", value["angle"], "a finite number of radians")
        if abs(angle) > 2.0 * math.pi:
            _LOG.warning(
                "%s.angle = %g rad is more than a turn; angles are in radians: %g degrees are %.6g",
                name, angle, angle, math.radians(angle),
            )  # fmt: skip
        half = 0.5 * angle
        turn = math.cos(half), *(math.sin(half) * part for part in axis)
    elif len(parts := parts_of(value) or ()) == 3 and all(parts_of(row) is not None for row in parts):
        given = np.array([vector(f"{name}[{i}]", row) for i, row in enumerate(value)])
        turn = unit(name, _of_matrices(name, given)[0].tolist(), 4)
    else:
        turn = unit(name, value, 4)
    return turn if any(turn[1:]) else None  # type: ignore[return-value]


def quaternions(name: str, value: Any, count: int) -> NDArray[np.float64]:
    """Return the rotations of many bodies as quaternions (n, 4), of the lengths that are given.

    Args:
        name: the argument's name, for errors.
        value: a quaternion for each body (n, 4) or the rows of a rotation matrix for each (n, 3, 3), or one for all.
        count: the number of bodies.

    Raises:
        SceneError: `value` has another shape, a quaternion is 0, or a matrix does not keep lengths or mirrors.
    """
    given = array(name, value)
    if given.shape not in ((3, 3), (count, 3, 3)):
        return rows.quaternions(name, value, count)
    return rows.quaternions(name, np.broadcast_to(_of_matrices(name, given), (count, 4)), count)


def _of_matrices(name: str, given: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit quaternions of rotation matrices, each by its largest part, without a difference of near numbers."""
    many = given.reshape(-1, 3, 3)
    products = many @ np.swapaxes(many, 1, 2)
    bad = ~(np.abs(products - np.eye(3)).max(axis=(1, 2)) <= _ORTHONORMAL) | (np.linalg.det(many) < 0.0)
    if bad.any():
        i = int(bad.argmax())
        where, one = (f"{name}[{i}]" if given.ndim == 3 else name), many[i]
        raise SceneError(
            f"{where} must be a matrix of three rows that are of length 1, at right angles and not mirrored, got "
            f"{one.tolist()}: the lengths of its rows are {np.sqrt((one**2).sum(axis=1)).tolist()}, and its "
            f"determinant is {np.linalg.det(one):g}; take the size of a surface from its own arguments"
        )
    # 4 q q^T is linear in the matrix (Shepperd 1978).
    x, y, z = many.diagonal(axis1=1, axis2=2).T
    outer = np.zeros((len(many), 4, 4))
    for i, square in enumerate((1.0 + x + y + z, 1.0 + x - y - z, 1.0 - x + y - z, 1.0 - x - y + z)):
        outer[:, i, i] = square
    for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        outer[:, 0, i] = outer[:, i, 0] = many[:, k - 1, j - 1] - many[:, j - 1, k - 1]
        outer[:, j, k] = outer[:, k, j] = many[:, k - 1, j - 1] + many[:, j - 1, k - 1]
    largest = outer.diagonal(axis1=1, axis2=2).argmax(axis=1)
    chosen = outer[np.arange(len(many)), largest]
    turns: NDArray[np.float64] = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    return turns


def unit(name: str, value: Any, count: int = 3) -> tuple[float, ...]:
    """Return `count` numbers scaled to length 1 from any finite length, or unchanged if their length is 1."""
    parts: tuple[float, ...] = ()
    if count == 3:
        parts = vector(name, value)
    else:
        parts = tuple(number(f"{name}[{i}]", part) for i, part in enumerate(parts_of(value) or ()))
        if len(parts) != count:
            raise SceneError(
                f"{name} must be a quaternion of four numbers (w, x, y, z), a table of axis and angle, or three rows "
                f"of a rotation matrix, got {shown(value)}"
            )
    largest = max(map(abs, parts))
    if largest == 0.0:
        raise SceneError(f"{name} must not be of length 0, got {tuple(parts)}")
    # Scaled first: the square of a part itself may overflow or underflow.
    scaled = [part / largest for part in parts]
    length = math.hypot(*scaled)
    if abs(math.hypot(*parts) - 1.0) <= UNIT_LENGTH:
        # Scaled values keep their bits: a surface from its own repr or table equals the original.
        return parts
    return tuple(part / length for part in scaled)


Direction = Annotated[Vector, unit]


def normalized(vectors: NDArray[np.float64], axis: int = 0) -> NDArray[np.float64]:
    """Return the vectors along an axis of an array, divided by their lengths; a vector of length 0 stays 0."""
    lengths = np.sqrt((vectors**2).sum(axis=axis, keepdims=True))
    return np.asarray(vectors / np.maximum(lengths, TINY))


def matrix(turn: Quaternion | None) -> NDArray[np.float64]:
    """Return the rotation matrix of a unit quaternion: from the surface's own frame to the scene's."""
    return np.eye(3) if turn is None else np.array(_matrix_of(*turn))


def matrices(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    return np.moveaxis(np.array(_matrix_of(*turns.T)), 2, 0)


def _matrix_of(w: Any, x: Any, y: Any, z: Any) -> list[list[Any]]:
    return [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]


def onto(axis: Vector) -> Quaternion | None:
    """Return the shortest rotation of the z axis onto the unit vector `axis`."""
    x, y, z = axis
    if x == 0.0 and y == 0.0:
        return None if z > 0.0 else (0.0, 1.0, 0.0, 0.0)
    # Half way between z and the axis; near -z their sum cancels, which does no harm to the quaternion.
    return unit("axis", (1.0 + z, -y, x, 0.0), 4)  # type: ignore[return-value]


def after(second: Quaternion | None, first: Quaternion | None) -> Quaternion | None:
    """Return the rotation `first`, followed by `second`."""
    if first is None or second is None:
        return second if first is None else first
    a, b, c, d = second
    w, x, y, z = first
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def turned(turn: Quaternion | None, point: Vector) -> Vector:
    """Return a vector, rotated."""
    return point if turn is None else tuple(product(matrix(turn), point).tolist())


def turned_back(turn: Quaternion | None, point: Vector) -> Vector:
    """Return a vector of the scene in the surface's own frame."""
    return point if turn is None else tuple(product(matrix(turn).T, point).tolist())


class Rotated(Framed):
    """A surface `body` in its own frame, and the rows of the matrix from that frame to the scene's."""

    body: Any
    x: Vec
    y: Vec
    z: Vec

    def vector_in(self, a):
        """Return a vector of the scene in the surface's own frame."""
        return self.x * a.x + self.y * a.y + self.z * a.z

    def vector_out(self, a):
        """Return a vector of the surface's own frame in the scene."""
        return Vec(dot(self.x, a), dot(self.y, a), dot(self.z, a))

    place_in = end_in = velocity_in = way_in = vector_in
    place_out = end_out = normal_out = vector_out

    def swings_in(self, swings):
        """Return the swings of a wall in the frame of the body."""
        return swings.turned(self.vector_in)

    def seen_in(self, seen):
        # The drive, which bounds the flight along a direction, is turned into the frame of the body too.
        drive = seen.drive
        jerks = drive.jerks.x * absolute(self.x) + drive.jerks.y * absolute(self.y) + drive.jerks.z * absolute(self.z)
        turn = drive.turn
        if turn is not None:
            turn = turn._replace(axis=self.vector_in(turn.axis))
        return self._flight_in(seen)._replace(drive=drive._replace(jerks=jerks, turn=turn))

    def flat_normal(self):
        n = self.body.flat_normal()
        return None if n is None else self.vector_out(n)

    def gravity_in(self, gravity):
        """Return gravity, or None, in the surface's own frame."""
        if gravity is None:
            return None
        turned = self.vector_in(as_vector(gravity))
        return Gravity(turned.x, turned.y, turned.z)


def framed(axes: NDArray[np.float64], body: Any) -> Any:
    """Return a surface with these columns as its own axes, as a record for kernels."""
    if np.array_equal(axes, np.eye(3)):
        return body
    right = np.rint(axes)
    if hasattr(body, "by_right_angles") and np.abs(axes - right).max() <= UNIT_LENGTH:
        return body.by_right_angles(right)
    return Rotated(body, *map(vec, axes.tolist()))


def rotated(turn: Quaternion | None, body: Any) -> Any:
    """Return a rotated surface as a record for kernels; `body` has its centre at `turned_back(turn, center)`."""
    return framed(matrix(turn), body)

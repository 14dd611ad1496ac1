"""Quadric: phi = d.A d + b.d + c, in the units of its matrix; kernels see it in its principal frame."""

import functools
import math
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.checks import Vector, entries, vector
from ...common.validated import Number, Point
from ...errors import SceneError
from .. import rotation as rotations
from ..balls.parallel import Parallel
from ..surface import UNBOUNDED, Box, box_around, extents, farthest, side_sign
from .quadratic import QuadricNumbers, quadric_numbers

# An asymmetry of this part of the largest entry is round-off.
_ASYMMETRY = 1e-12

# An eigenvalue this small, relative to the largest, is round-off.
_FLAT = 1e-14
# The square is completed for eigenvalues above this part of the largest: a centre farther away would cost more digits
# near the origin of the formula than it saves.
_NEAR = 1e-3

Matrix = tuple[Vector, Vector, Vector]


class PrincipalFrame(NamedTuple):
    """A quadric in its principal frame: phi = sum A d^2 + sum b d - level, d = axes^T (r - center) - shift."""

    axes: NDArray[np.float64]  # as columns
    curvatures: NDArray[np.float64]  # A
    linear: NDArray[np.float64]  # b
    shift: NDArray[np.float64]
    level: float
    middle: NDArray[np.float64]  # where the gradient is 0, except for the linear part along the axes without curvature
    height: float  # the level with all squares completed: phi = sum A d^2 - height, plus the linear part
    slope: float  # |b| along the axes without curvature

    def one_sign(self) -> bool:
        """Whether phi has the same sign everywhere."""
        low, high = self.curvatures.min(), self.curvatures.max()
        there = low < 0.0 < high if self.height == 0.0 else max(self.height * low, self.height * high) > 0.0
        return self.slope == 0.0 and not there

    def encloses(self, sign: float) -> bool:
        """Whether the admissible side is within an ellipsoid, or a cylinder over an ellipse."""
        return self.slope == 0.0 and sign * self.height > 0.0 and bool((sign * self.curvatures >= 0.0).all())

    def size(self) -> float:
        """The shortest semi-axis, or the radius of curvature of a vertex; infinite for planes and cones."""
        steepest = abs(self.curvatures).max()
        if steepest == 0.0:
            return math.inf
        size = math.sqrt(abs(self.height) / steepest) if self.slope == 0.0 else self.slope / (2.0 * steepest)
        return float(size) or math.inf

    def tightest(self, sign: float) -> tuple[float, NDArray[np.float64] | None]:
        """The smallest radius of curvature of a side, and where it is relative to the center: None if infinite."""
        most = float((sign * self.curvatures).max())
        if most <= 0.0:
            return math.inf, None
        curved = self.curvatures != 0.0
        along = np.where(curved, 0.0, self.linear)
        if self.slope > 0.0:
            # On the axis of the paraboloid the squares are 0, and |grad phi| is the slope.
            vertex = along * (self.height / self.slope**2)
            return self.slope / (2.0 * most), rotations.product(self.axes, np.where(curved, self.middle, vertex))
        # The least sum of A^2 x^2 with a given sum of A x^2 is on the axis of the least A of the same sign.
        reach = np.where(self.curvatures * self.height > 0.0, abs(self.curvatures), math.inf)
        k = int(np.argmin(reach))
        if self.height == 0.0:
            return 0.0, rotations.product(self.axes, self.middle)
        vertex = math.sqrt(abs(self.height) / float(reach[k])) * np.eye(3)[k]
        radius = math.sqrt(abs(self.height) * float(reach[k])) / most
        return radius, rotations.product(self.axes, self.middle + vertex)

    def semi_axes(self) -> list[float]:
        """sqrt(|height/A|)"""
        return [math.sqrt(abs(self.height / a)) if a else math.inf for a in self.curvatures.tolist()]


def principal_frame(matrix: NDArray[np.float64], linear: NDArray[np.float64], constant: float) -> PrincipalFrame:
    """Return the principal frame of d.A d + b.d + c."""
    # The eigenvectors of a diagonal matrix are the axes themselves, exactly.
    diagonal = not np.any(matrix - np.diag(np.diag(matrix)))
    curvatures, axes = (np.diag(matrix).copy(), np.eye(3)) if diagonal else np.linalg.eigh(matrix)
    axes = axes * np.sign(np.linalg.det(axes))
    steepest = abs(curvatures).max()
    curvatures[abs(curvatures) <= _FLAT * steepest] = 0.0
    linear = rotations.product(axes.T, linear)
    linear[abs(linear) <= _FLAT * abs(linear).max()] = 0.0
    curved, near = curvatures != 0.0, abs(curvatures) > _NEAR * steepest
    # A x^2 + b x = A (x + b/2A)^2 - b^2/4A
    middle = np.where(curved, -0.5 * linear / np.where(curved, curvatures, 1.0), 0.0)
    squares = curvatures * middle**2
    height, round_off = squares.sum() - constant, _FLAT * (abs(squares).sum() + abs(constant))
    return PrincipalFrame(
        axes,
        curvatures,
        np.where(near, 0.0, linear),
        np.where(near, middle, 0.0),
        float(squares[near].sum() - constant),
        middle,
        float(height) if abs(height) > round_off else 0.0,
        float(np.linalg.norm(linear[~curved])),
    )


def _symmetric(name: str, value: Any) -> Matrix:
    """Return `value` as the three rows of a symmetric matrix."""
    rows = entries(name, value, 3, "three rows of three numbers")
    a = np.array([vector(f"{name}[{i}]", row) for i, row in enumerate(rows)])
    for i, k in ((0, 1), (0, 2), (1, 2)):
        if abs(a[i, k] - a[k, i]) > _ASYMMETRY * abs(a).max():
            raise SceneError(
                f"{name} must be symmetric, got {name}[{i}][{k}] = {a[i, k]:g} and {name}[{k}][{i}] = {a[k, i]:g}"
            )
    first, second, third = (tuple(row) for row in (0.5 * (a + a.T)).tolist())
    return first, second, third


@dataclass(frozen=True, repr=False)
class Quadric(Parallel):
    """The surface d.A d + b.d + c = 0 with d = r - center: phi is the left side, and below 0 is inside.

    Args:
        matrix: A, three rows of three numbers, symmetric.
        vector: b, three numbers.
        constant: c.
        center: three numbers [m].
        side: "inside" (phi <= 0) or "outside" (phi >= 0), the admissible part.

    Raises:
        SceneError: an argument is out of its range, A is not symmetric, or phi is nowhere 0 with a change of sign.

    >>> Quadric(matrix=((1, 0, 0), (0, 1, 0), (0, 0, -1)), constant=-0.25).phi([[0.5], [0.0], [0.0]])
    array([0.])
    """

    nouns = ("quadric", "quadric", "conic", "conic")
    may_have_tip = True
    matrix: Annotated[Matrix, _symmetric]
    vector: Point = (0.0, 0.0, 0.0)
    constant: Number = 0.0
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (any(map(any, self.matrix)) or any(self.vector)):
            raise SceneError("matrix must not be all 0 where vector is, got both 0")
        if self._frame.one_sign():
            raise SceneError(
                f"constant must leave a surface with an inside and an outside, got {self.constant:g}, "
                "for which phi has the same sign everywhere"
            )

    @functools.cached_property
    def _frame(self) -> PrincipalFrame:
        return principal_frame(np.array(self.matrix), np.array(self.vector), self.constant)

    def _axes(self) -> NDArray[np.float64]:
        """The principal axes in the scene, as columns."""
        return rotations.product(rotations.matrix(self.rotation), self._frame.axes)

    def walls(self) -> tuple[Any]:
        return (rotations.framed(self._axes(), self.numbers()),)

    def own_center(self) -> Vector:
        x, y, z = (rotations.product(self._axes().T, self.center) + self._frame.shift).tolist()
        return x, y, z

    def numbers(self) -> QuadricNumbers:
        frame = self._frame
        return quadric_numbers(self.own_center(), frame.curvatures, frame.linear, frame.level, self.side)

    def own_tightest(self) -> tuple[float, NDArray[np.float64] | None]:
        return self._frame.tightest(side_sign(self.side))

    def framed_alike(self, wall: Any) -> Any:
        return rotations.framed(self._axes(), wall)

    def size(self) -> float:
        return self._frame.size()

    def bounds(self) -> Box:
        if not self._frame.encloses(side_sign(self.side)):
            return UNBOUNDED
        x, y, z = (np.array(self.center) + rotations.product(self._axes(), self._frame.middle)).tolist()
        return box_around((x, y, z), extents(self._axes(), self._frame.semi_axes()), "inside")

    def extent(self) -> float:
        lengths = [length for length in (*self._frame.semi_axes(), self.size()) if math.isfinite(length)]
        return farthest(self.center) + math.hypot(*self._frame.middle) + max(lengths, default=0.0)

"""The principal frame of a quadric: its axes, the squares completed, and what its shape follows from."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks import Vector

# Parts of the largest: an eigenvalue, and a tilt of an axis this small are round-off.
_FLAT, _TILT = 1e-14, 1e-15
# The square is completed for eigenvalues above this part of the largest: a centre farther away would cost more digits
# near the origin of the formula than it saves.
_NEAR = 1e-3


class Frame(NamedTuple):
    """A quadric in its principal frame: phi = sum A d^2 + sum b d - level, d = axes^T (r - center) - shift."""

    axes: NDArray[np.float64]  # as columns
    curvatures: NDArray[np.float64]  # A
    linear: NDArray[np.float64]  # b
    shift: NDArray[np.float64]
    level: float
    middle: NDArray[np.float64]  # where the gradient is 0, except for the slope
    height: float  # the level with all squares completed: phi = sum A d^2 - height, plus the slope
    slope: float  # |b| along the axes without curvature

    def one_sign(self) -> bool:
        """Whether phi is of the same sign everywhere."""
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

    def semi_axes(self) -> list[float]:
        """sqrt(|height/A|)"""
        return [math.sqrt(abs(self.height / a)) if a else math.inf for a in self.curvatures.tolist()]


def principal_frame(matrix: NDArray[np.float64], linear: NDArray[np.float64], constant: float) -> Frame:
    """The principal frame of d.A d + b.d + c."""
    # The eigenvectors of a diagonal matrix are the axes themselves, exactly.
    diagonal = not np.any(matrix - np.diag(np.diag(matrix)))
    curvatures, axes = (np.diag(matrix).copy(), np.eye(3)) if diagonal else np.linalg.eigh(matrix)
    axes = axes * np.sign(np.linalg.det(axes))
    steepest = abs(curvatures).max()
    curvatures[abs(curvatures) <= _FLAT * steepest] = 0.0
    linear = axes.T @ linear
    linear[abs(linear) <= _FLAT * abs(linear).max()] = 0.0
    curved, near = curvatures != 0.0, abs(curvatures) > _NEAR * steepest
    # A x^2 + b x = A (x + b/2A)^2 - b^2/4A
    middle = np.where(curved, -0.5 * linear / np.where(curved, curvatures, 1.0), 0.0)
    squares = curvatures * middle**2
    height, round_off = squares.sum() - constant, _FLAT * (abs(squares).sum() + abs(constant))
    return Frame(
        axes,
        curvatures,
        np.where(near, 0.0, linear),
        np.where(near, middle, 0.0),
        float(squares[near].sum() - constant),
        middle,
        float(height) if abs(height) > round_off else 0.0,
        float(np.linalg.norm(linear[~curved])),
    )


def extents(axes: NDArray[np.float64], semi_axes: Any) -> Vector:
    """Half extents along x, y, z of an ellipsoid; an infinite semi-axis makes a cylinder of it."""
    tilts = np.where(abs(axes) > _TILT, axes, 0.0)
    x, y, z = (math.hypot(*(n * a for n, a in zip(row, semi_axes, strict=True) if n)) for row in tilts.tolist())
    return x, y, z

"""Surfaces at an instant: their gaps at points, and the bounds and half-spaces that hold their admissible sides."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .. import motion as motions
from .surface import SIDES, Box, HalfSpace, Surface


def side_of(surface: Surface) -> float:
    """+1 for a cavity, -1 for a solid."""
    return SIDES[getattr(surface, "side", "inside")]


def gaps_of(images: Sequence[Surface], points: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Signed gap of every image of a surface, (images, N)."""
    return np.array([side_of(image) * image.phi(points, time) for image in images])


def gradient_of(images: Sequence[Surface], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gradient of the gap of the image that has the largest one, (3, N)."""
    gradients = np.array([side_of(image) * image.gradient(points) for image in images])
    worst = gaps_of(images, points, 0.0).argmax(axis=0) if len(images) > 1 else np.zeros(points.shape[1], np.int64)
    return np.asarray(gradients[worst, :, np.arange(points.shape[1])].T)


def box_of(surface: Surface, time: float) -> Box:
    """The bounds of a surface at a time [s]."""
    low, high = (np.array(corner) for corner in surface.bounds())
    if surface.motion is not None:
        found = motions.pose(surface.motion, time)
        if np.array_equal(found.turn, np.eye(3)):
            low, high = low + found.shift, high + found.shift
        elif np.isfinite([low, high]).all():
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            middle, half = found.placed(middle[:, None])[:, 0], np.abs(found.turn) @ half
            low, high = middle - half, middle + half
        else:
            low, high = np.full(3, -math.inf), np.full(3, math.inf)
    return tuple(low.tolist()), tuple(high.tolist())


def planes_of(surface: Surface, planes: list[HalfSpace], time: float) -> list[HalfSpace]:
    """Half-spaces of a surface at a time [s]."""
    if surface.motion is None or not planes:
        return planes
    found = motions.pose(surface.motion, time)
    normals = found.turned(np.array([normal for normal, _offset in planes]).T)
    offsets = np.array([offset for _normal, offset in planes]) + (normals * found.position()[:, None]).sum(axis=0)
    return [(tuple(normal), offset) for normal, offset in zip(normals.T.tolist(), offsets.tolist(), strict=True)]

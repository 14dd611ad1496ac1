"""Surfaces at an instant: gaps at points, boxes around admissible sides, and whether these have a point in common."""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import motion as motions
from ..kernel.limits import TINY
from ..state import Floats
from .surface import SIDES, Box, HalfSpace, Surface

# The search for an admissible point: number of starts, and moves of each onto the surface that it violates most.
_STARTS = 512
_MOVES = 30
# Then this number of the nearest points is moved onto all surfaces that they violate together.
_NEAREST = 32
_STEPS = 100
# Each move aims at this multiple of the gap: a little past the surface, so that thin volumes are hit.
_PAST = 1.05


def side_of(surface: Surface) -> float:
    """+1 for a cavity, -1 for a solid."""
    return SIDES[getattr(surface, "side", "inside")]


def gaps_of(images: Sequence[Surface], points: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Signed gap of every image of a surface, (images, N)."""
    return np.array([side_of(image) * image.phi(points, time) for image in images])


def distances(surface: Any, points: NDArray[np.float64], time: float = 0.0) -> NDArray[np.float64]:
    """Distances of points (3, N) from a surface to first order [m], above 0 outside."""
    slopes = np.sqrt((surface.gradient(points, time) ** 2).sum(axis=0))
    # At the centre of a ball the slope is 0, and a point is as far inside as can be.
    with np.errstate(over="ignore"):
        return np.asarray(surface.phi(points, time) / np.maximum(slopes, TINY))


def distances_of(images: Sequence[Surface], points: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """The gap over its gradient of every image of a surface, (images, N) [m]."""
    return np.array([side_of(image) * distances(image, points, time) for image in images])


def gradient_of(images: Sequence[Surface], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gradient of the gap of the image that has the largest one, (3, N)."""
    gradients = np.array([side_of(image) * image.gradient(points) for image in images])
    worst = gaps_of(images, points, 0.0).argmax(axis=0) if len(images) > 1 else np.zeros(points.shape[1], np.int64)
    return np.asarray(gradients[worst, :, np.arange(points.shape[1])].T)


def box_of(surface: Surface, time: float, filled: bool = False) -> Box:
    """Return the bounds of a surface at a time [s], or the box around the volume that it encloses, if `filled`."""
    low, high = (np.array(corner) for corner in (surface.enclosing_box() if filled else surface.bounds()))
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
    """Return the half-spaces of a surface at a time [s]."""
    if surface.motion is None or not planes:
        return planes
    found = motions.pose(surface.motion, time)
    normals = found.turned(np.array([normal for normal, _offset in planes]).T)
    offsets = np.array([offset for _normal, offset in planes]) + (normals * found.position()[:, None]).sum(axis=0)
    return [(tuple(normal), offset) for normal, offset in zip(normals.T.tolist(), offsets.tolist(), strict=True)]


def has_room(
    low: Floats, high: Floats, gaps: Callable[[Floats], Floats], gradient: Callable[[int, Floats], Floats]
) -> bool:
    """Whether a point of a box is admissible.

    Args:
        low: lowest corner of the box (3, 1) [m].
        high: highest corner.
        gaps: function that returns the gaps of all surfaces at points (3, N), shape (surfaces, N).
        gradient: function that returns the gradient of the gap of surface i at points (3, N), shape (3, N).
    """
    points = low + (high - low) * np.random.default_rng(0).random((3, _STARTS))
    for _ in range(_MOVES):
        found = gaps(points)
        if (found.max(axis=0) <= 0.0).any():
            return True
        worst = found.argmax(axis=0)
        for i in np.unique(worst).tolist():
            outside = worst == i
            slopes = gradient(i, points[:, outside])
            slope = np.maximum((slopes**2).sum(axis=0), TINY)
            points[:, outside] -= _PAST * found[i, outside] / slope * slopes
    points = points[:, np.argsort(gaps(points).max(axis=0))[:_NEAREST]]
    for _ in range(_STEPS):
        # One surface after the other converges slowly along a sharp edge; a Newton step for all near ones does not.
        found = gaps(points)
        gradients = np.array([gradient(i, points) for i in range(len(found))])
        lengths = np.maximum(np.sqrt((gradients**2).sum(axis=1)), TINY)
        found = found / lengths
        worst = found.max(axis=0)
        if (worst <= 0.0).any():
            return True
        near = found > -worst
        normals = (gradients / lengths[:, None] * near[:, None]).transpose(2, 0, 1)
        wanted = ((found + (_PAST - 1.0) * worst) * near).T[:, :, None]
        # Where normals are nearly parallel and the volumes are apart, the step leads far away.
        points = np.clip(points - (np.linalg.pinv(normals) @ wanted)[:, :, 0].T, 2.0 * low - high, 2.0 * high - low)
    return False


def are_there_together(one: Surface, other: Surface) -> bool:
    """Whether there is a time at which both surfaces are present."""
    always = ((0.0, math.inf),)
    pairs = itertools.product(one.present or always, other.present or always)
    return any(max(begins) < min(ends) for begins, ends in (zip(*pair, strict=True) for pair in pairs))

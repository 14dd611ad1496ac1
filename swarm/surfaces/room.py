"""Whether surfaces leave room for particles: the search for a point on the admissible side of all of them."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# The search for an admissible point: number of starts, and moves of each onto the surface that it violates most.
_STARTS = 512
_MOVES = 30
# Then this many of the nearest are moved onto all surfaces that they violate together.
_NEAREST = 32
_STEPS = 100
# Each move aims this far, relative to the gap: a little past the surface, so that thin volumes are hit.
_PAST = 1.05


def has_room(
    low: Floats, high: Floats, gaps: Callable[[Floats], Floats], gradient: Callable[[int, Floats], Floats]
) -> bool:
    """Whether a point of a box is admissible.

    Args:
        low: lowest corner of the box (3, 1) [m].
        high: highest corner.
        gaps: those of every surface at points (3, N), shape (surfaces, N).
        gradient: of the gap of surface i at points (3, N), shape (3, N).
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
            slope = np.maximum((slopes**2).sum(axis=0), np.finfo(np.float64).tiny)
            points[:, outside] -= _PAST * found[i, outside] / slope * slopes
    points = points[:, np.argsort(gaps(points).max(axis=0))[:_NEAREST]]
    for _ in range(_STEPS):
        # One surface after the other converges slowly along a sharp edge; a Newton step for all near ones does not.
        found = gaps(points)
        gradients = np.array([gradient(i, points) for i in range(len(found))])
        lengths = np.maximum(np.sqrt((gradients**2).sum(axis=1)), np.finfo(np.float64).tiny)
        found = found / lengths
        worst = found.max(axis=0)
        if (worst <= 0.0).any():
            return True
        near = found > -worst
        normals = (gradients / lengths[:, None] * near[:, None]).transpose(2, 0, 1)
        wanted = ((found + (_PAST - 1.0) * worst) * near).T[:, :, None]
        # Where normals are all but parallel and the volumes are apart, the step leads far away.
        points = np.clip(points - (np.linalg.pinv(normals) @ wanted)[:, :, 0].T, 2.0 * low - high, 2.0 * high - low)
    return False

"""Triangles of walls with a parametrisation: points (V, 3) [m] on a grid of it, and triangles (T, 3)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Triangles = tuple[NDArray[np.float64], NDArray[np.int64]]


def halved(a: Any, b: Any, c: Any, d: Any) -> NDArray[np.int64]:
    """Return the two triangles of each quadrilateral."""
    both = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    return np.asarray(both.reshape(-1, 3))

"""Frames as files want them: a row (x, y, z) a particle, from arrays of a row a coordinate."""

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


def rows(frames: list[NDArray[Any]], dtype: DTypeLike) -> NDArray[Any]:
    """(frames, n, 3) from arrays (3, n).

    A coordinate at a time: NumPy's copy of a transposed array goes along its rows of three and takes 3.5 times as long.
    """
    out = np.empty((len(frames), frames[0].shape[1], 3), dtype)
    for row, frame in zip(out, frames, strict=True):
        for axis in range(3):
            row[:, axis] = frame[axis]
    return out

"""The periodic cell of pairs of balls: three lengths, each None along an axis that does not repeat."""

from typing import Any, NamedTuple

import numpy as np

from ..kernel.jit import select
from ..kernel.vector import Vec


class Lengths(NamedTuple):
    """The lengths of the cell [m]."""

    x: Any
    y: Any
    z: Any


def _apart(length, x, y):
    """Return x - y for the nearest image of y."""
    if length is None:
        return x - y
    shift = length * np.floor((x - y) / length + 0.5)
    # The shift is applied to the place near the far face, where the difference to that face has no round-off.
    return select(shift > 0.0, (x - shift) - y, x - (y + shift))


def nearest(lengths, r, other):
    """Return the vector to a place `r` from the nearest image of the place `other`."""
    if lengths is None:
        return r - other
    return Vec(_apart(lengths.x, r.x, other.x), _apart(lengths.y, r.y, other.y), _apart(lengths.z, r.z, other.z))

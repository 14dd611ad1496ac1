"""The cell that repeats, as pairs of balls know it: three lengths, each None where it does not repeat."""

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
    """x - y, of the nearest image of y."""
    if length is None:
        return x - y
    shift = length * np.floor((x - y) / length + 0.5)
    # The one is moved that is near the far face: there the difference to it has no round-off.
    return select(shift > 0.0, (x - shift) - y, x - (y + shift))


def nearest(lengths, r, other):
    """The vector to a place from the nearest image of another one."""
    if lengths is None:
        return r - other
    return Vec(_apart(lengths.x, r.x, other.x), _apart(lengths.y, r.y, other.y), _apart(lengths.z, r.z, other.z))

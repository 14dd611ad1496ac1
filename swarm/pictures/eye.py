"""The eye of a picture: a parallel projection with z up, chosen from the extents of the walls."""

import math
from typing import NamedTuple

import numpy as np

from ..state import Floats

# Azimuths and elevations [degrees]: for a vessel as wide as deep; for one that is much wider than deep, or deeper than
# wide; for a tall one, a flat one, and a board.
_AZIMUTH, _WIDE, _DEEP = -60.0, -78.0, -12.0
_ELEVATION, _TALL, _FLAT, _BOARD = 20.0, 14.0, 42.0, 10.0
# An extent of this multiple of another one is much wider; a board is this multiple wider and higher than it is deep.
_MUCH, _THIN = 4.0, 6.0
# An extent below this part of the largest one counts as 0.
_NOTHING = 1e-9


class Eye(NamedTuple):
    """Directions to the right, up, and towards the eye: unit vectors."""

    right: Floats
    up: Floats
    near: Floats

    def seen(self, points: Floats) -> Floats:
        """Points (..., 3) [m] in the coordinates of the eye: to the right, up, and towards the eye [m]."""
        return np.asarray(points @ np.stack([self.right, self.up, self.near], axis=1))


def eye_at(azimuth: float, elevation: float) -> Eye:
    """The eye at these angles [degrees]: the longitude from the x axis, and the height above the horizon."""
    turn, height = math.radians(azimuth), math.radians(elevation)
    near = np.array([math.cos(height) * math.cos(turn), math.cos(height) * math.sin(turn), math.sin(height)])
    right = np.array([-math.sin(turn), math.cos(turn), 0.0])
    return Eye(right, np.cross(near, right), near)


def _between(part: float, first: float, middle: float, last: float) -> float:
    """Interpolate between three angles, at `part` -1 and below, 0, and 1 and above."""
    return middle + min(1.0, abs(part)) * ((last if part > 0.0 else first) - middle)


def eye_for(low: Floats, high: Floats, below: bool = False) -> Eye:
    """The eye that sees the two largest extents of a box, from above or from below."""
    x, y, z = np.maximum(high - low, _NOTHING * float((high - low).max()) or 1.0).tolist()
    ratio = math.log(x / y) / math.log(_MUCH)
    azimuth = _between(ratio, _DEEP, _AZIMUTH, _WIDE)
    if min(max(x, y), z) > _THIN * min(x, y):
        elevation = _BOARD
    else:
        steep = math.log(z / math.sqrt(x * y)) / math.log(_MUCH)
        elevation = _between(steep, _FLAT, _ELEVATION, _TALL)
    return eye_at(azimuth, -elevation if below else elevation)

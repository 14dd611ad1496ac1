"""Balls in the plane of a scene of two dimensions as discs of their size; and the size and colours of dots."""

from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import to_rgb
from numpy.typing import ArrayLike

from ..state import Floats

# The width of the edge of a disc [points], and its brightness relative to the disc.
_EDGE, _DARK = 0.4, 0.5
# All dots together cover about this many square points of a picture; the smallest and the largest size of a dot.
_DOTS, _SMALL, _LARGE = 2.5e4, 0.3, 24.0


class Discs(EllipseCollection):
    """Discs in the axes of a plane, at points (n, 2) [m]."""

    def __init__(self, axes: Any, points: Floats, radius: Floats, colour: Any) -> None:
        super().__init__(
            2.0 * radius, 2.0 * radius, np.zeros(len(radius)), units="xy", offsets=points,
            offset_transform=axes.transData, zorder=2, linewidths=_EDGE,
        )  # fmt: skip
        self._count = len(radius)
        self.paint(colour)
        axes.add_collection(self, autolim=False)

    def paint(self, colour: Any) -> None:
        """Set the colours of the discs: (n, 3), or one for all."""
        rows: Any = colours_of(colour, self._count)
        self.set_facecolor(rows)
        self.set_edgecolor(_DARK * rows)


def size_of_dots(count: int) -> float:
    """The size of each dot in a picture of `count` dots [square points]."""
    return float(np.clip(_DOTS / max(1, count), _SMALL, _LARGE))


def colours_of(colour: Any, n: int) -> Floats:
    """Return colours (n, 3), also from one colour for all."""
    rows: ArrayLike = [to_rgb(colour)] if isinstance(colour, str) else colour
    return np.broadcast_to(np.asarray(rows, np.float64)[:, :3], (n, 3))

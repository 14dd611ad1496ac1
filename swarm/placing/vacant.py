"""Places where a ball may still be put among others: small boxes, outside of which there is certainly no place.

Random places within them are uniform among all places that are left, and are found even if these are few.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ..scene import Scene
from ..state import Floats
from .cells import CellLists, find_free

# The width of the first boxes, as a fraction of the radius, and the most boxes for each ball and in addition.
_WIDTH, _MOST, _SOME = 0.7, 48, 1_000_000
# Boxes that are tested together.
_AT_ONCE = 1 << 19


class Vacant:
    """The boxes that are left for balls of a radius or more, among balls in `cells` and within the walls of a scene.

    Args:
        low, high: corners (3, 1) of a box around the volume.
        radius: for other balls; `wide`: for walls.
    """

    def __init__(self, scene: Scene, cells: CellLists, low: Floats, high: Floats, radius: float, wide: float) -> None:
        self._scene, self._cells, self.radius, self._wide = scene, cells, radius, wide
        self._low, axes = low, scene.axes()
        extent = (high - low)[:, 0]
        room = float(np.prod(extent[axes]))
        side = max(_WIDTH * radius, (room / (_MOST * cells.radius.size + _SOME)) ** (1.0 / len(axes)))
        counts = np.ones(3, np.int64)
        counts[axes] = np.maximum(1, np.ceil(extent[axes] / side)).astype(np.int64)
        self._axes, self._width = axes, np.where(counts > 1, extent / counts, extent)
        # Each box by its number along the three axes.
        found = [
            self._left(np.array(np.unravel_index(np.arange(first, min(first + _AT_ONCE, counts.prod())), counts)))
            for first in range(0, int(counts.prod()), _AT_ONCE)
        ]
        self._boxes: NDArray[np.int64] = np.concatenate(found, axis=1)

    def __len__(self) -> int:
        return int(self._boxes.shape[1])

    def refine(self) -> None:
        """Halve the boxes along each axis, and drop those without a place."""
        boxes = self._left(self._boxes)
        if boxes.shape[1] * 2 ** len(self._axes) > 4 * (_MOST * self._cells.radius.size + _SOME):
            self._boxes = boxes
            return
        self._width[self._axes] *= 0.5
        boxes[self._axes] *= 2
        for axis in self._axes:
            more = boxes.copy()
            more[axis] += 1
            boxes = np.concatenate([boxes, more], axis=1)
        parts = [self._left(boxes[:, k : k + _AT_ONCE]) for k in range(0, boxes.shape[1], _AT_ONCE)]
        self._boxes = np.concatenate(parts, axis=1) if parts else boxes

    def points(self, n: int, random: np.random.Generator) -> Floats:
        """Return random points (3, n) in the boxes."""
        points = np.zeros((3, n))
        chosen = self._boxes[:, random.integers(len(self), size=n)]
        within = chosen[self._axes] + random.random((len(self._axes), n))
        points[self._axes] = self._low[self._axes] + within * self._width[self._axes, None]
        return points

    def _left(self, boxes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the boxes in which there may be a place."""
        # The distance from the middle of a box to its corners [m].
        reach, n = 0.5 * math.sqrt(float((self._width[self._axes] ** 2).sum())), boxes.shape[1]
        if not n or reach >= self.radius:
            return boxes
        middles = np.zeros((3, n))
        middles[self._axes] = self._low[self._axes] + (boxes[self._axes] + 0.5) * self._width[self._axes, None]
        # If all corners of a box are nearer to a ball than balls may be, so is every point in it.
        kept = np.flatnonzero(find_free(self._cells, middles, np.full(n, self.radius - reach)))
        if self._scene.surfaces and kept.size:
            far = self._scene.distances_outside(middles[:, kept], 0.0, np.full(kept.size, self._wide))
            kept = kept[~(far > reach).any(axis=0)]
        return boxes[:, kept]

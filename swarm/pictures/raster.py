"""The opaque part of a picture, pixel by pixel, with its depth: triangles and balls, nearer ones before others."""

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..state import Floats, Indices
from ..surfaces.rotation import normalized
from .eye import Eye

# The light comes from above on the left, from behind the eye: to the right, up, and towards the eye.
LIGHT = np.array([-0.42, 0.58, 0.70])
# Shading: the part of a colour in the shadow; the exponent of the highlight and its whiteness.
_SHADOW, _SHINE, _WHITE = 0.45, 24.0, 0.45
# The largest number of pixels that are painted at once.
_MOST = 3_000_000
# The smallest radius of a ball [pixels].
_LEAST = 0.6


class Raster:
    """Pixels of a window in an eye's coordinates: lower left and upper right corner [m], and pixels a metre.

    Attributes:
        depth: (rows, columns), the lowest row first: the distance of each pixel's surface towards the eye [m], or -inf.
        colour: (rows, columns, 3), from 0 to 1.
    """

    def __init__(self, low: Floats, high: Floats, scale: float) -> None:
        self.low, self.scale = np.asarray(low, np.float64), scale
        wide, tall = (int(max(1, np.ceil(one * scale))) for one in np.subtract(high, low))
        self.depth = np.full((tall, wide), -np.inf)
        self.colour = np.ones((tall, wide, 3), np.float32)

    def copy(self) -> "Raster":
        """Return a raster with the same pixels, to paint more on it."""
        other = object.__new__(Raster)
        other.low, other.scale = self.low, self.scale
        other.depth, other.colour = self.depth.copy(), self.colour.copy()
        return other

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the pixels [m]."""
        rows, columns = self.depth.shape
        left, bottom = self.low
        return left, left + columns / self.scale, bottom, bottom + rows / self.scale

    def image(self) -> Floats:
        """Red, green, blue and opacity: (rows, columns, 4)."""
        return np.concatenate([self.colour, np.isfinite(self.depth)[..., None]], axis=2, dtype=np.float32)

    def hides(self, seen: Floats, within: float = 0.0) -> NDArray[np.bool_]:
        """Whether points (..., 3), in coordinates of the eye, are behind an opaque pixel by more than `within` [m]."""
        with np.errstate(invalid="ignore"):
            places = np.floor((seen[..., :2] - self.low) * self.scale)
            rows, columns = self.depth.shape
            there = ((places >= 0.0) & (places < (columns, rows))).all(axis=-1)
        found = np.zeros(seen.shape[:-1], bool)
        x, y = places[there].astype(np.int64).T
        found[there] = self.depth[y, x] > seen[there][:, 2] + within
        return found

    # --- Painting ----------------------------------------------------------------------------------------

    def triangles(self, seen: Floats, triangles: Indices, colour: Floats) -> None:
        """Paint triangles with corners (V, 3), in coordinates of the eye, and colours of the corners (V, 3)."""
        # Bodies before their birth have no position.
        triangles = triangles[np.isfinite(seen[triangles]).all(axis=(1, 2))]
        corners = seen[triangles]
        xy = (corners[..., :2] - self.low) * self.scale - 0.5
        first = np.ceil(xy[..., 1].min(axis=1)).astype(np.int64)
        last = np.floor(xy[..., 1].max(axis=1)).astype(np.int64)
        # In parts, so that memory is bounded
        boxes = np.maximum(1.0, np.prod(np.ptp(xy, axis=1) + 1.0, axis=1)).clip(max=float(self.depth.size))
        part = (np.cumsum(boxes) // _MOST).astype(np.int64)
        for begin, end in _runs(part):
            self._some(xy[begin:end], corners[begin:end, :, 2], first[begin:end], last[begin:end],
                       colour[triangles[begin:end]])  # fmt: skip

    def _some(self, xy: Floats, z: Floats, first: Indices, last: Indices, colour: Floats) -> None:
        rows, columns = self.depth.shape
        which, y = _spread(first.clip(0), last.clip(max=rows - 1))
        # Where each row cuts the sides of its triangle
        left, right = np.full(len(which), np.inf), np.full(len(which), -np.inf)
        for i, j in ((0, 1), (1, 2), (2, 0)):
            (ax, ay), (bx, by) = xy[which, i].T, xy[which, j].T
            with np.errstate(all="ignore"):
                at = ax + (y - ay) * (bx - ax) / (by - ay)
            crosses = (np.minimum(ay, by) <= y) & (y <= np.maximum(ay, by)) & (ay != by)
            left = np.where(crosses, np.minimum(left, at), left)
            right = np.where(crosses, np.maximum(right, at), right)
        ends = np.ceil(left.clip(0.0, columns)), np.floor(right.clip(-1.0, columns - 1.0))
        row, x = _spread(*(end.astype(np.int64) for end in ends))
        which, y = which[row], y[row]
        # Numbers across a triangle are linear: its first corner, and the weights of the two others.
        a, b, c = np.moveaxis(xy, 1, 0)
        u, v = b - a, c - a
        area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        inverse = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0.0)
        dx, dy = x - a[which, 0], y - a[which, 1]
        second = (dx * v[which, 1] - dy * v[which, 0]) * inverse[which]
        third = (dy * u[which, 0] - dx * u[which, 1]) * inverse[which]
        weights = np.stack([1.0 - second - third, second, third]).clip(0.0, 1.0)
        depth = (weights * z[which].T).sum(axis=0)
        place = y * columns + x
        won = self._win(place, depth)
        tints = np.einsum("kn,nkc->nc", weights[:, won], colour[which[won]])
        self.colour.reshape(-1, 3)[place[won]] = tints

    def balls(self, seen: Floats, radius: Floats, colour: Floats) -> None:
        """Paint shaded balls at points (n, 3), in coordinates of the eye, of a radius (n,) [m] and colours (n, 3)."""
        rows, columns = self.depth.shape
        middle, r = (seen[:, :2] - self.low) * self.scale - 0.5, np.maximum(radius * self.scale, _LEAST)
        ends = [(middle[:, k] - r, middle[:, k] + r) for k in (0, 1)]
        there = np.flatnonzero((ends[0][1] >= 0.0) & (ends[0][0] < columns) & (ends[1][1] >= 0.0) & (ends[1][0] < rows))
        for begin, end in _runs((np.cumsum((2.0 * r[there] + 1.0) ** 2) // _MOST).astype(np.int64)):
            some = there[begin:end]
            first, last = (np.round(one[some]).astype(np.int64) for one in ends[1])
            which, y = _spread(first.clip(0), last.clip(max=rows - 1))
            which = some[which]
            half = np.sqrt(np.maximum(r[which] ** 2 - (y - middle[which, 1]) ** 2, 0.0))
            left, right = np.ceil(middle[which, 0] - half), np.floor(middle[which, 0] + half)
            row, x = _spread(left.clip(0).astype(np.int64), right.clip(max=columns - 1).astype(np.int64))
            which, y = which[row], y[row]
            dx, dy = (x - middle[which, 0]) / r[which], (y - middle[which, 1]) / r[which]
            dz = np.sqrt(np.maximum(1.0 - dx**2 - dy**2, 0.0))
            place = y * columns + x
            won = self._win(place, seen[which, 2] + dz * radius[which])
            normals = np.stack([dx, dy, dz], axis=1)[won]
            self.colour.reshape(-1, 3)[place[won]] = lit(colour[which[won]], normals)

    def _win(self, place: Indices, depth: Floats) -> Indices:
        """Paint depths; return the indices of those that are nearest at their pixels."""
        flat = self.depth.reshape(-1)
        np.maximum.at(flat, place, depth)
        return np.flatnonzero(depth == flat[place])


def lit(colour: Floats, normals: Floats) -> Floats:
    """Light the colours (n, 3) of surfaces with normals (n, 3), in coordinates of the eye."""
    bright = (normals @ (LIGHT / np.sqrt(LIGHT @ LIGHT))).clip(0.0)
    half = LIGHT / np.sqrt(LIGHT @ LIGHT) + (0.0, 0.0, 1.0)
    shine = _WHITE * (normals @ (half / np.sqrt(half @ half))).clip(0.0) ** _SHINE
    shade = (_SHADOW + (1.0 - _SHADOW) * bright)[:, None] * colour
    return np.asarray(shade + shine[:, None] * (1.0 - shade))


def corners_of(eye: Eye, faces: Floats, colour: Floats) -> tuple[Floats, Indices, Floats]:
    """The arguments of `Raster.triangles` for lit faces (T, 3, 3) of colours (T, 3)."""
    seen = eye.seen(faces)
    normal = normalized(np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0]), 1)
    normal *= np.where(normal[:, 2:] < 0.0, -1.0, 1.0)
    tints = np.repeat(lit(colour, normal), 3, axis=0)
    return seen.reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3), tints


def _spread(first: Any, last: Any) -> tuple[Indices, Indices]:
    """All whole numbers from first to last of each pair, and the pair of each."""
    many = np.maximum(last - first + 1, 0)
    which = np.repeat(np.arange(len(many)), many)
    within = np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many)
    return which, first[which] + within


def _runs(part: Indices) -> list[tuple[int, int]]:
    """The begin and end of each run of equal numbers, which ascend."""
    if not len(part):
        return []
    cuts = [0, *(np.flatnonzero(np.diff(part)) + 1).tolist(), len(part)]
    return list(itertools.pairwise(cuts))

"""Curves on triangles: where numbers at the corners are 0, as at a height, and where two triangles form an angle."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..state import Floats, Indices
from ..surfaces.rotation import normalized

# Neighbours with normals that differ by more than this angle meet at an edge [rad].
_EDGE = math.radians(30.0)


def levels(points: Floats, triangles: Indices, heights: Floats) -> list[Floats]:
    """Return the curves in which horizontal planes at some heights [m] cut triangles."""
    return [curve for height in heights for curve in zeros(points, triangles, points[:, 2] - height)]


def zeros(points: Floats, triangles: Indices, above: Floats) -> list[Floats]:
    """Return the curves at which a function of points is 0."""
    is_above = above > 0.0
    mixed = triangles[is_above[triangles].any(axis=1) & ~is_above[triangles].all(axis=1)]
    if not len(mixed):
        return []
    alone = (is_above[mixed] == (is_above[mixed].sum(axis=1) == 1)[:, None]).argmax(axis=1)
    a, b, c = np.take_along_axis(mixed, (alone[:, None] + np.arange(3)) % 3, axis=1).T
    sides = np.sort(np.concatenate([np.stack([a, b], axis=1), np.stack([a, c], axis=1)]), axis=1)
    edges, places = np.unique(sides, axis=0, return_inverse=True)
    first, last = edges.T
    part = above[first] / (above[first] - above[last])
    return joined(points[first] + part[:, None] * (points[last] - points[first]), places.reshape(2, -1).T)


class _Sides(NamedTuple):
    """The sides of triangles: the two points of each; for sides of two triangles, these triangles and their angle."""

    ends: Indices
    is_pair: NDArray[np.bool_]
    mine: Indices
    other: Indices
    cosine: Floats


def _sides(points: Floats, triangles: Indices) -> _Sides:
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    key = sides[:, 0] * len(points) + sides[:, 1]
    order = np.argsort(key, kind="stable")
    begins = np.flatnonzero(np.diff(key[order], prepend=-1))
    is_pair = np.diff(begins, append=len(order)) == 2
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = normalized(np.cross(b - a, c - a), 1)
    mine, other = order[begins[is_pair]] // 3, order[begins[is_pair] + 1] // 3
    return _Sides(sides[order[begins]], is_pair, mine, other, (normal[mine] * normal[other]).sum(axis=1))


def creases(points: Floats, triangles: Indices) -> Indices:
    """Return the sides (E, 2) of triangles that are on a rim, or at which two triangles meet at an angle."""
    found = _sides(points, triangles)
    shown = ~found.is_pair
    shown[found.is_pair] = found.cosine < math.cos(_EDGE)
    return np.asarray(found.ends[shown])


def neighbours(points: Floats, triangles: Indices) -> tuple[Indices, Indices]:
    """Return the pairs of triangles that meet at a side smoothly."""
    found = _sides(points, triangles)
    smooth = found.cosine >= math.cos(_EDGE)
    return found.mine[smooth], found.other[smooth]


def joined(points: Floats, pairs: Indices) -> list[Floats]:
    """Return curves through points that are joined in pairs, each as long as it does not branch."""
    ways: dict[int, list[int]] = {}
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    for k, (a, b) in enumerate(pairs.tolist()):
        ways.setdefault(a, []).append(k)
        ways.setdefault(b, []).append(k)
    ends, left, curves = pairs.tolist(), [True] * len(pairs), []
    # Closed curves have no end: they begin where one of their pairs begins.
    begins = [point for point, of in ways.items() if len(of) != 2]
    for point in (*begins, *pairs[:, 0].tolist()):
        for start in ways[point]:
            if not left[start]:
                continue
            curve, at, k = [point], point, start
            while True:
                left[k] = False
                at = ends[k][0] + ends[k][1] - at
                curve.append(at)
                onward = [other for other in ways[at] if left[other]]
                if len(ways[at]) != 2 or not onward:
                    break
                k = onward[0]
            curves.append(points[curve])
    return curves


def runs(curve: Floats, kept: NDArray[np.bool_]) -> list[Floats]:
    """Return the parts of a curve with points that are kept, two points or more each."""
    return [curve[a:b] for a, b in spans(kept) if b - a > 1]


def spans(kept: NDArray[np.bool_]) -> Indices:
    """Return the runs of points that are kept: for each its first point, and the first point after it (n, 2)."""
    return np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(np.int8))).reshape(-1, 2)


def finer(curve: Floats, step: float) -> Floats:
    """Return a curve with points at most `step` apart [m]."""
    pieces = np.sqrt((np.diff(curve, axis=0) ** 2).sum(axis=1))
    many = np.maximum(1, np.ceil(pieces / step).astype(np.int64))
    place = np.concatenate([k + np.arange(n) / n for k, n in enumerate(many.tolist())] + [[float(len(pieces))]])
    return np.stack([np.interp(place, np.arange(len(curve)), one) for one in curve.T], axis=1)


def turning(points: Floats, triangles: Indices, faces: NDArray[np.bool_]) -> Indices:
    """Return the sides (E, 2) between a triangle that faces and one that does not."""
    found = _sides(points, triangles)
    return np.asarray(found.ends[found.is_pair][faces[found.mine] != faces[found.other]])

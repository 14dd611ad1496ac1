"""Curves on triangles: where planes cut them, their edges, and those where two of them meet at an angle."""

import math

import numpy as np
from numpy.typing import NDArray

from ..particles import Floats

Indices = NDArray[np.int64]

# Planes across each axis.
_PLANES = 5
# Neighbours whose normals differ by more than this angle meet at an edge [rad].
_EDGE = math.radians(30.0)


def across(points: Floats, triangles: Indices, frame: Floats, planes: int = _PLANES) -> list[Floats]:
    """The curves in which planes across the axes of a frame, the columns of a matrix, cut triangles."""
    curves: list[Floats] = []
    for axis in frame.T if len(points) else ():
        along = points @ axis
        for place in np.linspace(along.min(), along.max(), planes + 2)[1:-1]:
            curves += _section(points, triangles, along - place)
    return curves


def _section(points: Floats, triangles: Indices, above: Floats) -> list[Floats]:
    """The curves at which a function of points is 0."""
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


def creases(points: Floats, triangles: Indices) -> Indices:
    """The edges (E, 2) of triangles that are on a rim, or at which two of them meet at an angle."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    key = sides[:, 0] * len(points) + sides[:, 1]
    order = np.argsort(key, kind="stable")
    begins = np.flatnonzero(np.diff(key[order], prepend=-1))
    count = np.diff(begins, append=len(order))
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.sqrt((normal**2).sum(axis=1, keepdims=True)), 1e-300)
    of = normal[order // 3]
    pair = np.flatnonzero(count == 2)
    cosine = (of[begins[pair]] * of[begins[pair] + 1]).sum(axis=1)
    shown = count != 2
    shown[pair] = cosine < math.cos(_EDGE)
    return np.asarray(sides[order[begins[shown]]])


def joined(points: Floats, pairs: Indices) -> list[Floats]:
    """Curves through points that are joined in pairs, each as long as it does not branch."""
    ways: dict[int, list[int]] = {}
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    for k, (a, b) in enumerate(pairs.tolist()):
        ways.setdefault(a, []).append(k)
        ways.setdefault(b, []).append(k)
    ends, left, curves = pairs.tolist(), [True] * len(pairs), []
    # Closed curves have no end: they begin where one of the pairs does.
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

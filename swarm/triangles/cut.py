"""Triangles on smooth surfaces, cut to the parts that are a wall: finer where the cut is curved, for sharp edges.

Points are (V, 3) [m], triangles (T, 3). A *level* is a function of points (N, 3) to (N,), below 0 in the kept part.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from skimage.measure import marching_cubes

from ..state import Floats, Indices
from ..surfaces.rotation import normalized

Level = Callable[[Floats], Floats]

# Triangles near a cut are halved until it is this straight, as a part of their width, or there are this many of them.
_STRAIGHT, _MOST, _ROUNDS = 0.01, 1500, 6
# For each of many bodies that cut a surface this many more; for at most this many bodies.
_EACH, MOST_BODIES = 100, 200
# Bisections of an edge at a cut, and steps onto a surface.
_BISECTIONS, _STEPS = 8, 3
# Normals this parallel belong to a plane.
_FLAT = 1e-9
# Points along each side of the grid on which a surface is found, fewer where it is flat; cells beyond the surface
_POINTS, _FEW, _MARGIN = 40, 8, 2.0


class Cut(NamedTuple):
    """The rest of triangles after a cut, and the edges that the cut has made, pairs of points (R, 2).

    Attributes:
        origins: for each triangle the number of the original triangle (T,).
    """

    points: Floats
    triangles: Indices
    rims: Indices
    origins: Indices


class SmoothSurface(NamedTuple):
    """A smooth surface: phi and its gradient (N, 3) at points (N, 3)."""

    phi: Level
    gradient: Callable[[Floats], Floats]

    def normals(self, points: Floats) -> Floats:
        """The unit gradient; 0 where the gradient is 0 or NaN."""
        with np.errstate(all="ignore"):
            return normalized(np.nan_to_num(self.gradient(points)), 1)

    def distance(self, points: Floats) -> Floats:
        """phi as a distance to first order."""
        return np.asarray(self.phi(points) / np.maximum(np.sqrt((self.gradient(points) ** 2).sum(axis=1)), 1e-300))

    def onto(self, points: Floats, farthest: float) -> Floats:
        """Return the points moved onto the surface, each step at most `farthest` long [m]."""
        for _ in range(_STEPS):
            with np.errstate(all="ignore"):
                slope = self.gradient(points)
                way = (self.phi(points) / np.maximum((slope**2).sum(axis=1), 1e-300))[:, None] * slope
                far = np.sqrt((way**2).sum(axis=1, keepdims=True))
                way *= np.minimum(1.0, farthest / np.maximum(far, 1e-300))
            points = points - np.where(np.isfinite(way), way, 0.0)
        return points


def found_in(
    surface: SmoothSurface, low: Floats, high: Floats, frame: Floats, is_cut: bool = False
) -> tuple[Floats, Indices]:
    """Return the triangles of a surface in a box that is given in a frame, the columns of a matrix.

    A plane has few triangles, except where many bodies cut it: these are smaller.
    """
    points, triangles = _on_grid(surface, low, high, frame, _POINTS)
    if len(points) and not is_cut:
        normals = surface.normals(points)
        if np.abs(normals @ normals[0]).min() > 1.0 - _FLAT:
            return _on_grid(surface, low, high, frame, _FEW)
    return points, triangles


def _on_grid(surface: SmoothSurface, low: Floats, high: Floats, frame: Floats, count: int) -> tuple[Floats, Indices]:
    margin = _MARGIN * (high - low) / (count - 1.0)
    low, high = low - margin, high + margin
    axes = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) @ frame.T
    with np.errstate(all="ignore"):
        values = surface.phi(grid)
    # No particle is at a place where phi is NaN.
    values = np.where(np.isfinite(values), values, np.max(values, where=np.isfinite(values), initial=1.0))
    if not values.min() < 0.0 < values.max():
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    spacing = tuple((high - low) / (count - 1.0))
    points, triangles, _normals, _values = marching_cubes(values.reshape(3 * (count,)), 0.0, spacing=spacing)
    return surface.onto((points + low) @ frame.T, max(spacing)), triangles.astype(np.int64)


def cut(surface: SmoothSurface, points: Floats, triangles: Indices, level: Level, bodies: int = 0) -> Cut:
    """Return the part of triangles on a surface where a level, a distance to first order, is not above 0.

    For each of the `bodies` that cut it there may be more triangles, so that its hole is as round as that of one body.
    """
    if not len(triangles):
        return Cut(points, triangles, np.empty((0, 2), np.int64), np.empty(0, np.int64))
    values = level(points)
    points, triangles, values, origins = _finer(surface, points, triangles, values, level, _MOST + _EACH * bodies)
    kept = values <= 0.0
    inside = kept[triangles].sum(axis=1)
    # So that the corner that differs from the others comes first
    is_mixed = (inside == 1) | (inside == 2)
    mixed, of_mixed = triangles[is_mixed], origins[is_mixed]
    alone = (kept[mixed] == (inside[is_mixed] == 1)[:, None]).argmax(axis=1)
    mixed = np.take_along_axis(mixed, (alone[:, None] + np.arange(3)) % 3, axis=1)
    edges = np.sort(np.concatenate([mixed[:, [0, 1]], mixed[:, [0, 2]]]), axis=1)
    edges, places = np.unique(edges, axis=0, return_inverse=True)
    made = _crossings(surface, points, edges, values, level)
    first, second = len(points) + places.reshape(2, -1)
    a, b, c = mixed.T
    tip = kept[a]
    parts = [
        triangles[inside == 3],
        np.stack([a, first, second], axis=1)[tip],
        np.stack([first, b, c], axis=1)[~tip],
        np.stack([first, c, second], axis=1)[~tip],
    ]
    used, triangles = np.unique(np.concatenate(parts), return_inverse=True)
    places = np.zeros(len(points) + len(made), np.int64)
    places[used] = np.arange(len(used))
    rims = places[np.stack([first, second], axis=1)]
    origins = np.concatenate([origins[inside == 3], of_mixed[tip], of_mixed[~tip], of_mixed[~tip]])
    return Cut(np.concatenate([points, made])[used], triangles.reshape(-1, 3), rims, origins)


def _widths(points: Floats, triangles: Indices) -> Floats:
    """Return the longest side of each triangle."""
    corners = points[triangles]
    return np.asarray(np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2)).max(axis=1))


def _finer(
    surface: SmoothSurface, points: Floats, triangles: Indices, values: Floats, level: Level, most: int
) -> tuple[Floats, Indices, Floats, Indices]:
    """Divide triangles at the cut in four, as long as it bends within them.

    Returns:
        Points, triangles, the levels of points, and for each triangle the number of the original one.
    """
    origins = np.arange(len(triangles))
    for _ in range(_ROUNDS):
        wide, of = _widths(points, triangles), values[triangles]
        near = np.flatnonzero((of.min(axis=1) < wide) & (of.max(axis=1) > -wide))
        if not 0 < len(near) <= most:
            break
        sides = np.sort(triangles[near][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, places = np.unique(sides, axis=0, return_inverse=True)
        places = places.reshape(-1, 3)
        middles = surface.onto(points[edges].mean(axis=1), float(wide.max()))
        found = level(middles)
        bent = np.abs(found - values[edges].mean(axis=1))[places].max(axis=1)
        every = np.concatenate([of[near], found[places]], axis=1)
        crossed = (every.min(axis=1) <= 2.0 * bent) & (every.max(axis=1) >= -2.0 * bent)
        split = crossed & (bent > _STRAIGHT * wide[near])
        if not split.any():
            break
        chosen, middle = near[split], len(points) + places[split]
        (a, b, c), (p, q, r) = triangles[chosen].T, middle.T
        four = [np.stack(part, axis=1) for part in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))]
        triangles = np.concatenate([np.delete(triangles, chosen, axis=0), *four])
        origins = np.concatenate([np.delete(origins, chosen), *4 * [origins[chosen]]])
        points, values = np.concatenate([points, middles]), np.concatenate([values, found])
    return points, triangles, values, origins


def _crossings(surface: SmoothSurface, points: Floats, edges: Indices, values: Floats, level: Level) -> Floats:
    """Return the points on edges of triangles at which a level is 0."""
    if not len(edges):
        return np.empty((0, 3))
    within = values[edges[:, 0]] <= 0.0
    a, b = points[np.where(within, *edges.T)], points[np.where(within, *edges.T[::-1])]
    at_a, at_b = values[np.where(within, *edges.T)], values[np.where(within, *edges.T[::-1])]
    wide = float(np.sqrt(((a - b) ** 2).sum(axis=1)).max())
    for _ in range(_BISECTIONS):
        middle = surface.onto(0.5 * (a + b), wide)
        found = level(middle)
        there = found <= 0.0
        a, b = np.where(there[:, None], middle, a), np.where(there[:, None], b, middle)
        at_a, at_b = np.where(there, found, at_a), np.where(there, at_b, found)
    part = at_a / np.minimum(at_a - at_b, -1e-300)
    return surface.onto(a + np.clip(part, 0.0, 1.0)[:, None] * (b - a), wide)

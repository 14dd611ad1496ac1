"""Triangles of walls that are known without a grid: of tori, of cones, of outlines, and of meshes."""

import math
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..state import Floats
from ..surfaces import Cone, Torus
from ..surfaces.outlines.outlined import Outlined
from ..surfaces.rotation import matrix
from .curves import Indices, neighbours
from .cut import SmoothSurface

# Points around the tube of a torus and along it, parts of the height of an outline, and points of a line on it.
_AROUND, _ALONG, _HIGH, _FINE = 32, 96, 8, 201
# Parts of the height of a cone.
_RINGS = 32

Triangles = tuple[Floats, Indices]


def torus(surface: Torus) -> Triangles:
    """A torus, of which a thin tube would be lost between the points of a grid."""
    u, v = (np.linspace(0.0, 2.0 * math.pi, count, endpoint=False) for count in (_ALONG, _AROUND))
    along, around = np.meshgrid(u, v, indexing="ij")
    rho = surface.major_radius + surface.minor_radius * np.cos(around)
    own = np.stack([rho * np.cos(along), rho * np.sin(along), surface.minor_radius * np.sin(around)], axis=-1)
    points = own.reshape(-1, 3) @ matrix(surface.rotation).T + np.array(surface.center)
    place = np.arange(_ALONG * _AROUND).reshape(_ALONG, _AROUND)
    a, b = place, np.roll(place, -1, axis=0)
    return points, _halved(a, b, np.roll(b, -1, axis=1), np.roll(place, -1, axis=1))


def cone(surface: Cone, low: Floats, high: Floats, frame: Floats) -> Triangles:
    """The part of a cone in a box.

    The box is given in a frame with the axis as z. A grid of the level would lose the apex.
    """
    apex = np.array(surface.center) @ frame
    slope = math.tan(surface.half_angle)
    widest = math.hypot(*np.maximum(np.abs(high - apex), np.abs(low - apex))[:2])
    top, bottom = min(float(high[2] - apex[2]), widest / slope), max(float(low[2] - apex[2]), 0.0)
    if not bottom < top:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    around = np.linspace(0.0, 2.0 * math.pi, _ALONG, endpoint=False)
    along = np.linspace(bottom, top, _RINGS + 1)
    heights, angles = np.meshgrid(along, around, indexing="ij")
    own = np.stack([slope * heights * np.cos(angles), slope * heights * np.sin(angles), heights], axis=-1)
    a = np.arange(own.size // 3).reshape(heights.shape)
    b = np.roll(a, -1, axis=1)
    quadrilaterals = a[:-1], b[:-1], b[1:], a[1:]
    if bottom == 0.0:
        # All points of the first ring are the apex: one of them stands for it, in one triangle of each pair.
        a[0] = b[0] = a[0, 0]
    triangles = _halved(*quadrilaterals)
    kept = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2])
    return (own.reshape(-1, 3) + apex) @ frame.T, triangles[kept]


def without_gaps(normals: Floats, triangles: Indices) -> Floats:
    """Unit normals (V, 3) without gaps.

    A point without a normal, such as the apex of a cone, gets the mean normal of its triangles, normalised.
    """
    missing = np.asarray((normals == 0.0).all(axis=1))
    if not missing.any():
        return normals
    sums = np.zeros_like(normals)
    for k in range(3):
        np.add.at(sums, triangles[:, k], normals[triangles].sum(axis=1))
    lengths = np.maximum(np.sqrt((sums**2).sum(axis=1, keepdims=True)), np.finfo(np.float64).tiny)
    return np.where(missing[:, None], sums / lengths, normals)


def upright(surface: Outlined, low: float, high: float) -> Triangles:
    """The walls on an outline between two heights, which are places along its axis in the scene."""
    middle = float(surface.frame[:, 2] @ np.array(surface.center))
    heights = np.linspace(low, high, _HIGH + 1) - middle
    points, triangles, first = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for curve in surface.boundary.curves():
        n = len(curve)
        own = np.concatenate([np.repeat(curve, len(heights), axis=0), np.tile(heights, n)[:, None]], axis=1)
        points.append(own @ surface.frame.T + np.array(surface.center))
        place = first + np.arange(n * len(heights)).reshape(n, len(heights))
        triangles.append(_halved(place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]))
        first += len(own)
    return np.concatenate(points), np.concatenate(triangles)


def corners(surface: Outlined, low: float, high: float) -> list[Floats]:
    """The lines that stand on the corners of an outline between two heights."""
    outline, height = surface.boundary, np.linspace(low, high, _FINE)[:, None] * surface.frame[:, 2]
    at = surface.placed(outline.sides.end[outline.turns != 0].T).T
    along = surface.frame[:, 2]
    return [point - (point @ along) * along + height for point in at]


def sides(surface: Outlined) -> SmoothSurface:
    """The walls on an outline as a surface; to triangles on it nothing is to be moved."""

    def phi(points: Floats) -> Floats:
        return surface.boundary.nearest(surface.in_plane(points.T)[:2])[0]

    def gradient(points: Floats) -> Floats:
        return np.asarray((surface.frame[:, :2] @ surface.boundary.nearest(surface.in_plane(points.T)[:2])[1]).T)

    return SmoothSurface(phi, gradient)


def lids(surface: Outlined) -> list[SmoothSurface]:
    """The lids of an outline as planes."""
    return [_lid(surface, side) for side in (-1.0, 1.0)] if surface.height is not None else []


def _lid(surface: Any, side: float) -> SmoothSurface:
    normal = side * surface.frame[:, 2]
    offset = float(normal @ np.array(surface.center)) + 0.5 * surface.height
    return SmoothSurface(lambda points: points @ normal - offset, lambda points: np.broadcast_to(normal, points.shape))


def _halved(a: Any, b: Any, c: Any, d: Any) -> Indices:
    """The two triangles of each quadrilateral."""
    both = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    return np.asarray(both.reshape(-1, 3))


def shaded(points: Floats, triangles: Indices) -> tuple[Floats, Indices, Floats]:
    """Triangles with normals at their corners: those at which edges meet are a corner for each side of an edge."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    # Corners of two triangles at a point are one where these meet smoothly at a side.
    mine, other = neighbours(points, triangles)
    every = np.arange(3 * len(triangles)).reshape(-1, 3)
    pairs = [
        (every[mine, i], every[other, j])
        for i in range(3) for j in range(3)
    ]  # fmt: skip
    same = [triangles[mine, k // 3] == triangles[other, k % 3] for k in range(9)]
    first, second = (np.concatenate([pair[k][here] for pair, here in zip(pairs, same, strict=True)]) for k in (0, 1))
    graph = coo_matrix((np.ones(len(first), np.int8), (first, second)), shape=2 * (every.size,))
    number, corner = connected_components(graph, directed=False)
    made, normals = np.empty((number, 3)), np.zeros((number, 3))
    made[corner] = points[triangles.ravel()]
    np.add.at(normals, corner, np.repeat(normal, 3, axis=0))
    normals /= np.maximum(np.sqrt((normals**2).sum(axis=1, keepdims=True)), 1e-300)
    return made, corner.reshape(-1, 3).astype(np.int64), normals

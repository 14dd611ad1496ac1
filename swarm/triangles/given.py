"""Triangles of walls that are known without a grid: of tori, of cones, of outlines, and of meshes."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..state import Floats
from ..surfaces.rotation import normalized
from .curves import Indices, neighbours

Triangles = tuple[Floats, Indices]


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
    return np.where(missing[:, None], normalized(sums, 1), normals)


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
    return made, corner.reshape(-1, 3).astype(np.int64), normalized(normals, 1)

"""Flat faces of a mesh: the planes of its triangles, and the triangles in one of them."""

import numpy as np

from ...state import Floats, Indices
from .mending import edges_of, sizes

# Digits to which triangles are coplanar, for a normal and for an offset in sizes of the mesh.
DIGITS = 9


def planes_of(corners: Floats, triangles: Indices) -> Floats:
    """Return the planes of triangles, each once: rows of unit normals to the outside, and offsets along these [m]."""
    a, b, c = np.moveaxis(corners[triangles], 1, 0)
    crossed = np.cross(b - a, c - a)
    normals = crossed / np.linalg.norm(crossed, axis=1)[:, None]
    rows = np.column_stack([normals, (normals * a).sum(axis=1)])
    _keys, first = np.unique(keys_of(rows, float(np.abs(corners).max())), return_index=True)
    return rows[first]


def keys_of(planes: Floats, size: float) -> Floats:
    """Return a number for each plane (n, 4), equal for planes that agree in `DIGITS`, negative for one turned over.

    Args:
        planes: rows of unit normals and offsets [m].
        size: the size of the body that the planes bound [m].
    """
    x, y, z, offset = np.round(planes / [1.0, 1.0, 1.0, size], DIGITS).T
    # Sorting one number takes a tenth of the time of four; two planes agree in it by chance alone.
    a, b, c, d = np.random.default_rng(0).random(4)
    return np.asarray(a * x + b * y + c * z + d * offset + 0.0)


def in_plane(corners: Floats, plane: Floats) -> Floats:
    """Whether vertices (V, 3) are in a plane, a row as those of `planes_of`."""
    return np.asarray(np.abs(corners @ plane[:3] - plane[3]) <= 10.0**-DIGITS * np.abs(corners).max())


def all_in_a_plane(corners: Floats, triangles: Indices) -> bool:
    """Whether all triangles (T, 3) are in one plane."""
    areas, _longest = sizes(corners, triangles)
    if not areas.max(initial=0.0) > 0.0:
        return False
    (plane,) = planes_of(corners, triangles[[np.argmax(areas)]])
    return bool(in_plane(corners, plane)[triangles].all())


def rim_of(corners: Floats, triangles: Indices, plane: Floats, count: int) -> Floats:
    """Return points (3, count) on the edges of the part of a mesh in a plane."""
    face = _within(corners, triangles, plane)
    edges, counts = edges_of(face)
    return _drawn(corners[edges[counts == 1]], count)


def places_of(corners: Floats, triangles: Indices, plane: Floats, count: int) -> Floats:
    """Return points (3, count) on the part of a mesh in a plane."""
    return _drawn(corners[_within(corners, triangles, plane)], count)


def _within(corners: Floats, triangles: Indices, plane: Floats) -> Indices:
    return triangles[in_plane(corners, plane)[triangles].all(axis=1)]


def _drawn(simplices: Floats, count: int) -> Floats:
    """Return points (3, count) of edges or triangles (n, corners, 3): equally many of each."""
    random = np.random.default_rng(1)
    shares = random.dirichlet(np.ones(simplices.shape[1]), count)
    return np.asarray((shares[:, :, None] * simplices[np.arange(count) % len(simplices)]).sum(axis=1).T)

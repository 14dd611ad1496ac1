"""The faces of a mesh that soft balls touch at one place each: coplanar triangles, and triangles of a convex body.

Where two triangles make a corner around the balls they are of two faces, and a ball in it touches both. At the nearest
place of a convex body the normal has no jump. Triangles in one plane, to the round-off of a file, are
put into that plane: from one to the next neither the distance nor the normal changes.
"""

import math

import numpy as np

from ...state import Floats, Indices
from .mending import parts_of

# The sine of an angle between coplanar triangles, and the distance of corners from their plane, as a part of the size.
_FLAT, _OFF = 1e-5, 1e-6
# The most planes of a face: more take long to compare. A part is convex if the area of its hull is larger by at most
# this part of it.
_MOST, _WIDER = 2000, 1e-5


class _Groups:
    """Sets of numbers that are united step by step: a forest."""

    def __init__(self, count: int) -> None:
        self.parent = list(range(count))

    def root(self, i: int) -> int:
        while self.parent[i] != i:
            self.parent[i] = self.parent[self.parent[i]]
            i = self.parent[i]
        return i


def faces_of(vertices: Floats, triangles: Indices, side: float) -> tuple[Floats, Indices]:
    """Return the corners (T, 3, 3) of triangles, moved into common planes, and the number of the face of each (T,).

    Args:
        vertices: (V, 3) [m].
        triangles: (T, 3), which turn to the left seen from outside.
        side: 1 if balls are outside, -1 inside, 0 on both sides of sheets, which have no corner of a convex body.
    """
    corners, of_sheets = vertices[triangles], side == 0.0
    crossed = (side or 1.0) * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = crossed / np.linalg.norm(crossed, axis=1)[:, None]
    pairs, bends = _joints(corners, triangles, normals)
    flat = np.abs(bends) <= _FLAT
    groups = _Groups(len(triangles))
    for one, other in pairs[flat].tolist():
        groups.parent[groups.root(one)] = groups.root(other)
    planes = np.array([groups.root(i) for i in range(len(triangles))])
    if of_sheets:
        # Triangles in one plane may be turned either way.
        crossed = np.where((normals * normals[planes]).sum(axis=1)[:, None] < 0.0, -crossed, crossed)
    corners = _in_planes(corners, crossed, planes)
    groups = _Groups(len(triangles))
    _join_flat(groups, planes, corners, normals, pairs[flat])
    around = bends < (-math.inf if of_sheets else -_FLAT)
    edges = pairs[around][np.argsort(-bends[around], kind="stable")]
    _join_edges(groups, planes, corners, normals, edges)
    faces = np.array([groups.root(i) for i in range(len(triangles))])
    return corners, np.unique(faces, return_inverse=True)[1]


def _join_flat(groups: _Groups, planes: Indices, corners: Floats, normals: Floats, edges: Indices) -> None:
    """Join coplanar triangles if they are convex: all of them, or one after the other along these edges."""
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)

    def is_convex(some: list[int]) -> bool:
        return _hull(corners[some].reshape(-1, 3), normals[some[0]]) <= (1.0 + _WIDER) * float(areas[some].sum())

    parts = {i: [i] for i in range(len(planes))}
    whole = [part for part in parts_of(planes) if len(part) > 1]
    hollow = set()
    for part in whole:
        if is_convex(part.tolist()):
            for i in part[1:].tolist():
                groups.parent[i] = int(part[0])
        else:
            hollow.add(int(planes[part[0]]))
    for one, other in edges.tolist():
        a, b = groups.root(one), groups.root(other)
        if a != b and int(planes[one]) in hollow and is_convex(parts[a] + parts[b]):
            groups.parent[b], parts[a] = a, parts[a] + parts[b]


def _hull(points: Floats, normal: Floats) -> float:
    """Return the area of the convex hull of points in a plane."""
    from scipy.spatial import ConvexHull

    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    return float(ConvexHull(np.stack([points @ first, points @ second], axis=1)).volume)


def _joints(corners: Floats, triangles: Indices, normals: Floats) -> tuple[Indices, Floats]:
    """Return the pairs of triangles that share an edge, and the sine by which the second rises towards the balls."""
    count = len(triangles)
    ends = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends = ends[order]
    change = np.flatnonzero(np.concatenate([[True], (ends[1:] != ends[:-1]).any(axis=1), [True]]))
    # An edge of four triangles joins none.
    first = change[:-1][np.diff(change) == 2]
    one, other = order[first], order[first + 1]
    pairs = np.stack([one % count, other % count], axis=1)
    tip = corners[pairs[:, 1], (other // count + 2) % 3]
    start = corners[pairs[:, 0], one // count]
    way = corners[pairs[:, 0], (one // count + 1) % 3] - start
    up = tip - start
    height = np.linalg.norm(np.cross(way, up), axis=1) / np.linalg.norm(way, axis=1)
    return pairs, (normals[pairs[:, 0]] * up).sum(axis=1) / height


def _join_edges(groups: _Groups, planes: Indices, corners: Floats, normals: Floats, edges: Indices) -> None:
    """Join the faces at edges towards the balls, in this order, if all of both is behind all planes of both.

    Two parts of one plane with a hole or a notch stay apart.
    """
    near = _OFF * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    roots = np.array([groups.root(i) for i in range(len(planes))])
    # For each body planes as rows (normal, offset), for a flat one that of the first triangle; corners; and numbers.
    bodies: dict[int, tuple[Floats, Floats, set[int]]] = {}
    for part in parts_of(roots):
        n = normals[part[:1]]
        row = np.concatenate([n, (n @ corners[part[0]].T).mean(axis=1, keepdims=True)], axis=1)
        points = np.unique(corners[part].reshape(-1, 3), axis=0)
        bodies[int(roots[part[0]])] = row, points, {int(planes[part[0]])}
    for one, other in edges.tolist():
        a, b = groups.root(one), groups.root(other)
        (own, mine, known), (others, theirs, more) = bodies[a], bodies[b]
        if a == b or len(own) + len(others) > _MOST or known & more:
            continue
        if _is_behind(theirs, own, near) and _is_behind(mine, others, near):
            groups.parent[b] = a
            bodies[a] = np.concatenate([own, others]), np.concatenate([mine, theirs]), known | more


def _is_behind(points: Floats, planes: Floats, near: float) -> bool:
    return bool((planes[:, :3] @ points.T - planes[:, 3:] <= near).all())


def _in_planes(corners: Floats, crossed: Floats, planes: Indices) -> Floats:
    """Return the corners of triangles, each in the common plane of the triangles with its number if that is near."""
    which, each = np.unique(planes, return_inverse=True)
    sums = np.zeros((len(which), 3))
    np.add.at(sums, each, crossed)
    normal = (sums / np.linalg.norm(sums, axis=1)[:, None])[each]
    heights = np.einsum("tk,tck->tc", normal, corners)
    middle = np.bincount(each, heights.mean(axis=1))[each] / np.bincount(each)[each]
    off = heights - middle[:, None]
    worst = np.zeros(len(which))
    np.maximum.at(worst, each, np.abs(off).max(axis=1))
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    off[(worst > _OFF * size)[each] | (np.bincount(each) == 1)[each]] = 0.0
    return np.asarray(corners - off[:, :, None] * normal[:, None, :])

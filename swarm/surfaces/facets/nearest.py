"""The signed distance from a mesh: the triangle nearest to a point, and the side of it that the point is on."""

import math

import numpy as np

from ...kernel.arrays import index, scratch
from ...kernel.grid import cell_of
from ...kernel.jit import kernel, outlined
from ...kernel.record import Record
from ...kernel.vector import Vec, column, cross, dot, norm, put, square, vector_at
from ..fields.members import SignedDistance
from .free_room import FREE, FULL, KIND

# Squared distances from two triangles that share a corner or an edge differ by up to the first part, and the squared
# distance of their feet is up to the second: round-off.
_TIE, _SAME = 1e-9, 1e-18
# Triangles of a leaf of the tree, and the most boxes that wait at once.
_LEAF, _DEEPEST = 8, 96


class NearestTriangle(Record):
    """The nearest triangle so far: the squared distance, the foot, its number, and its pseudonormal.

    The pseudonormal is the sum of the normals of all triangles that meet at the foot, each times its angle there; its
    sign tells the side of a point (Baerentzen and Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243).
    """

    square: float
    foot: Vec
    which: float
    normal: Vec

    def height(self, r):
        """Return a number that is above 0 outside."""
        return dot(self.normal, r - self.foot)


@outlined
def foot_on(facets, mesh, r):
    """Return the `SignedDistance` of a point: the signed distance along the normals of the facets, and its gradient."""
    near = _nearest(facets, mesh, r)
    normal, height = vector_at(facets.table, index(int(near.which)), 0), near.height(r)
    away = norm(r - near.foot)
    sign = 1.0 if height > 0.0 else -1.0
    # On a facet the vector from the foot is round-off, of any direction.
    is_off = away > facets.like.room.value and height != 0.0
    return SignedDistance(sign * away, (r - near.foot) * (sign / away) if is_off else normal)


@kernel
def nearest(facets, mesh, points, found):
    """Write the gradient and the signed distance at points (3, N) into the rows of `found`.

    `mesh` are the vertices (V, 3), the triangles (T, 3) and the `boxes_of` these.
    """
    for i in range(points.shape[1]):
        foot = foot_on(facets, mesh, column(points, 0, i))
        put(found, 0, i, foot.normal)
        found[3, i] = foot.gap


@kernel
def within(facets, mesh, points, found):
    """Write whether each of the points (3, N) is admissible, and not on the mesh, into `found`."""
    cells = facets.grid
    for i in range(points.shape[1]):
        r = column(points, 0, i)
        cell = cell_of(cells, r)
        kind = cells.known.room[index(cell.number), KIND]
        found[i] = kind == FREE if kind != FULL else _nearest(facets, mesh, r).height(r) < 0.0


@outlined
def _nearest(facets, mesh, r):
    """Return the nearest triangle: through the tree, the nearer of two boxes first."""
    boxes, count = mesh[2], mesh[1].shape[0]
    leaves, waiting, last = boxes.shape[0] // 2, scratch(_DEEPEST, np.int64), 1
    near = NearestTriangle(math.inf, r, 0.0, r)
    waiting[0] = 1
    while last > 0:
        last -= 1
        box = waiting[last]
        if not _away(boxes, box, r) <= near.square * (1.0 + _TIE):
            continue
        if box >= leaves:
            first = (box - leaves) * _LEAF
            for m in range(first, min(first + _LEAF, count)):
                near = _nearer(facets, mesh, r, index(m), near)
            continue
        one, other = 2 * box, 2 * box + 1
        one_first = _away(boxes, one, r) <= _away(boxes, other, r)
        waiting[last] = other if one_first else one
        waiting[last + 1] = one if one_first else other
        last += 2
    return near


def _away(boxes, k, r):
    """Return the squared distance of a point from a box."""
    k = index(k)
    x = max(float(boxes[k, 0]) - r.x, r.x - float(boxes[k, 3]))
    y = max(float(boxes[k, 1]) - r.y, r.y - float(boxes[k, 4]))
    z = max(float(boxes[k, 2]) - r.z, r.z - float(boxes[k, 5]))
    return square(Vec(max(x, 0.0), max(y, 0.0), max(z, 0.0)))


@outlined
def _nearer(facets, mesh, r, m, near):
    """Return the nearer of the nearest triangle so far and this one; both combined, if they meet at the foot."""
    vertices, triangles = mesh[0], mesh[1]
    a, b, c = (vector_at(vertices, index(triangles[m, k]), 0) for k in range(3))
    foot = _foot(r, a, b, c)
    away, normal = square(r - foot), vector_at(facets.table, index(m), 0) * _angle_at(foot, a, b, c)
    if near.square < math.inf and square(foot - near.foot) <= _SAME * near.square:
        return NearestTriangle(near.square, near.foot, near.which, near.normal + normal)
    return NearestTriangle(away, foot, float(m), normal) if away < near.square else near


def _angle_at(foot, a, b, c):
    """Return the angle of a triangle at a point of it: the angle of a corner, or half a turn elsewhere."""
    at_a, at_b = square(foot - a) == 0.0, square(foot - b) == 0.0
    if not (at_a or at_b or square(foot - c) == 0.0):
        return math.pi
    one, other = (b - a, c - a) if at_a else ((c - b, a - b) if at_b else (a - c, b - c))
    return np.arctan2(norm(cross(one, other)), dot(one, other))


def _foot(r, a, b, c):
    """Return the point of a triangle nearest to r (Ericson, Real-Time Collision Detection, 5.1.5)."""
    ab, ac, ap = b - a, c - a, r - a
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    bp = r - b
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return a + (d1 / (d1 - d3)) * ab
    cp = r - c
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return a + (d2 / (d2 - d6)) * ac
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b)
    share = 1.0 / (va + vb + vc)
    return a + (vb * share) * ab + (vc * share) * ac


def boxes_of(corners):
    """Return a tree of boxes (lowest and highest corner): box k holds 2 k and 2 k + 1, the last half `_LEAF` triangles.

    `corners` (T, 3, 3) are the corners of triangles in an order in which consecutive ones are near to each other.
    """
    count = -(-len(corners) // _LEAF)
    leaves = 1 << max(count - 1, 0).bit_length()
    boxes = np.full((2 * leaves, 6), np.inf)
    boxes[:, 3:] = -np.inf
    starts = _LEAF * np.arange(count)
    boxes[leaves : leaves + count, :3] = np.minimum.reduceat(corners.min(axis=1), starts)
    boxes[leaves : leaves + count, 3:] = np.maximum.reduceat(corners.max(axis=1), starts)
    while leaves > 1:
        pairs = boxes[leaves : 2 * leaves].reshape(-1, 2, 6)
        leaves //= 2
        boxes[leaves : 2 * leaves, :3] = pairs[:, :, :3].min(axis=1)
        boxes[leaves : 2 * leaves, 3:] = pairs[:, :, 3:].max(axis=1)
    # Rounded outwards, so that no box is smaller than its triangles
    rounded, less = boxes.astype(np.float32), np.array(3 * [-np.inf] + 3 * [np.inf], np.float32)
    inwards = np.where(less < 0.0, rounded > boxes, rounded < boxes)
    return np.where(inwards, np.nextafter(rounded, less), rounded)

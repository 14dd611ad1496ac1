"""P, the projection of a vector on what no touched wall forbids: a half-space, the edge of two walls, a corner."""

from typing import NamedTuple

from ..kernel.jit import inlined, outlined, select
from ..kernel.vector import ZERO, Vec, column, cross, dot, norm

# Directions this close to forbidden, relative to |w|, are allowed: round-off of the normals.
ALLOWED = 64.0 * 2.220446049250313e-16


class Edge(NamedTuple):
    """Of two walls i and j: e along their edge, m = e x n_i, and n_j = cosine n_i + sine m."""

    e: Vec
    m: Vec
    cosine: float
    sine: float  # 0 where they have no edge


@outlined
def project(touched, normal, held, w):
    """The nearest vector u to w with n.u <= 0 for the touched walls; w - u = sum of held n, held >= 0.

    `normal` (3, walls) has their unit normals. At most three walls carry: one, then an edge of two, then a corner.
    """
    count = touched.size
    held[:] = 0.0
    near = ALLOWED * norm(w)
    if _allowed(touched, normal, w, near):
        return w
    for i in range(count):
        b = along(normal, i, w)
        if touched[i] and b > 0.0:
            u = w - b * column(normal, 0, i)
            if _allowed(touched, normal, u, near):
                held[i] = b
                return u
    for i in range(count):
        for j in range(i):
            if touched[i] and touched[j]:
                u, p, q = _on_edge(normal, i, j, w)
                if p >= 0.0 and q >= 0.0 and _allowed(touched, normal, u, near):
                    held[i], held[j] = p, q
                    return u
    _carried(touched, normal, held, w)
    return ZERO


@inlined
def along(normal, i, a):
    """The component of a vector along the normal of wall i."""
    return dot(column(normal, 0, i), a)


@outlined
def _allowed(touched, normal, u, near):
    highest = 0.0
    for i in range(touched.size):
        if touched[i]:
            highest = max(highest, along(normal, i, u))
    return highest <= near


@outlined
def _on_edge(normal, i, j, w):
    """w along the edge of two walls, and what each takes; -1 where they have no edge."""
    edge = _edge(normal, i, j)
    if edge.sine == 0.0:
        return ZERO, -1.0, -1.0
    q = dot(w, edge.m) / edge.sine
    return dot(w, edge.e) * edge.e, along(normal, i, w) - edge.cosine * q, q


@outlined
def _edge(normal, i, j):
    """The edge of two walls.

    e is orthogonal to n_i and to n_j -+ n_i to round-off, so to both normals also where they are nearly opposite, as
    in a cusp: n_i x n_j alone would be off by the round-off over the sine.
    """
    n = column(normal, 0, i)
    cosine = along(normal, j, n)
    d = column(normal, 0, j) - select(cosine < 0.0, -1.0, 1.0) * n
    e = cross(n, d)
    length = norm(e)
    if length == 0.0:
        return Edge(ZERO, ZERO, cosine, 0.0)
    e = e / length
    m = cross(e, n)
    return Edge(e, m, cosine, dot(m, d))


@outlined
def _carried(touched, normal, held, w):
    """What each wall of a corner takes of w: the first three that carry it."""
    count = touched.size
    for i in range(count):
        for j in range(i):
            for k in range(j):
                if touched[i] and touched[j] and touched[k]:
                    e = _edge(normal, i, j).e
                    steepness = along(normal, k, e)
                    if steepness == 0.0:
                        continue
                    # The edge of two takes nothing along itself: that part is the third wall's.
                    r = dot(w, e) / steepness
                    _u, p, q = _on_edge(normal, i, j, w - r * column(normal, 0, k))
                    if p >= 0.0 and q >= 0.0 and r >= 0.0:
                        held[i], held[j], held[k] = p, q, r
                        return

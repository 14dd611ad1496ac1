"""P, the projection of a vector on the directions that touched walls allow: a half-space, an edge, a corner."""

import math
from typing import Any

from ..kernel.jit import outlined, select
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, column, cross, dot, largest, norm, put, total

# Directions that are forbidden by less than this, relative to |w|, are allowed: round-off of the normals.
ALLOWED = 64.0 * EPSILON
# Sweeps until r1 and the discrete gradients agree: each gains the digits of h |v|/R.
_SWEEPS = 60


class Touch(Record):
    """The walls near a sliding particle, one entry each."""

    number: Any  # the number of the wall
    touched: Any  # whether it is touched
    normal: Any  # (3, walls): unit normal in the step
    active: Any  # the part of the velocity that each wall takes
    depth: Any  # signed distance outside
    frame: Any  # None, or a velocity with which the walls move along their normals


class Edge(Record):
    """The edge of two walls i and j: e along their edge, m = e x n_i, and n_j = cosine n_i + sine m."""

    e: Vec
    m: Vec
    cosine: float
    sine: float  # 0 without an edge


@outlined
def project(touched, normal, active, w):
    """Return the nearest vector u to w with n.u <= 0 for the touched walls; w - u = sum of held n, held >= 0.

    `normal` (3, walls) are their unit normals. At most three walls carry: one, then an edge of two, then a corner.
    """
    count = touched.size
    active[:] = 0.0
    near = ALLOWED * norm(w)
    if _allowed(touched, normal, w, near):
        return w
    for i in range(count):
        b = along(normal, i, w)
        if touched[i] and b > 0.0:
            u = w - b * column(normal, 0, i)
            if _allowed(touched, normal, u, near):
                active[i] = b
                return u
    for i in range(count):
        for j in range(i):
            if touched[i] and touched[j]:
                u, p, q = _on_edge(normal, i, j, w)
                if p >= 0.0 and q >= 0.0 and _allowed(touched, normal, u, near):
                    active[i], active[j] = p, q
                    return u
    _carried(touched, normal, active, w)
    return ZERO


def along(normal, i, a):
    """Return the component of a vector along the normal of wall i."""
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
    """Return w along the edge of two walls, and the part of each wall; -1 without an edge."""
    edge = _edge(normal, i, j)
    if edge.sine == 0.0:
        return ZERO, -1.0, -1.0
    q = dot(w, edge.m) / edge.sine
    return dot(w, edge.e) * edge.e, along(normal, i, w) - edge.cosine * q, q


@outlined
def _edge(normal, i, j):
    """Return the edge of two walls.

    e is orthogonal to n_i and to n_j -+ n_i to round-off, so to both normals even if they are nearly opposite, as
    in a cusp: n_i x n_j alone would be wrong by the round-off over the sine.
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
def _carried(touched, normal, active, w):
    """Set the part of w that each wall of a corner takes: the first three walls that carry it."""
    count = touched.size
    for i in range(count):
        for j in range(i):
            for k in range(j):
                if touched[i] and touched[j] and touched[k]:
                    e = _edge(normal, i, j).e
                    steepness = along(normal, k, e)
                    if steepness == 0.0:
                        continue
                    # The edge of two walls takes nothing along itself: that part is the third wall's.
                    r = dot(w, e) / steepness
                    _u, p, q = _on_edge(normal, i, j, w - r * column(normal, 0, k))
                    if p >= 0.0 and q >= 0.0 and r >= 0.0:
                        active[i], active[j], active[k] = p, q, r
                        return


# --- The projection for a step ---------------------------------------------------------------------------


@outlined
def velocity_along(walls, touch, r, w, h):
    """Return P: w without the directions that the touched walls forbid between r0 and r1 = r0 + h P."""
    u, r1 = ZERO, r
    for _sweep in range(_SWEEPS):
        put_normals(walls, touch, touch.touched, r, r1)
        u = project(touch.touched, touch.normal, touch.active, w)
        before, r1 = r1, r + h * u
        if largest(r1 - before) <= 2.0 * EPSILON * largest(r):
            break
    return u


@outlined
def put_normals(walls, touch, which, r0, r1):
    """Write the unit vector along the discrete gradient of each wall in `which`, pointing outside, to `touch`."""
    for i in range(which.size):
        if which[i]:
            put(touch.normal, 0, i, _normal(walls, touch.number[i], r0, r1))


@outlined
def _normal(walls, wall, r0, r1):
    """Return the unit vector along the discrete gradient of a wall, out of the admissible side."""
    n = walls.unit_normal(wall, r0)
    d = walls.discrete_gradient(wall, r0, r1)
    length = norm(d)
    if dot(d, n) < 0.0:
        length = -length
    # At a singular point, such as an apex, both may be undefined: the wall then forbids nothing.
    if length != 0.0 and math.isfinite(length):
        n = d / length
    return n if math.isfinite(total(n)) else ZERO

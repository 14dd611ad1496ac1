"""P, the projection of a vector on what no touched wall forbids: a half-space, the edge of two walls, a corner."""

import math

from ..kernel.jit import inlined, outlined, select

# Directions this close to forbidden, relative to |w|, are allowed: round-off of the normals.
ALLOWED = 64.0 * 2.220446049250313e-16


@outlined
def project(touched, normal, held, wx, wy, wz):
    """The nearest vector u to w with n.u <= 0 for the touched walls; w - u = sum of held n, held >= 0.

    At most three walls carry: one, then an edge of two, then a corner.
    """
    count = touched.size
    held[:] = 0.0
    near = ALLOWED * math.sqrt(wx * wx + wy * wy + wz * wz)
    if _allowed(touched, normal, wx, wy, wz, near):
        return wx, wy, wz
    for i in range(count):
        b = along(normal, i, wx, wy, wz)
        if touched[i] and b > 0.0:
            ux, uy, uz = wx - b * normal[i, 0], wy - b * normal[i, 1], wz - b * normal[i, 2]
            if _allowed(touched, normal, ux, uy, uz, near):
                held[i] = b
                return ux, uy, uz
    for i in range(count):
        for j in range(i):
            if touched[i] and touched[j]:
                ux, uy, uz, p, q = _on_edge(normal, i, j, wx, wy, wz)
                if p >= 0.0 and q >= 0.0 and _allowed(touched, normal, ux, uy, uz, near):
                    held[i], held[j] = p, q
                    return ux, uy, uz
    _carried(touched, normal, held, wx, wy, wz)
    return 0.0, 0.0, 0.0


@inlined
def along(normal, i, x, y, z):
    """The part of a vector along the normal of wall i."""
    return normal[i, 0] * x + normal[i, 1] * y + normal[i, 2] * z


@outlined
def _allowed(touched, normal, x, y, z, near):
    highest = 0.0
    for i in range(touched.size):
        if touched[i]:
            highest = max(highest, along(normal, i, x, y, z))
    return highest <= near


@outlined
def _on_edge(normal, i, j, wx, wy, wz):
    """w along the edge of two walls, and what each takes; -1 where they have no edge."""
    ex, ey, ez, mx, my, mz, c, sine = _edge(normal, i, j)
    if sine == 0.0:
        return 0.0, 0.0, 0.0, -1.0, -1.0
    f = wx * ex + wy * ey + wz * ez
    q = (wx * mx + wy * my + wz * mz) / sine
    return f * ex, f * ey, f * ez, along(normal, i, wx, wy, wz) - c * q, q


@outlined
def _edge(normal, i, j):
    """Of two walls: e along their edge, m = e x n_i, and n_j = c n_i + sine m; the sine is 0 where they have no edge.

    e is orthogonal to n_i and to n_j -+ n_i to round-off, so to both normals also where they are all but opposite, as
    in a cusp: n_i x n_j alone would lean out of it by the round-off over the sine.
    """
    ax, ay, az = normal[i]
    c = along(normal, j, ax, ay, az)
    s = select(c < 0.0, -1.0, 1.0)
    dx, dy, dz = normal[j, 0] - s * ax, normal[j, 1] - s * ay, normal[j, 2] - s * az
    ex, ey, ez = ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    if length == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, c, 0.0
    ex, ey, ez = ex / length, ey / length, ez / length
    mx, my, mz = ey * az - ez * ay, ez * ax - ex * az, ex * ay - ey * ax
    return ex, ey, ez, mx, my, mz, c, mx * dx + my * dy + mz * dz


@outlined
def _carried(touched, normal, held, wx, wy, wz):
    """What each wall of a corner takes of w: the first three that carry it."""
    count = touched.size
    for i in range(count):
        for j in range(i):
            for k in range(j):
                if touched[i] and touched[j] and touched[k]:
                    ex, ey, ez, _mx, _my, _mz, _c, _sine = _edge(normal, i, j)
                    steepness = along(normal, k, ex, ey, ez)
                    if steepness == 0.0:
                        continue
                    # The edge of two takes nothing along itself: that part is the third wall's.
                    r = (wx * ex + wy * ey + wz * ez) / steepness
                    _ux, _uy, _uz, p, q = _on_edge(
                        normal, i, j, wx - r * normal[k, 0], wy - r * normal[k, 1], wz - r * normal[k, 2]
                    )
                    if p >= 0.0 and q >= 0.0 and r >= 0.0:
                        held[i], held[j], held[k] = p, q, r
                        return

"""The contacts of a body: where its points are, which walls they can meet, and which are at one."""

import numpy as np

from ...kernel.jit import outlined
from ...kernel.vector import Vec, cross, dot, norm

# A contact this many times round-off away from its wall is at it.
NEAR = 64.0
# Most contacts at one instant; more follow in the next blow at the same instant.
MOST_CONTACTS = 16
# How far outside a contact that lasts may end, in units of round-off.
ROOM = 64.0


def point_of(touching, r, k, i):
    """The place, or velocity, of contact point k of a lane."""
    q = touching.plain[k]
    if q >= 0:
        return Vec(r[q, 0, i], r[q, 1, i], r[q, 2, i])
    x, y, z = 0.0, 0.0, 0.0
    for p in range(r.shape[0]):
        b = touching.coefficients[k, p]
        x += b * r[p, 0, i]
        y += b * r[p, 1, i]
        z += b * r[p, 2, i]
    return Vec(x, y, z)


def span(touching, k):
    """The walls that a contact point can meet: from the first to the one before the last."""
    own = k - touching.points
    first = 0 if own < 0 else touching.walls + own
    last = touching.walls if own < 0 else first + (1 if own >= touching.guides else 0)
    return first, last


def count_at(chain, span, c):
    """How many walls of a span a point may be at: of a field those of its cell."""
    first, last = span
    fields = chain.fields()
    if len(fields) == 0 or first > 0:
        return last - first
    found = 0
    for _number, field in reversed(fields):
        found = int(field.members.count_in_cell(c)) + found
    return found + last - int(chain.count_in_fields())


def wall_at(chain, span, j, c):
    """One of these walls."""
    if len(chain.fields()) == 0 or span[0] > 0:
        return span[0] + j
    return _wall_of_cells(chain, j, c)


@outlined
def _wall_of_cells(chain, j, c):
    """The same of a scene with fields."""
    for number, field in chain.fields():
        here = int(field.members.count_in_cell(c))
        if j < here:
            return int(number) + int(field.members.one_in_cell(j, c))
        j = j - here
    return int(chain.count_in_fields()) + j


def width(touching, name, found):
    """How many directions of each contact matter: the normal, or the tangents too, where there is friction."""
    rough = False
    for a in range(found):
        rough = rough or touching.friction[name[a, 1]] > 0.0
    return 3 if rough else 1


def near(touching, chain, rule, motion, i, contacts, approaching):
    """The contacts at their walls, or those that approach: their names (point, wall), a normal and two tangents."""
    r, v = motion
    name, frame = contacts
    found = 0
    for k in range(touching.plain.size):
        c, u = point_of(touching, r, k, i), point_of(touching, v, k, i)
        met = span(touching, k)
        for j in range(count_at(chain, met, c)):
            w = wall_at(chain, met, j, c)
            if found < MOST_CONTACTS and chain.distance(float(w), c) >= -NEAR * rule.room:
                n = chain.unit_normal(float(w), c)
                # What is left of an approach by round-off is none.
                if not approaching or dot(n, u) > 4.0 * np.finfo(np.float64).eps * norm(u):
                    name[found, 0], name[found, 1] = k, w
                    _frame(frame, found, n)
                    found += 1
    return found


def direction(frame, a):
    """Direction a of the contacts: normal, tangent, tangent, normal of the next, ..."""
    return Vec(frame[a // 3, a % 3, 0], frame[a // 3, a % 3, 1], frame[a // 3, a % 3, 2])


def _frame(frame, a, n):
    """The normal and two unit vectors across it."""
    flat = Vec(1.0, 0.0, 0.0) if abs(n.x) < 0.6 else Vec(0.0, 1.0, 0.0)
    t = cross(n, flat)
    t = t / norm(t)
    s = cross(n, t)
    frame[a, 0, 0], frame[a, 0, 1], frame[a, 0, 2] = n.x, n.y, n.z
    frame[a, 1, 0], frame[a, 1, 1], frame[a, 1, 2] = t.x, t.y, t.z
    frame[a, 2, 0], frame[a, 2, 1], frame[a, 2, 2] = s.x, s.y, s.z


def index_of(held, i, found, k, wall):
    """The number of a contact of a lane, -1 for none."""
    index = -1
    for a in range(found):
        if held.name[i, a, 0] == k and held.name[i, a, 1] == wall:
            index = a
    return index


def solve_dense(a, f):
    """f = a^-1 f of a system whose symmetric part, but for factors of rows, is positive."""
    rows = f.shape[0]
    for k in range(rows):
        for row in range(k + 1, rows):
            part = a[row, k] / a[k, k]
            for column in range(k + 1, rows):
                a[row, column] -= part * a[k, column]
            f[row] -= part * f[k]
    for row in range(rows - 1, -1, -1):
        for column in range(row + 1, rows):
            f[row] -= a[row, column] * f[column]
        f[row] /= a[row, row]

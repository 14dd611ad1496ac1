"""Impacts of a body: where its step is cut, and the blow that turns it round."""

import math

import numpy as np

from ...kernel.jit import inlined, outlined, scratch
from ...kernel.vector import Vec, cross, dot, norm
from ...surfaces import fold as walls

# What becomes of a lane after a trial.
AGAIN, COMMIT, STRIKE, STRIKE_NOW, FAILED = 0, 1, 2, 3, 4
# A bracket of the time of impact this narrow, as a part of a whole step, is a point; and the shortest step there is.
_NARROW, _SHORTEST = 1e-13, 1e-10
# A step whose ties have no solution is halved this often.
_HALVED = 2.0**-20
# A contact this many times round-off away from its wall takes part in a blow.
NEAR = 64.0
# Most contacts in one blow; more follow in the next one at the same instant.
_MOST = 16
# Blows at one instant, sweeps over the contacts of one, and the change of an impulse that ends them.
_BLOWS, _SWEEPS, _SMALL = 200, 2000, 1e-17


@inlined
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


@outlined
def judge(touching, chain, rule, lanes, pace, i):
    """What becomes of a lane whose trial step ends outside, has no solution, or looks for the time of an impact."""
    tau, low = pace.step[i], pace.low[i]
    pace.stuck[i] += 1
    if not pace.solved[i]:
        pace.trial[i] = 0.5 * tau
        pace.low[i], pace.high[i], pace.wall[i] = 0.0, math.inf, -1
        return AGAIN if tau > _HALVED * rule.dt else FAILED
    first, point, wall = math.inf, -1, -1
    for k in range(touching.plain.size):
        c, u = point_of(touching, lanes.r1, k, i), point_of(touching, lanes.v1, k, i)
        for w in range(walls.length(chain)):
            distance = walls.distance(chain, float(w), c)
            if not distance <= rule.room:
                time = _newton(chain, w, (c, u), distance, tau)
                if not low < time < tau:
                    time = 0.5 * (low + tau)
                if time < first:
                    first, point, wall = time, k, w
    if wall < 0:
        return _inside(touching, chain, rule, lanes, pace, i)
    pace.high[i], pace.point[i], pace.wall[i], pace.trial[i] = tau, point, wall, first
    if tau - low <= _NARROW * rule.dt or tau <= _SHORTEST * rule.dt:
        pace.trial[i] = low
        return STRIKE_NOW if low == 0.0 else AGAIN
    return AGAIN


@inlined
def _inside(touching, chain, rule, lanes, pace, i):
    """The trial ends inside: it is the step, the step to the impact, or a lower end of the bracket."""
    wall, tau = pace.wall[i], pace.step[i]
    if wall < 0:
        return COMMIT
    c, u = point_of(touching, lanes.r1, pace.point[i], i), point_of(touching, lanes.v1, pace.point[i], i)
    distance = walls.distance(chain, float(wall), c)
    if distance >= -rule.room or pace.high[i] - tau <= _NARROW * rule.dt:
        return STRIKE
    time = _newton(chain, wall, (c, u), distance, tau)
    pace.low[i] = tau
    pace.trial[i] = time if tau < time < pace.high[i] else 0.5 * (tau + pace.high[i])
    return AGAIN


@inlined
def _newton(chain, wall, contact, distance, tau):
    """When a contact, at its place and velocity at the time tau, is on the wall."""
    c, u = contact
    rate = dot(walls.unit_normal(chain, float(wall), c), u)
    return tau - distance / rate if rate > 0.0 else -1.0


@outlined
def strike(ties, touching, chain, rule, lanes, state, i, body):
    """The blows at one instant: no contact that is at its wall approaches it afterwards; whether that is so.

    For a wall without friction it is v+ = v- - (1 + e) (n.v)/(n K n) K n, where K is the inverse mass that the links
    leave: K = W - W J (J W J)^-1 J W with a row of J for each link. It is the contact step of the scheme for h -> 0.
    """
    m, r, v = ties.links, lanes.r, lanes.v
    system = scratch((m, m), np.float64)
    _links(ties, r, i, system)
    name = scratch((_MOST, 2), np.int64)
    frame = scratch((_MOST, 3, 3), np.float64)
    answer = scratch((3 * _MOST, m), np.float64)
    schur = scratch((3 * _MOST, 3 * _MOST), np.float64)
    rate = scratch(3 * _MOST, np.float64)
    p = scratch(3 * _MOST, np.float64)
    for _turn in range(_BLOWS):
        found = _approaching(touching, chain, rule, (r, v), i, (name, frame))
        if found == 0:
            return True
        rows = 3 * found
        for a in range(rows):
            _against_links(ties, touching, (name, frame), a, (r, i), answer)
            for row in range(m):
                for k in range(row):
                    answer[a, row] -= system[row, k] * answer[a, k]
                answer[a, row] /= system[row, row]
        for a in range(rows):
            k, u = name[a // 3, 0], point_of(touching, v, name[a // 3, 0], i)
            d = Vec(frame[a // 3, a % 3, 0], frame[a // 3, a % 3, 1], frame[a // 3, a % 3, 2])
            for b in range(rows):
                o = Vec(frame[b // 3, b % 3, 0], frame[b // 3, b % 3, 1], frame[b // 3, b % 3, 2])
                s = touching.to_others[k, name[b // 3, 0]] * dot(d, o)
                for row in range(m):
                    s -= answer[a, row] * answer[b, row]
                schur[a, b] = s
            rate[a] = dot(d, u)
            p[a] = 0.0
        for a in range(rows):
            for row in range(m - 1, -1, -1):
                for j in range(row + 1, m):
                    answer[a, row] -= system[j, row] * answer[a, j]
                answer[a, row] /= system[row, row]
            # Without what the links take of it: the velocity has a part across them, of the order of the scheme.
            for row in range(m):
                y = _tie(ties, r, row, i)
                rate[a] -= answer[a, row] * dot(y, _tie(ties, v, row, i))
        energy = _kinetic(ties, v, i)
        _impulses(touching, (name, found), schur, rate, p)
        _apply(ties, touching, (name, frame, rows), (answer, p), (r, v), i)
        for a in range(found):
            state.impulse[name[a, 1], body] += p[3 * a]
            if p[3 * a] > 0.0:
                state.impacts[body] += 1
        if not _is_elastic(touching, (name, found)):
            state.dissipated[body] += energy - _kinetic(ties, v, i)
    return False


@inlined
def _is_elastic(touching, contacts):
    name, found = contacts
    elastic = True
    for a in range(found):
        w = name[a, 1]
        elastic = elastic and touching.restitution[w] == 1.0 and touching.friction[w] == 0.0
    return elastic


@inlined
def _tie(ties, r, row, i):
    a, b = ties.ends[row, 0], ties.ends[row, 1]
    return Vec(r[a, 0, i] - r[b, 0, i], r[a, 1, i] - r[b, 1, i], r[a, 2, i] - r[b, 2, i])


@inlined
def _links(ties, r, i, system):
    """The Cholesky factor of J W J, the links' rows."""
    m = ties.links
    for a in range(m):
        y = _tie(ties, r, a, i)
        for b in range(a + 1):
            s = ties.couplings[a, b] * dot(y, _tie(ties, r, b, i))
            for k in range(b):
                s -= system[a, k] * system[b, k]
            system[a, b] = s / system[b, b] if b < a else math.sqrt(s)


@inlined
def _approaching(touching, chain, rule, motion, i, contacts):
    """The contacts at their walls that approach them: their names (point, wall), and a normal and two tangents each."""
    r, v = motion
    name, frame = contacts
    found = 0
    for k in range(touching.plain.size):
        c, u = point_of(touching, r, k, i), point_of(touching, v, k, i)
        for w in range(walls.length(chain)):
            if found < _MOST and walls.distance(chain, float(w), c) >= -NEAR * rule.room:
                n = walls.unit_normal(chain, float(w), c)
                # What is left of an approach by round-off is none.
                if dot(n, u) > 4.0 * np.finfo(np.float64).eps * norm(u):
                    name[found, 0], name[found, 1] = k, w
                    _frame(frame, found, n)
                    found += 1
    return found


@inlined
def _frame(frame, a, n):
    """The normal and two unit vectors across it."""
    flat = Vec(1.0, 0.0, 0.0) if abs(n.x) < 0.6 else Vec(0.0, 1.0, 0.0)
    t = cross(n, flat)
    t = t / norm(t)
    s = cross(n, t)
    frame[a, 0, 0], frame[a, 0, 1], frame[a, 0, 2] = n.x, n.y, n.z
    frame[a, 1, 0], frame[a, 1, 1], frame[a, 1, 2] = t.x, t.y, t.z
    frame[a, 2, 0], frame[a, 2, 1], frame[a, 2, 2] = s.x, s.y, s.z


@inlined
def _against_links(ties, touching, contacts, a, place, answer):
    """J W b d of each link, for direction a of the contacts."""
    name, frame = contacts
    r, i = place
    d = Vec(frame[a // 3, a % 3, 0], frame[a // 3, a % 3, 1], frame[a // 3, a % 3, 2])
    for row in range(ties.links):
        answer[a, row] = touching.to_ties[name[a // 3, 0], row] * dot(_tie(ties, r, row, i), d)


@inlined
def _kinetic(ties, v, i):
    total = 0.0
    for p in range(v.shape[0]):
        for q in range(v.shape[0]):
            m = ties.mass[p, q]
            if m != 0.0:
                total += 0.5 * m * (v[p, 0, i] * v[q, 0, i] + v[p, 1, i] * v[q, 1, i] + v[p, 2, i] * v[q, 2, i])
    return total


@inlined
def _impulses(touching, contacts, schur, rate, p):
    """Gauss-Seidel over the contacts: w+ = -e w- where a wall pushes; friction within its cone, or the point sticks."""
    name, found = contacts
    for _sweep in range(_SWEEPS):
        moved, size = 0.0, 0.0
        for a in range(found):
            wall, j = name[a, 1], 3 * a
            wanted = (1.0 + touching.restitution[wall]) * rate[j]
            for b in range(3 * found):
                wanted -= schur[j, b] * p[b]
            new = max(0.0, p[j] + wanted / schur[j, j])
            moved, size = max(moved, abs(new - p[j])), max(size, new)
            p[j] = new
            mu = touching.friction[wall]
            if mu > 0.0:
                one, other = rate[j + 1], rate[j + 2]
                for b in range(3 * found):
                    one -= schur[j + 1, b] * p[b]
                    other -= schur[j + 2, b] * p[b]
                stiff = max(schur[j + 1, j + 1], schur[j + 2, j + 2])
                one, other = p[j + 1] + one / stiff, p[j + 2] + other / stiff
                length = math.sqrt(one * one + other * other)
                within = min(1.0, mu * new / length) if length > 0.0 else 1.0
                moved = max(moved, abs(within * one - p[j + 1]), abs(within * other - p[j + 2]))
                p[j + 1], p[j + 2] = within * one, within * other
        if moved <= _SMALL * size:
            break


@inlined
def _apply(ties, touching, contacts, impulses, motion, i):
    """v -= W sum p (b d - sum x beta y)"""
    name, frame, rows = contacts
    answer, p = impulses
    r, v = motion
    push = scratch((v.shape[0], 3), np.float64)
    for a in range(rows):
        if p[a] != 0.0:
            k = name[a // 3, 0]
            for q in range(v.shape[0]):
                for x in range(3):
                    push[q, x] += p[a] * touching.reach[k, q] * frame[a // 3, a % 3, x]
            for row in range(ties.links):
                one, other = ties.ends[row, 0], ties.ends[row, 1]
                g = p[a] * answer[a, row]
                for q in range(v.shape[0]):
                    w = ties.inverse_mass[q, one] - ties.inverse_mass[q, other]
                    if w != 0.0:
                        for x in range(3):
                            push[q, x] -= g * w * (r[one, x, i] - r[other, x, i])
    for q in range(v.shape[0]):
        for x in range(3):
            v[q, x, i] -= push[q, x]

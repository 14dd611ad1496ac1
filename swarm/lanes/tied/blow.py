"""Impacts of a body: where its step is cut, and the blow that turns it round."""

import math

import numpy as np

from ...kernel.jit import inlined, outlined, scratch
from ...kernel.vector import Vec, cross, dot, norm
from ...surfaces import fold as walls

# What becomes of a lane after a trial.
AGAIN, COMMIT, STRIKE, STRIKE_NOW, FAILED = 0, 1, 2, 3, 4
# A bracket of the time of impact this narrow, as a part of a whole step, is a point; a step this short from a wall to
# itself is none.
_NARROW, _SHORTEST = 1e-13, 1e-5
# Trials that find most times of impact.
_QUICK = 6
# A step whose ties have no solution is halved this often.
_HALVED = 2.0**-20
# A contact this many times round-off away from its wall takes part in a blow.
NEAR = 64.0
# Most contacts in one blow; more follow in the next one at the same instant.
MOST_CONTACTS = 16
# Blows at one instant, sweeps over the contacts of one, and the change of an impulse that ends them.
_BLOWS, _SWEEPS, _SMALL = 200, 2000, 1e-17
# After so many short steps from impact to impact a wall that takes energy takes all of the approach.
_CHATTER = 12


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
def judge(touching, chain, rule, lanes, pace, i, larger):
    """What becomes of a lane whose trial step ends outside, has no solution, or looks for the time of an impact."""
    tau, low = pace.step[i], pace.low[i]
    pace.stuck[i] += 1
    if not pace.solved[i]:
        pace.trial[i] = 0.5 * tau
        pace.low[i], pace.high[i], pace.wall[i] = 0.0, math.inf, -1
        return AGAIN if tau > _HALVED * rule.dt else FAILED
    first, point, wall = math.inf, -1, -1
    # The forces of contacts that last leave a part of it.
    room = rule.room if pace.held[i] == 0 else larger
    for k in range(touching.plain.size):
        c, u = point_of(touching, lanes.r1, k, i), point_of(touching, lanes.v1, k, i)
        for w in range(walls.length(chain)):
            distance = walls.distance(chain, float(w), c)
            if not distance <= room:
                time = _newton(chain, w, (c, u), distance, tau)
                if not low < time < tau:
                    time = 0.5 * (low + tau)
                if time < first:
                    first, point, wall = time, k, w
    if wall < 0:
        return _inside(touching, chain, rule, lanes, pace, i)
    # Newton's method converges slowly where velocities of the scheme have a part along the ties: then by halves too.
    halves = pace.stuck[i] > _QUICK and pace.stuck[i] % 2 == 0
    first = 0.5 * (low + tau) if halves else first
    pace.high[i], pace.point[i], pace.wall[i], pace.trial[i] = tau, point, wall, first
    if tau - low <= _NARROW * rule.dt:
        pace.trial[i] = low
        return STRIKE_NOW if low == 0.0 else AGAIN
    if low == 0.0 and tau <= _SHORTEST * rule.dt:
        # It is at the wall, and does not leave it.
        start = walls.distance(chain, float(wall), point_of(touching, lanes.r, point, i))
        return STRIKE_NOW if start >= -NEAR * rule.room else AGAIN
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
    halves = pace.stuck[i] > _QUICK and pace.stuck[i] % 2 == 0
    pace.trial[i] = time if tau < time < pace.high[i] and not halves else 0.5 * (tau + pace.high[i])
    return AGAIN


@inlined
def _newton(chain, wall, contact, distance, tau):
    """When a contact, at its place and velocity at the time tau, is on the wall."""
    c, u = contact
    rate = dot(walls.unit_normal(chain, float(wall), c), u)
    return tau - distance / rate if rate > 0.0 else -1.0


@outlined
def strike(ties, touching, chain, rule, lanes, state, i, body):
    """The blows at one instant, after which no contact at its wall approaches it; how many there are.

    For a wall without friction it is v+ = v- - (1 + e) (n.v)/(n K n) K n, where K is the inverse mass that the links
    leave: K = W - W J (J W J)^-1 J W with a row of J for each link. It is the contact step of the scheme for h -> 0.
    """
    m, r, v = ties.links, lanes.r, lanes.v
    system = scratch((m, m), np.float64)
    links(ties, r, i, system)
    # Bounces that follow one another ever faster end here.
    bounces = 0.0 if state.short[body] > _CHATTER and min(touching.restitution) < 1.0 else 1.0
    name = scratch((MOST_CONTACTS, 2), np.int64)
    frame = scratch((MOST_CONTACTS, 3, 3), np.float64)
    answer = scratch((3 * MOST_CONTACTS, m), np.float64)
    schur = scratch((3 * MOST_CONTACTS, 3 * MOST_CONTACTS), np.float64)
    rate = scratch(3 * MOST_CONTACTS, np.float64)
    p = scratch(3 * MOST_CONTACTS, np.float64)
    for turn in range(_BLOWS):
        found = near(touching, chain, rule, (r, v), i, (name, frame), True)
        if found == 0:
            return turn
        rows = 3 * found
        respond(ties, touching, (name, frame, rows), (r, i), system, answer, schur)
        for a in range(rows):
            rate[a], p[a] = dot(direction(frame, a), point_of(touching, v, name[a // 3, 0], i)), 0.0
            # Without what the links take of it: the velocity has a part across them, of the order of the scheme.
            for row in range(m):
                rate[a] -= answer[a, row] * dot(_tie(ties, r, row, i), _tie(ties, v, row, i))
        energy = _kinetic(ties, v, i)
        _impulses(touching, (name, found), schur, rate, p, bounces)
        if max(p) == 0.0:
            return turn
        _apply(ties, touching, (name, frame, rows), (answer, p), (r, v), i)
        for a in range(found):
            state.impulse[name[a, 1], body] += p[3 * a]
            if p[3 * a] > 0.0:
                state.impacts[body] += 1
        if bounces == 0.0 or not _is_elastic(touching, (name, found)):
            state.dissipated[body] += energy - _kinetic(ties, v, i)
    return _BLOWS


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
def links(ties, r, i, system):
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
def near(touching, chain, rule, motion, i, contacts, approaching):
    """The contacts at their walls, or those that approach: their names (point, wall), a normal and two tangents."""
    r, v = motion
    name, frame = contacts
    found = 0
    for k in range(touching.plain.size):
        c, u = point_of(touching, r, k, i), point_of(touching, v, k, i)
        for w in range(walls.length(chain)):
            if found < MOST_CONTACTS and walls.distance(chain, float(w), c) >= -NEAR * rule.room:
                n = walls.unit_normal(chain, float(w), c)
                # What is left of an approach by round-off is none.
                if not approaching or dot(n, u) > 4.0 * np.finfo(np.float64).eps * norm(u):
                    name[found, 0], name[found, 1] = k, w
                    _frame(frame, found, n)
                    found += 1
    return found


@inlined
def direction(frame, a):
    """Direction a of the contacts: normal, tangent, tangent, normal of the next, ..."""
    return Vec(frame[a // 3, a % 3, 0], frame[a // 3, a % 3, 1], frame[a // 3, a % 3, 2])


@inlined
def respond(ties, touching, contacts, place, system, answer, schur):
    """How the velocities of contacts answer impulses at them, n K n, and x = (J W J)^-1 J W b d of each."""
    name, frame, rows = contacts
    m = ties.links
    for a in range(rows):
        _against_links(ties, touching, (name, frame), a, place, answer)
        for row in range(m):
            for k in range(row):
                answer[a, row] -= system[row, k] * answer[a, k]
            answer[a, row] /= system[row, row]
    for a in range(rows):
        d = direction(frame, a)
        for b in range(rows):
            s = touching.to_others[name[a // 3, 0], name[b // 3, 0]] * dot(d, direction(frame, b))
            for row in range(m):
                s -= answer[a, row] * answer[b, row]
            schur[a, b] = s
    for a in range(rows):
        for row in range(m - 1, -1, -1):
            for j in range(row + 1, m):
                answer[a, row] -= system[j, row] * answer[a, j]
            answer[a, row] /= system[row, row]


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
    d = direction(frame, a)
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
def _impulses(touching, contacts, schur, rate, p, bounces):
    """Gauss-Seidel over the contacts: w+ = -e w- where a wall pushes; friction within its cone, or the point sticks."""
    name, found = contacts
    for _sweep in range(_SWEEPS):
        moved, size = 0.0, 0.0
        for a in range(found):
            wall, j = name[a, 1], 3 * a
            wanted = (1.0 + bounces * touching.restitution[wall]) * rate[j]
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

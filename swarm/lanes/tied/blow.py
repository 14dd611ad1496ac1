"""Blows: the impulses of the walls at one instant, which turn a body round."""

import math

import numpy as np

from ...kernel.arrays import scratch
from ...kernel.jit import outlined
from ...kernel.vector import Vec, dot
from .contacts import MOST_CONTACTS, direction, near, point_of, width

# Blows at one instant, sweeps over the contacts of one, and the change of an impulse that ends them.
_BLOWS, _SWEEPS, _SMALL = 200, 2000, 1e-17
# After so many short steps from impact to impact a wall that takes energy takes all of the approach.
_CHATTER = 12
# A step from impact to impact this short, as a part of a whole one, is a bounce on the way to rest.
SHORT = 1.0 / 16.0
# Units of round-off by which a body may miss its energy.
_EPS = float(np.finfo(np.float64).eps)
_ROUND_OFF = 64.0 * _EPS


def chatters(touching, state, number):
    """Whether bounces follow one another ever faster: then they end."""
    return state.short[number] > _CHATTER and min(touching.restitution) < 1.0


@outlined
def restore(ties, rule, lanes, state, i, number):
    """Restore the energy of a body after a blow, where only round-off is missing: else it is an error to be seen.

    Steps miss 1.5e-16 of it and blows 3e-16, at random: after 10^5 impacts 3e-12. All velocities are scaled, so that
    links keep their lengths.
    """
    kinetic, fall, elastic = _kinetic(ties, lanes.v, i), 0.0, _stretched(ties, lanes.r, i)
    for p in range(ties.mass.shape[0]):
        mass = 0.0
        for q in range(ties.mass.shape[0]):
            mass += ties.mass[p, q]
        for x in range(3):
            fall -= mass * rule.gravity[x] * lanes.r[p, x, i]
    missing = state.energy[number] - state.dissipated[number] - (kinetic + fall + elastic)
    if abs(missing) <= _ROUND_OFF * (kinetic + abs(fall) + elastic) and kinetic > 0.0:
        # To first order: a body that has come to rest has no velocity by which more could be restored.
        factor = 0.5 * missing / kinetic
        if factor * factor <= _EPS:
            for q in range(lanes.v.shape[0]):
                for x in range(3):
                    lanes.v[q, x, i] += factor * lanes.v[q, x, i]


def _stretched(ties, r, i):
    """The energy of springs."""
    total = 0.0
    for a in range(ties.links, ties.ends.shape[0]):
        length2 = 0.0
        for x in range(3):
            y = r[ties.ends[a, 0], x, i] - r[ties.ends[a, 1], x, i]
            length2 += y * y
        longer = math.sqrt(length2) - ties.rest[a]
        total += 0.5 * ties.stiffness[a] * longer * longer
    return total


@outlined
def strike(body, chain, rule, lanes, state, i, number):
    """The blows at one instant, after which no contact at its wall approaches it; how many there are.

    For a wall without friction it is v+ = v- - (1 + e) (n.v)/(n K n) K n, where K is the inverse mass that links and
    guides leave: K = W - W J (J W J)^-1 J W with a row of J for each. It is the contact step of the scheme for h -> 0.
    """
    touching = body[1]
    bounces = 0.0 if chatters(touching, state, number) else 1.0
    name = scratch((MOST_CONTACTS, 2), np.int64)
    frame = scratch((MOST_CONTACTS, 3, 3), np.float64)
    for turn in range(_BLOWS):
        found = near(touching, chain, rule, (lanes.r, lanes.v), i, (name, frame), True)
        if found == 0 or not _blow(body, chain, lanes, state, (name, frame, found), bounces, (i, number)):
            return turn
    return _BLOWS


@outlined
def _blow(body, chain, lanes, state, contacts, bounces, which):
    """One blow at all these contacts; whether there is any."""
    ties, touching = body
    name, frame, found = contacts
    i, number = which
    r, v = lanes.r, lanes.v
    m, wide = ties.links + touching.guides, width(touching, name, found)
    rows = wide * found
    system, across = scratch((m, m), np.float64), scratch((m, 3), np.float64)
    answer, schur = scratch((rows, m), np.float64), scratch((rows, rows), np.float64)
    rate, p = scratch(rows, np.float64), scratch(rows, np.float64)
    _rigid(body, chain, r, i, (system, across))
    _respond(body, (name, frame, wide), (system, across), answer, schur)
    for a in range(rows):
        rate[a] = dot(_direction(frame, a, wide), point_of(touching, v, name[a // wide, 0], i))
        # Without what links take of it: the velocity has a part across them, of the order of the scheme.
        for row in range(m):
            rate[a] -= answer[a, row] * dot(_vector(across, row), _velocity(body, v, row, i))
    _impulses(touching, (name, found, wide), schur, rate, p, bounces)
    if max(p) == 0.0:
        return False
    is_led = max(ties.led) >= 0
    before = _kinetic(ties, v, i) if is_led else 0.0
    _apply(body, (name, frame, wide), across, (answer, p), v, i)
    lost = 0.0
    for a in range(found):
        state.impulse[chain.row(float(name[a, 1])), number] += p[wide * a]
        if p[wide * a] > 0.0:
            state.impacts[number] += 1
    if bounces == 0.0 or not _is_elastic(touching, (name, found)):
        # p times the mean of the rates before and after
        for a in range(rows):
            after = rate[a]
            for b in range(rows):
                after -= schur[a, b] * p[b]
            lost += 0.5 * p[a] * (rate[a] + after)
    state.dissipated[number] += lost
    if is_led:
        state.work[number] += (_kinetic(ties, v, i) - before) + lost
    return True


def _is_elastic(touching, contacts):
    name, found = contacts
    elastic = True
    for a in range(found):
        w = name[a, 1]
        elastic = elastic and touching.restitution[w] == 1.0 and touching.friction[w] == 0.0
    return elastic


def _vector(rows, a):
    return Vec(rows[a, 0], rows[a, 1], rows[a, 2])


def _direction(frame, a, wide):
    """Direction a of contacts with so many each."""
    return direction(frame, 3 * (a // wide) + a % wide)


def _name(body, row):
    """The row of a link or guide among all couplings."""
    ties, touching = body
    return row if row < ties.links else row - ties.links + ties.ends.shape[0] + touching.points


def _velocity(body, v, row, i):
    """The relative velocity of a link's ends, or that of a guide's point."""
    ties, touching = body
    if row >= ties.links:
        return point_of(touching, v, touching.points + row - ties.links, i)
    a, b = ties.ends[row, 0], ties.ends[row, 1]
    return Vec(v[a, 0, i] - v[b, 0, i], v[a, 1, i] - v[b, 1, i], v[a, 2, i] - v[b, 2, i])


def _rigid(body, chain, r, i, rows):
    """The vector of every link and guide, and the Cholesky factor of J W J."""
    ties, touching = body
    system, across = rows
    for a in range(system.shape[0]):
        y = _velocity(body, r, a, i)
        if a >= ties.links:
            y = chain.unit_normal(float(touching.walls + a - ties.links), y)
        across[a, 0], across[a, 1], across[a, 2] = y.x, y.y, y.z
        for b in range(a + 1):
            s = ties.couplings[_name(body, a), _name(body, b)] * dot(y, _vector(across, b))
            for k in range(b):
                s -= system[a, k] * system[b, k]
            system[a, b] = s / system[b, b] if b < a else math.sqrt(s)


def _respond(body, contacts, rigid, answer, schur):
    """How the velocities of contacts answer impulses at them, n K n, and x = (J W J)^-1 J W b d of each."""
    ties = body[0]
    name, frame, wide = contacts
    system, across = rigid
    rows, m, count = schur.shape[0], system.shape[0], ties.ends.shape[0]
    for a in range(rows):
        d = _direction(frame, a, wide)
        for row in range(m):
            s = ties.couplings[count + name[a // wide, 0], _name(body, row)] * dot(_vector(across, row), d)
            for k in range(row):
                s -= system[row, k] * answer[a, k]
            answer[a, row] = s / system[row, row]
        for b in range(a + 1):
            s = ties.couplings[count + name[a // wide, 0], count + name[b // wide, 0]]
            s *= dot(d, _direction(frame, b, wide))
            for row in range(m):
                s -= answer[a, row] * answer[b, row]
            schur[a, b] = schur[b, a] = s
    for a in range(rows):
        for row in range(m - 1, -1, -1):
            for j in range(row + 1, m):
                answer[a, row] -= system[j, row] * answer[a, j]
            answer[a, row] /= system[row, row]


def _kinetic(ties, v, i):
    total = 0.0
    for p in range(v.shape[0]):
        for q in range(v.shape[0]):
            m = ties.mass[p, q]
            if m != 0.0:
                total += 0.5 * m * (v[p, 0, i] * v[q, 0, i] + v[p, 1, i] * v[q, 1, i] + v[p, 2, i] * v[q, 2, i])
    return total


def _impulses(touching, contacts, schur, rate, p, bounces):
    """Gauss-Seidel over the contacts: w+ = -e w- where a wall pushes; friction within its cone, or the point sticks."""
    name, found, wide = contacts
    for _sweep in range(_SWEEPS):
        moved, size = 0.0, 0.0
        for a in range(found):
            wall, j = name[a, 1], wide * a
            wanted = (1.0 + bounces * touching.restitution[wall]) * rate[j]
            for b in range(wide * found):
                wanted -= schur[j, b] * p[b]
            new = max(0.0, p[j] + wanted / schur[j, j])
            moved, size = max(moved, abs(new - p[j])), max(size, new)
            p[j] = new
            mu = touching.friction[wall]
            if mu > 0.0:
                one, other = rate[j + 1], rate[j + 2]
                for b in range(wide * found):
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


def _apply(body, contacts, across, impulses, v, i):
    """v -= W sum p (b d - sum x J)"""
    ties, touching = body
    name, frame, wide = contacts
    answer, p = impulses
    m = answer.shape[1]
    push = scratch((v.shape[0], 3), np.float64)
    against = scratch(m, np.float64)
    for a in range(p.size):
        d = _direction(frame, a, wide)
        for q in range(v.shape[0]):
            g = p[a] * touching.reach[name[a // wide, 0], q]
            push[q, 0] += g * d.x
            push[q, 1] += g * d.y
            push[q, 2] += g * d.z
        for row in range(m):
            against[row] += p[a] * answer[a, row]
    for row in range(m):
        for q in range(v.shape[0]):
            if row < ties.links:
                w = ties.inverse_mass[q, ties.ends[row, 0]] - ties.inverse_mass[q, ties.ends[row, 1]]
            else:
                w = touching.reach[touching.points + row - ties.links, q]
            for x in range(3):
                push[q, x] -= against[row] * w * across[row, x]
    for q in range(v.shape[0]):
        for x in range(3):
            v[q, x, i] -= push[q, x]

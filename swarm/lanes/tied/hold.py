"""Stages of a body whose contacts last, or whose points are in guides: one constraint more for each.

A guide keeps its point on a surface, and pushes or pulls. A contact that lasts is g(q1) = g(q0) for as long as its
multiplier pushes: no contact moves through its wall, so their forces do no work but that of friction. Newton's method
solves ties and guides together; what is left of it for the contacts (Schur's complement) is solved by Gauss-Seidel,
until gaps and signs are right.
"""

import math
from typing import Any

import numpy as np

from ...kernel.arrays import scratch
from ...kernel.jit import outlined
from ...kernel.vector import Vec, cross, dot, norm
from . import blow, instant
from .contacts import MOST_CONTACTS, NEAR, ROOM, direction, near, point_of, width
from .contract import Contacts
from .guides import name_of, slope_of, vector_of

# From this correction of a stage on the equations may be worse by the factor, in units of round-off: where more
# contacts than three hold a rigid body, their forces converge slowly.
_PATIENT, _LARGER = 20, 1e3
# Sweeps over the contacts in one correction.
_SWEEPS = 60
# The most that an error of friction moves a contact [m/s].
_CREEP = 1e-7
# After so many blows without a step the contacts last.
_LASTS = 20


def push(body, lanes, held, pace, i):
    """Add the forces of guides and contacts to the deceleration."""
    tied, touching = body
    for g in range(touching.guides):
        row = tied.ends.shape[0] + g
        for q in range(lanes.force.shape[0]):
            f = lanes.multiplier[row, i] * touching.reach[touching.points + g, q]
            for x in range(3):
                lanes.force[q, x, i] += f * lanes.d[row, x, i]
    for a in range(pace.held[i]):
        k = held.name[i, a, 0]
        for d in range(3):
            p = held.press[i, 3 * a + d]
            if p != 0.0:
                for q in range(lanes.force.shape[0]):
                    for x in range(3):
                        lanes.force[q, x, i] += p * touching.reach[k, q] * held.frame[i, a, d, x]


def eliminate(kind, contacts, systems, i):
    """Leave the contacts alone: schur, and gap without what the corrections of ties and guides do to it."""
    name, frame, _press, wide, found = contacts
    along, across, schur, gap = systems
    body, lanes, pace = kind.body, kind.lanes, kind.pace
    tied, touching = body
    m, rows, count = lanes.f.shape[0], wide * found, tied.ends.shape[0]
    half = 0.5 * pace.h[i] * pace.h[i]
    for a in range(rows):
        k, wall, d = name[a // wide, 0], name[a // wide, 1], direction(frame, 3 * (a // wide) + a % wide)
        e = d
        if a % wide == 0:
            e = kind.gap_gradient(float(wall), point_of(touching, lanes.r1, k, i))
        for row in range(m):
            c = half * tied.couplings[count + k, name_of(body, row)]
            along[a, row] = c * dot(e, vector_of(lanes.d, row, i))
            across[a, row] = c * dot(slope_of(tied, lanes, row, i), d)
            gap[a] -= along[a, row] * lanes.f[row, i]
        _substitute(tied.start, lanes.a, across, a, i)
        for b in range(rows):
            c = half * tied.couplings[count + k, count + name[b // wide, 0]]
            schur[a, b] = c * dot(e, direction(frame, 3 * (b // wide) + b % wide))
    for a in range(rows):
        for b in range(rows):
            for row in range(m):
                schur[a, b] -= along[a, row] * across[b, row]


def _substitute(start, a, x, k, i):
    """x[k] = A^-1 x[k] with the factored system of a lane."""
    m = x.shape[1]
    for row in range(m):
        for j in range(start[row], row):
            x[k, row] -= a[row, j, i] * x[k, j]
    for row in range(m - 1, -1, -1):
        for j in range(row + 1, m):
            if start[j] <= row:
                x[k, row] -= a[row, j, i] * x[k, j]
        x[k, row] *= a[row, row, i]


def _sweep(touching, contacts, schur, gap, change):
    """Gauss-Seidel: no contact ends outside, none pulls, and one with friction stays or slides within its cone.

    How far friction moves a contact by its change is returned: which way a point creeps is less exact, since what it
    loses is booked whatever it is.
    """
    name, _frame, press, wide, found = contacts
    rows, creep = wide * found, 0.0
    for _turn in range(_SWEEPS):
        largest, size = 0.0, 0.0
        for a in range(found):
            j, mu = wide * a, touching.friction[name[a, 1]]
            left = gap[j]
            for b in range(rows):
                left -= schur[j, b] * change[b]
            new = max(0.0, press[3 * a] + left / schur[j, j])
            largest, size = max(largest, abs(new - press[3 * a])), max(size, new)
            change[j] += new - press[3 * a]
            press[3 * a] = new
            if mu > 0.0:
                one, other = gap[j + 1], gap[j + 2]
                for b in range(rows):
                    one -= schur[j + 1, b] * change[b]
                    other -= schur[j + 2, b] * change[b]
                stiff = max(schur[j + 1, j + 1], schur[j + 2, j + 2])
                one, other = press[3 * a + 1] + one / stiff, press[3 * a + 2] + other / stiff
                length = math.sqrt(one * one + other * other)
                within = min(1.0, mu * new / length) if length > 0.0 else 1.0
                one, other = within * one, within * other
                largest = max(largest, abs(one - press[3 * a + 1]), abs(other - press[3 * a + 2]))
                change[j + 1] += one - press[3 * a + 1]
                change[j + 2] += other - press[3 * a + 2]
                press[3 * a + 1], press[3 * a + 2] = one, other
        if largest <= 1e-16 * size:
            break
    for a in range(found):
        for d in range(1, wide):
            creep = max(creep, abs(change[wide * a + d]) * schur[wide * a, wide * a])
    return creep


def book(touching, lanes, paces, i):
    """Book the impulses of the walls, and the work of friction, in the stage."""
    pace, held = paces
    for a in range(pace.held[i]):
        k, press = held.name[i, a, 0], held.press[i, 3 * a]
        held.stages[i, a] += 1 if press > 0.0 else 0
        held.impulse[i, a] += pace.h[i] * press * norm(direction(held.frame[i], 3 * a))
        away = point_of(touching, lanes.r1, k, i) - point_of(touching, lanes.ra, k, i)
        for d in range(1, 3):
            held.lost[i] += held.press[i, 3 * a + d] * dot(direction(held.frame[i], 3 * a + d), away)


def is_mixed(paces, i, stages):
    """Whether a contact pushed in some stages of a composed step only: then energy went with it."""
    pace, held = paces
    mixed = False
    for a in range(pace.held[i]):
        mixed = mixed or 0 < held.stages[i, a] < stages
    return mixed


def forget(held, i):
    """Forget those of a trial."""
    held.lost[i] = 0.0
    for a in range(held.name.shape[1]):
        held.impulse[i, a], held.stages[i, a] = 0.0, 0


class HardContacts(Contacts):
    """Contacts with rigid walls, which strike, and last as long as they push."""

    @outlined
    def begin(self: Any, i):
        # In a step they press as in the step before where they are the same.
        body, chain, rule, lanes, pace, held = self
        if not (pace.fresh[i] or not pace.solved[i]):
            return
        name, frame = held.name[i], held.frame[i]
        touching = body[1]
        before, found = pace.held[i], 0
        fresh = scratch((MOST_CONTACTS, 2), np.int64)
        turned = scratch((MOST_CONTACTS, 3, 3), np.float64)
        if pace.lasts[i]:
            found = near(touching, chain, rule, (lanes.r, lanes.v), i, (fresh, turned), False)
        # A trial without a solution leaves infinite forces.
        same = found == before and pace.solved[i]
        for a in range(found):
            same = same and fresh[a, 0] == name[a, 0] and fresh[a, 1] == name[a, 1]
        pace.held[i] = found
        for a in range(3 * found):
            # Steadily growing forces are guessed exactly.
            p, before = held.press[i, a], held.before[i, a]
            held.press[i, a] = 2.0 * p - before if same and before == before else p
            held.before[i, a] = p if same else math.nan
        if not same:
            for a in range(found):
                name[a, 0], name[a, 1] = fresh[a, 0], fresh[a, 1]
                for d in range(3):
                    held.press[i, 3 * a + d] = 0.0
                    for x in range(3):
                        frame[a, d, x] = turned[a, d, x]

    @outlined
    def turn(self: Any, i, r1):
        body, chain, _rule, lanes, pace, held = self
        touching = body[1]
        frame = held.frame[i]
        for a in range(pace.held[i]):
            k, wall = held.name[i, a, 0], held.name[i, a, 1]
            n = chain.step_normal(float(wall), point_of(touching, lanes.ra, k, i), point_of(touching, r1, k, i))
            frame[a, 0, 0], frame[a, 0, 1], frame[a, 0, 2] = n.x, n.y, n.z
            if touching.friction[wall] > 0.0:
                t = Vec(frame[a, 1, 0], frame[a, 1, 1], frame[a, 1, 2])
                t = t - dot(t, n) * n
                t = t / norm(t)
                s = cross(n, t)
                frame[a, 1, 0], frame[a, 1, 1], frame[a, 1, 2] = t.x, t.y, t.z
                frame[a, 2, 0], frame[a, 2, 1], frame[a, 2, 2] = s.x, s.y, s.z

    @outlined
    def correct(self: Any, i, number):
        body, chain, rule, lanes, pace, held = self
        touching = body[1]
        found = pace.held[i]
        wide = width(touching, held.name[i], found)
        rows, m = wide * found, lanes.f.shape[0]
        contacts = held.name[i], held.frame[i], held.press[i], wide, found
        along, across = scratch((rows, m), np.float64), scratch((rows, m), np.float64)
        schur = scratch((rows, rows), np.float64)
        gap, change = scratch(rows, np.float64), scratch(rows, np.float64)
        error = pace.residue[i]
        for a in range(found):
            k, wall = held.name[i, a, 0], held.name[i, a, 1]
            y0, y1 = point_of(touching, lanes.ra, k, i), point_of(touching, lanes.r1, k, i)
            for d in range(wide):
                gap[wide * a + d] = dot(direction(held.frame[i], 3 * a + d), y1 - y0)
            # Gaps of round-off stay what they are; in a composed stage a contact can also be away from its wall.
            away = chain.distance(float(wall), y0)
            gap[wide * a] += away if away > 0.0 or away < -NEAR * rule.room else 0.0
            off = abs(gap[wide * a]) if held.press[i, 3 * a] > 0.0 else max(gap[wide * a], 0.0)
            error = max(error, off / rule.room)
        before = pace.unsettled[i] if number > 0 else 1.0
        pace.unsettled[i] = error
        late = number >= _PATIENT
        # One correction more than errors of round-off ask for, since directions lag behind forces: to stop where the
        # next would be within round-off loses 4e-10 J of 40 J in a step of examples/slider_crank.py.
        last = error <= 1.0 or (late and error <= _LARGER and error >= 0.5 * before)
        eliminate(self, contacts, (along, across, schur, gap), i)
        creep = _sweep(touching, contacts, schur, gap, change)
        for row in range(m):
            for a in range(rows):
                lanes.f[row, i] -= across[a, row] * change[a]
        pace.last[i] = last and (late or creep <= max(_CREEP * abs(pace.h[i]), rule.room))

    def gap_gradient(self: Any, wall, y):
        return self.chain.unit_normal(wall, y)

    @outlined
    def judge(self: Any, i):
        body, chain, rule, lanes, pace, _held = self
        return instant.look(body[1], chain, rule, lanes, pace, i, 2.0 * ROOM * rule.room)

    @outlined
    def end(self: Any, state, i):
        # Contacts last as long as one of them pushes.
        _body, chain, _rule, _lanes, pace, held = self
        number, pushes = pace.body[i], False
        for a in range(pace.held[i]):
            pushes = pushes or held.press[i, 3 * a] > 0.0
            state.impulse[chain.row(float(held.name[i, a, 1])), number] += held.impulse[i, a]
        state.dissipated[number] += held.lost[i]
        state.sliding[number] += pace.step[i]
        if not pushes:
            pace.lasts[i] = False
            pace.held[i] = 0

    @outlined
    def strike(self: Any, state, i):
        body, chain, rule, lanes, pace, _held = self
        number, at_once = pace.body[i], pace.action[i] == instant.STRIKE_NOW
        short = at_once or pace.step[i] < blow.SHORT * rule.dt
        state.short[number] = state.short[number] + 1 if short else 0
        blows = blow.strike(body, chain, rule, lanes, state, i, number)
        # The energy of a strain takes as many products as the square of its edges.
        if blows > 0 and max(body[0].led) < 0 and body[0].compliance.shape[0] == 0:
            blow.restore(body[0], rule, lanes, state, i, number)
        stays = blow.chatters(body[1], state, number) or pace.stuck[i] > _LASTS
        pace.lasts[i] = pace.lasts[i] or stays or (at_once and blows == 0)

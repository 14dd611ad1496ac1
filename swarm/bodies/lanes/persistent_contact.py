"""Lasting contacts with rigid walls: each adds a constraint.

A lasting contact has g(q1) = g(q0) for as long as its multiplier pushes: no contact moves through its wall, and its
force does no work but that of friction. Newton's method solves ties and guides together. The Schur complement of the
contacts is solved by Gauss-Seidel, until gaps and signs are right.
"""

import math
from typing import Any

import numpy as np

from ...kernel.arrays import scratch
from ...kernel.jit import outlined
from ...kernel.vector import dot, norm
from . import impact, impact_time, sent_off, sticking
from .contacts import MOST_CONTACTS, NEAR, ROOM, BodyContacts, direction, put_direction, put_frame, sweep

# From correction `_PATIENT` of a stage on, the equations may have errors of `_LARGER`, in units of round-off, if more
# than `_DETERMINED` contacts hold a body: their forces are not determined, and converge slowly.
_PATIENT, _LARGER, _DETERMINED = 20, 1e3, 3
# The most sweeps over the contacts in one correction, and the relative change of their forces that ends the sweeps.
_SWEEPS = 60, 1e-16
# The largest velocity of a contact by an error of friction [m/s].
_CREEP = 1e-7
# After this number of blows without a step the contacts last.
_LASTS = 20


class HardContacts(BodyContacts):
    """Contacts with rigid walls: they begin with a blow, and last as long as they push."""

    @outlined
    def begin(self: Any, i):
        # Contacts that are the same as in the step before begin with its forces.
        pace, active, most = self.pace, self.active, self.rule.most
        if not (pace.fresh[i] or not pace.solved[i]):
            # All trials of a step begin alike. Friction is solved to `_CREEP`, not to round-off: a repeated trial that
            # began with other forces could end on the other side of the wall, and no time of impact would be found.
            for a in range(pace.active[i]):
                for d in range(3):
                    active.press[i, 3 * a + d] = active.press[i, 3 * (most + a) + d]
                    put_direction(active.frame[i], a, d, direction(active.frame[i], most + a, d))
            return
        name, frame, before, found = active.name[i], active.frame[i], pace.active[i], 0
        fresh = scratch((MOST_CONTACTS, 2), np.int64)
        turned = scratch((MOST_CONTACTS, 3, 3), np.float64)
        if pace.lasts[i]:
            found = self.near(i, fresh, turned, False)
        # A trial without a solution leaves infinite forces.
        same = found == before and pace.solved[i]
        for a in range(found):
            same = same and fresh[a, 0] == name[a, 0] and fresh[a, 1] == name[a, 1]
        pace.active[i] = found
        for a in range(3 * found):
            # This guess is exact for forces that grow linearly.
            p, last = active.press[i, a], active.before[i, a]
            active.press[i, a] = 2.0 * p - last if same and last == last else p
            active.before[i, a] = p if same else math.nan
        if not same:
            for a in range(found):
                name[a, 0], name[a, 1] = fresh[a, 0], fresh[a, 1]
                for d in range(3):
                    active.press[i, 3 * a + d] = 0.0
                    put_direction(frame, a, d, direction(turned, a, d))
        for a in range(found):
            for d in range(3):
                active.press[i, 3 * (most + a) + d] = active.press[i, 3 * a + d]
                put_direction(active.frame[i], most + a, d, direction(frame, a, d))

    @outlined
    def turn(self: Any, i, r1):
        touching, active, frame = self.touching, self.active, self.active.frame[i]
        for a in range(self.pace.active[i]):
            k, wall = active.name[i, a, 0], active.name[i, a, 1]
            y0, y1 = self.spot(self.lanes.ra, k, i), self.spot(r1, k, i)
            n = self.walls_between(i).step_normal(float(wall), y0, y1)
            if touching.friction[wall] > 0.0:
                t = direction(frame, a, 1)
                t = t - dot(t, n) * n
                put_frame(frame, a, n, t / norm(t))
            else:
                put_direction(frame, a, 0, n)

    @outlined
    def correct(self: Any, i, number):
        touching, rule, lanes, pace, active = self.touching, self.rule, self.lanes, self.pace, self.active
        found, m, wide = pace.active[i], lanes.f.shape[0], touching.width(active.name[i], pace.active[i])
        rows = wide * found
        along, across = scratch((rows, m), np.float64), scratch((rows, m), np.float64)
        schur = scratch((rows, rows), np.float64)
        gap, change = scratch(rows, np.float64), scratch(rows, np.float64)
        error, eased = pace.residue[i], sticking.is_short(self, i) and touching.dissipate(active.name[i], found)
        for a in range(found):
            k, wall = active.name[i, a, 0], active.name[i, a, 1]
            y0, y1 = self.spot(lanes.ra, k, i), self.spot(lanes.r1, k, i)
            way = away = y1 - y0
            if self.walls_move():
                carried, moved = self.carried(wall, y0, y1, i)
                way, away = way - carried, away - moved
            for d in range(wide):
                gap[wide * a + d] = dot(direction(active.frame[i], a, d), away if d == 0 else way)
            # Gaps of round-off are kept; in a composed stage a contact can also be away from its wall.
            start = self.walls_between(i).distance(float(wall), y0)
            outside = start > 0.0 and not eased
            gap[wide * a] += start if outside or start < -NEAR * rule.room else 0.0
            off = abs(gap[wide * a]) if active.press[i, 3 * a] > 0.0 else max(gap[wide * a], 0.0)
            error = max(error, off / rule.room)
        before = pace.unsettled[i] if number > 0 else 1.0
        pace.unsettled[i] = error
        late = number >= _PATIENT and found > _DETERMINED
        # One correction more than errors of round-off need, as directions lag behind forces: to stop one correction
        # earlier loses 4e-10 J of 40 J in a step of examples/slider_crank.py.
        last = error <= 1.0 or (late and error <= _LARGER and error >= 0.5 * before)
        self.eliminate(wide, (along, across, schur, gap), i)
        sweep(touching, (active.name[i], active.press[i], 3, wide), schur, gap, change, _SWEEPS)
        # The velocity of a contact by the change of friction. The creep of a point need not be exact, as the energy it
        # loses is booked in any case.
        creep = 0.0
        for a in range(found):
            for d in range(1, wide):
                creep = max(creep, abs(change[wide * a + d]) * schur[wide * a, wide * a])
        for row in range(m):
            for a in range(rows):
                lanes.f[row, i] -= across[a, row] * change[a]
        pace.last[i] = last and (late or creep <= max(_CREEP * abs(pace.h[i]), rule.room))

    def gap_gradient(self: Any, wall, y, i):
        return self.walls_after(i).unit_normal(wall, y)

    @outlined
    def judge(self: Any, i):
        return impact_time.look(self, i, 2.0 * ROOM * self.rule.room)

    @outlined
    def end(self: Any, state, i):
        # Contacts last as long as one of them pushes, and after a step without forces.
        pace, active = self.pace, self.active
        number, pushes = pace.body[i], pace.brief[i]
        for a in range(pace.active[i]):
            pushes = pushes or active.press[i, 3 * a] > 0.0
            row = self.walls.row(float(active.name[i, a, 1]))
            state.impulse[row, number] += active.impulse[i, a]
            if state.wall_work is not None:
                state.wall_work[row, number] += active.work[i, a]
        state.dissipated[number] += active.lost[i]
        sticking.stop(self, state, i)
        state.sliding[number] += pace.step[i]
        if not pushes:
            pace.lasts[i] = False
            pace.active[i] = 0

    @outlined
    def strike(self: Any, state, i):
        ties, pace = self.ties, self.pace
        number, at_once = pace.body[i], pace.action[i] == impact_time.STRIKE_NOW
        short = at_once or pace.step[i] < impact.SHORT * self.rule.dt
        state.short[number] = state.short[number] + 1 if short else 0
        blows = impact.strike(self, state, i)
        if self.touching.laws is not None and at_once and blows == 0:
            blows = sent_off.leave_rest(self, state, i)
        # The energy of a strain takes a number of products that grows with the square of its edges.
        if blows > 0 and max(ties.led) < 0 and ties.compliance.shape[0] == 0:
            impact.restore(self, state, i)
        stays = impact.chatters(self.touching, state, number) or pace.stuck[i] > _LASTS
        pace.lasts[i] = pace.lasts[i] or stays or (at_once and blows == 0)

    def send_off(self, state, name, frame, found, i):
        return self.touching.laws is not None and sent_off.send_off(self, state, name, frame, found, i)

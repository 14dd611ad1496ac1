"""Soft walls, and multipliers by Uzawa's loop: `Penalty` and `AugmentedLagrangian` for bodies.

Each contact pushes with F = V[g0, g1] + lambda Phi[g0, g1] along g[q0, q1] D_q, the composite discrete gradient of its
gap, as for particles (contact/impulse.py): its work is exactly the change of V + lambda Phi. Newton's method solves
p = F(g1) for the force p together with ties and guides. The loop (8) then reduces V of walls, and of links, which are
relaxed for it (constraints.py), to zero by
    lambda <- lambda + alpha (Phi0 + Phi1)/2.
Source: García Orden & Ortega 2007, eqs. (5), (7), (8).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ...kernel.arrays import scratch
from ...kernel.jit import outlined
from ...kernel.vector import ZERO, column, square
from . import impact_time
from .contacts import MOST_CONTACTS, NEAR, ROOM, BodyContacts, direction, put_direction, solve_dense


class Soft(NamedTuple):
    """The law of soft walls, and the parameters of Uzawa's loop (8) for their multipliers."""

    law: Any  # of contact/regularisation.py
    tolerance: float  # the stored energy V that ends the loop [J]
    sweeps: int  # the most sweeps; 1: no multipliers
    is_cut: bool  # whether steps are cut at an impact, as the loop needs it
    deepest: float  # the gap that stores the tolerance [m]


def _normal_of(surface, r0, r1):
    rise, _curvature = surface.gap_slope(surface.inner(r0), surface.inner(r1))
    return rise * surface.discrete_gradient(r0, r1)


def _gap_of(surface, r):
    return surface.gap_of(surface.inner(r))


def _normal(walls, wall, r0, r1):
    """The discrete gradient of the gap of a wall."""
    return walls.of(wall, ZERO, _normal_of, r0, r1)


def _gap(walls, wall, r):
    """The gap of a wall."""
    return walls.of(wall, 0.0, _gap_of, r)


# From correction `_PATIENT` on the equations may have errors of `_LARGER`, in units of round-off.
_PATIENT, _LARGER = 30, 1e2
# The round-off of the square of a length, in units of `noise`.
_ROUND_OFF = 8.0
# The last change of the directions of ties, in units of round-off of a place.
_SETTLED = 8.0


class SoftContacts(BodyContacts):
    """Contacts with soft walls."""

    def _start(self: Any, wall, y):
        """The gap at the start of a step; in the loop 0 if it is within the tolerance, as only State I has a limit."""
        gap, rule = _gap(self.walls, wall, y), self.rule
        return 0.0 if rule.loop and abs(gap) <= 2.0 * max(rule.walls.deepest, ROOM * rule.room) else gap

    def _is_outside(self: Any, r, k, wall, i):
        """Whether a point of a lane is outside a wall."""
        return _gap(self.walls, float(wall), self.touching.place(r, k, i)) > 0.0

    def _number(self: Any, i, k, wall):
        """The number of a contact of a lane, -1 for none."""
        index, name = -1, self.active.name[i]
        for a in range(self.pace.active[i]):
            if name[a, 0] == k and name[a, 1] == wall:
                index = a
        return index

    @outlined
    def begin(self: Any, i):
        # The contacts at walls if steps are cut; else the contacts outside, at the start or in the trial before.
        touching, rule, lanes, pace, active = self.touching, self.rule, self.lanes, self.pace, self.active
        name, found, again = active.name[i], 0, not pace.fresh[i]
        fresh, press = scratch((rule.most, 2), np.int64), scratch(rule.most, np.float64)
        if rule.walls.is_cut:
            if again and pace.solved[i]:
                return
            found = self.near(i, fresh, active.frame[i], False)
        else:
            for k in range(touching.plain.size):
                first, last = touching.span(k)
                for w in range(first, last):
                    inside = not self._is_outside(lanes.r, k, w, i)
                    if inside and again:
                        inside = self._number(i, k, w) < 0 and not self._is_outside(lanes.r1, k, w, i)
                    if not inside:
                        fresh[found, 0], fresh[found, 1] = k, w
                        found += 1
        for a in range(found):
            known = self._number(i, fresh[a, 0], fresh[a, 1])
            press[a] = active.press[i, 3 * known] if known >= 0 and pace.solved[i] else 0.0
        pace.active[i] = found
        for a in range(found):
            name[a, 0], name[a, 1] = fresh[a, 0], fresh[a, 1]
            active.press[i, 3 * a], active.press[i, 3 * a + 1], active.press[i, 3 * a + 2] = press[a], 0.0, 0.0

    @outlined
    def turn(self: Any, i, r1):
        touching, pace, active, frame = self.touching, self.pace, self.active, self.active.frame[i]
        half, ties = 0.5 * pace.h[i] * pace.h[i], self.ties.ends.shape[0]
        for a in range(pace.active[i]):
            k, wall = active.name[i, a, 0], float(active.name[i, a, 1])
            n = _normal(self.walls, wall, touching.place(self.lanes.ra, k, i), touching.place(r1, k, i))
            # The change of the place of the point as a change of D turns the force.
            moved = half * self.ties.couplings[ties + k, ties + k] * active.press[i, 3 * a]
            pace.lag[i] += square(moved * (n - direction(frame, a, 0)))
            put_direction(frame, a, 0, n)

    @outlined
    def correct(self: Any, i, number):
        touching, rule, lanes, pace, active = self.touching, self.rule, self.lanes, self.pace, self.active
        law = rule.walls.law.stiffened(1.0 / pace.ease[i] if rule.loop else 1.0)
        found, m = pace.active[i], lanes.f.shape[0]
        along, across = scratch((found, m), np.float64), scratch((found, m), np.float64)
        system, change = scratch((found, found), np.float64), scratch(found, np.float64)
        self.eliminate(1, (along, across, system, change), i)
        error = pace.residue[i]
        for a in range(found):
            k, wall, multiplier = active.name[i, a, 0], float(active.name[i, a, 1]), active.multiplier[i, a]
            g0 = self._start(wall, touching.place(lanes.ra, k, i))
            g1 = _gap(self.walls, wall, touching.place(lanes.r1, k, i))
            # In State I the force jumps at g1 = 0 from 0 to lambda, which may be more than a step needs while links are
            # not met. The force is then the one that gives g1 = 0, as at a rigid wall.
            force = active.press[i, 3 * a] + g1 / system[a, a]
            if g0 == 0.0 and 0.0 <= force <= multiplier:
                error = max(error, abs(g1) / rule.room)
                change[a] += g1
                continue
            end = g1
            if g0 == 0.0 and multiplier > 0.0:
                end = max(g1, 0.0) if force > 0.0 else min(g1, 0.0)
            force, stiffness = law.force(multiplier, g0, end)
            missing = force + stiffness * (g1 - end) - active.press[i, 3 * a]
            # p + dp = F(g1 + dg), where dg follows from the corrections of ties and guides, and from -S dp.
            give = system[a, a] / (1.0 + stiffness * system[a, a])
            error = max(error, give * abs(missing) / rule.room)
            change[a] = missing + stiffness * change[a]
            for b in range(found):
                system[a, b] *= stiffness
            system[a, a] += 1.0
        solve_dense(system, change)
        for a in range(found):
            active.press[i, 3 * a] += change[a]
            for row in range(m):
                lanes.f[row, i] -= across[a, row] * change[a]
        before = pace.unsettled[i] if number > 0 else math.inf
        pace.unsettled[i] = error
        # The lag of D does work on springs: without this condition, a whipping chain loses 1e-9 of its energy, and
        # a pin that slides in its cavity as much.
        settled = error <= 1.0 and pace.lag[i] <= _SETTLED * _SETTLED * rule.room * rule.room
        # The round-off of a stiff V is more than that of a place.
        pace.last[i] = settled or (number >= _PATIENT and error <= _LARGER and error >= 0.5 * before)

    def gap_gradient(self: Any, wall, y, i):
        return _normal(self.walls, wall, y, y)

    # --- Uzawa's loop

    def begin_loop(self: Any):
        # Multipliers of links begin as in the steps before, multipliers of walls at 0: above the limit no step exists.
        ties, lanes, pace, active = self.ties, self.lanes, self.pace, self.active
        for i in range(pace.h.size):
            # A sweep shrinks errors by alpha h^2/m: the short steps that a cut leaves would take thousands of sweeps.
            pace.ease[i] = (pace.h[i] / self.rule.dt) * (pace.h[i] / self.rule.dt)
        for a in range(ties.springs - ties.relaxed, ties.springs):
            for i in range(pace.h.size):
                lanes.offset[a, i] = ties.give[a] * pace.ease[i] * lanes.multiplier[a, i]
        for i in range(pace.h.size):
            pace.turns[i], pace.loops[i], pace.loose[i] = 0, not pace.done[i], False
            for a in range(active.multiplier.shape[1]):
                active.multiplier[i, a] = 0.0

    def again(self: Any):
        soft, pace = self.rule.walls, self.pace
        live = 0
        for i in range(pace.h.size):
            if pace.loops[i] and pace.solved[i]:
                pace.turns[i] += 1
                pace.loose[i] = not self._stored(i) <= soft.tolerance
                pace.loops[i] = pace.loose[i] and pace.turns[i] < soft.sweeps
            pace.loops[i] = pace.loops[i] and pace.solved[i]
            pace.done[i] = not pace.loops[i]
            live += pace.loops[i]
            if pace.loops[i]:
                self._update(i)
        for i in range(pace.h.size):
            # D is kept in lanes that are done. (A test of `done` in `launch` takes a third longer in a free step.)
            pace.waits[i] = 1 if live > 0 and pace.done[i] else 0
        return live

    def _lengths(self: Any, a, i):
        """|y|^2 - l^2 of a tie at both ends of the stage."""
        ties, lanes = self.ties, self.lanes
        y1 = column(lanes.r1, 3 * ties.ends[a, 0], i) - column(lanes.r1, 3 * ties.ends[a, 1], i)
        return square(column(lanes.y0, 3 * a, i)) - ties.rest[a], square(y1) - ties.rest[a]

    @outlined
    def _stored(self: Any, i):
        """V of walls and links at the end of the step; a link stores alpha c^2/2 with c = (|y|^2 - l^2)/(2 l).

        Round-off of a length stores nothing.
        """
        ties, rule, law, active = self.ties, self.rule, self.rule.walls.law, self.active
        stored = 0.0
        for a in range(ties.springs - ties.relaxed, ties.springs):
            _before, after = self._lengths(a, i)
            if abs(after) > _ROUND_OFF * rule.noise * ties.rest[a]:
                stored += law.alpha * after * after / (8.0 * ties.rest[a])
        for a in range(self.pace.active[i]):
            g1 = _gap(
                self.walls, float(active.name[i, a, 1]), self.touching.place(self.lanes.r1, active.name[i, a, 0], i)
            )
            stored += law.stored_energy(g1) if g1 > NEAR * rule.room else 0.0
        return stored

    @outlined
    def _update(self: Any, i):
        """Update the multipliers of walls and links: lambda <- lambda + alpha (Phi0 + Phi1)/2."""
        ties, touching, lanes, law, active = self.ties, self.touching, self.lanes, self.rule.walls.law, self.active
        for a in range(ties.springs - ties.relaxed, ties.springs):
            before, after = self._lengths(a, i)
            lanes.offset[a, i] += before + after
        for a in range(self.pace.active[i]):
            k, wall = active.name[i, a, 0], float(active.name[i, a, 1])
            g0 = self._start(wall, touching.place(lanes.ra, k, i))
            g1 = _gap(self.walls, wall, touching.place(lanes.r1, k, i))
            mean = 0.5 * (law.constraint(g0) + law.constraint(g1))
            active.multiplier[i, a] += law.alpha / self.pace.ease[i] * mean

    # --- After a trial

    @outlined
    def judge(self: Any, i):
        touching, rule, pace = self.touching, self.rule, self.pace
        if rule.walls.is_cut:
            # The loop leaves a contact outside by the gap that stores the tolerance.
            return impact_time.look(self, i, 2.0 * max(rule.walls.deepest, ROOM * rule.room))
        pace.stuck[i] += 1
        if not pace.solved[i]:
            return impact_time.halve(self, i)
        for k in range(touching.plain.size):
            first, last = touching.span(k)
            for w in range(first, last):
                if self._is_outside(self.lanes.r1, k, w, i) and self._number(i, k, w) < 0:
                    pace.lasts[i] = True
                    return impact_time.AGAIN
        return impact_time.COMMIT

    @outlined
    def end(self: Any, state, i):
        # If steps are cut, a contact lasts as long as it pushes; else as long as its point is outside.
        lanes, pace, active = self.lanes, self.pace, self.active
        number, lasts = pace.body[i], False
        for a in range(pace.active[i]):
            k, wall = active.name[i, a, 0], active.name[i, a, 1]
            pushes = active.press[i, 3 * a] > 0.0
            state.impulse[wall, number] += active.impulse[i, a]
            if self.rule.walls.is_cut:
                lasts = lasts or pushes
            else:
                lasts = lasts or self._is_outside(lanes.r1, k, wall, i)
                if pushes and not self._is_outside(lanes.ra, k, wall, i):
                    state.count_impact(number, wall)
        pace.lasts[i] = lasts
        if not lasts:
            pace.active[i] = 0

    @outlined
    def strike(self: Any, state, i):
        # The next step is the step of the contact, from State I.
        name = scratch((MOST_CONTACTS, 2), np.int64)
        frame = scratch((MOST_CONTACTS, 3, 3), np.float64)
        for a in range(self.near(i, name, frame, True)):
            state.count_impact(self.pace.body[i], name[a, 1])
        self.pace.lasts[i] = True

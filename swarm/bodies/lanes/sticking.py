"""Contacts that stick or come to rest at walls that take energy: their velocities, and steps too short for forces.

A step that keeps the place of a contact reverses its rate, v1 = -v0, and likewise the rate of a link at rest: an error
of second order in the length of the step that no force of a later step can damp. So a step in which a contact sticks
ends with the velocities that its links and contacts permit.

The forces of a short step correct the round-off of places, which divided by h is a velocity: 1e-4 m/s in 1e-11 s, which
changes 1e-9 of the energy of a die. So no force acts in a step that conserves lengths and gaps to round-off without
forces.
"""

import math

import numpy as np

from ...kernel.arrays import scratch
from ...kernel.jit import outlined
from ...kernel.limits import ENERGY_OF_IMPACT
from ...kernel.vector import column, dot, norm, square
from .contacts import MOST_CONTACTS, direction, put_direction, put_frame, sweep
from .impact import SHORT, SWEEPS, body_impact, kinetic_of


def is_short(bodies, i):
    """Whether the step of a lane is a bounce on the way to rest."""
    return bodies.pace.step[i] < SHORT * bodies.rule.dt


@outlined
def leave_out(bodies, i):
    """Leave out the forces of a short step that conserves lengths and gaps without them; return whether it does."""
    ties, rule, lanes, pace = bodies.ties, bodies.rule, bodies.lanes, bodies.pace
    if not is_short(bodies, i):
        return False
    for a in range(ties.links):
        y = column(lanes.p, 3 * ties.ends[a, 0], i) - column(lanes.p, 3 * ties.ends[a, 1], i)
        # The change of the length, not its error: to correct the error of steps before takes a force too.
        if not abs(square(y) - square(column(lanes.y0, 3 * a, i))) <= rule.noise * ties.rest[a]:
            return False
    active = bodies.active
    for a in range(pace.active[i]):
        k, wall = active.name[i, a, 0], float(active.name[i, a, 1])
        before = bodies.walls_between(i).distance(wall, bodies.spot(lanes.ra, k, i))
        gap = bodies.walls_after(i).distance(wall, bodies.spot(lanes.p, k, i))
        # The distance is negative behind a wall that ends, as the way there goes through the wall.
        behind = bodies.passed(k, bodies.touching.place(lanes.p, k, i), rule.room + max(before, 0.0), i).gap
        if not max(gap, behind) - before <= rule.room:
            return False
    for a in range(ties.links):
        lanes.multiplier[a, i] = 0.0
    for a in range(3 * pace.active[i]):
        active.press[i, a], active.before[i, a] = 0.0, math.nan
    return True


@outlined
def stop(bodies, state, i):
    """End a step in which a contact sticks, or a short dissipative step, with velocities that ties and contacts permit.

    The impulses of the step are corrected within the cones of friction, and the energy lost is booked.
    """
    ties, touching, lanes, active = bodies.ties, bodies.touching, bodies.lanes, bodies.active
    number, found = bodies.pace.body[i], bodies.pace.active[i]
    if not (_sticks(bodies, i) or (is_short(bodies, i) and touching.dissipate(active.name[i], found))):
        return
    state.dissipated[number] += _over_round_off(bodies, i)
    m, wide = ties.links + touching.guides, touching.width(active.name[i], found)
    rows = wide * found
    name, frame = scratch((MOST_CONTACTS, 2), np.int64), scratch((MOST_CONTACTS, 3, 3), np.float64)
    rate, p, change = scratch(rows, np.float64), scratch(rows, np.float64), scratch(rows, np.float64)
    strain, against = scratch(m, np.float64), scratch(m, np.float64)
    for a in range(found):
        k, wall, press = active.name[i, a, 0], active.name[i, a, 1], active.press[i, 3 * a]
        name[a, 0], name[a, 1] = k, wall
        n = bodies.walls_now(i).unit_normal(float(wall), bodies.spot(lanes.r, k, i))
        put_direction(frame, a, 0, n)
        if wide > 1:
            t = direction(active.frame[i], a, 1)
            t = t - dot(t, n) * n
            put_frame(frame, a, n, t / norm(t))
        if press > 0.0 and active.impulse[i, a] > 0.0:
            for d in range(wide):
                p[wide * a + d] = active.impulse[i, a] * (active.press[i, 3 * a + d] / press)
    blow = body_impact(bodies, name, frame, (wide, found), i)
    lost = blow.strain(strain, against, i)
    for a in range(rows):
        rate[a] = blow.unstrained_rate(a, strain, i)
    sweep(touching, (name, p, wide, wide), blow.schur, rate, change, SWEEPS)
    lost = blow.taken(lost, rate, change)
    state.dissipated[number] += lost
    state.work[number] += blow.push(state, change, against, lost, i)


def _over_round_off(bodies, i):
    """The energy that forces have taken over the round-off of places in a step; 0 if more is missing, an error.

    A short step that stops a contact has large forces: 10^5 N for a die that weighs 0.05 N, in 5e-12 s.
    """
    ties, lanes, pace, active = bodies.ties, bodies.lanes, bodies.pace, bodies.active
    if bodies.rule.stages.size > 1 or ties.links < ties.ends.shape[0] or max(ties.led) >= 0:
        return 0.0
    lost, most = pace.work[i] - active.lost[i] + kinetic_of(ties, lanes.va, i) - kinetic_of(ties, lanes.v, i), 0.0
    for p in range(ties.mass.shape[0]):
        mass = 0.0
        for q in range(ties.mass.shape[0]):
            mass += ties.mass[p, q]
        for x in range(3):
            lost += mass * bodies.rule.gravity[x] * (lanes.r[3 * p + x, i] - lanes.ra[3 * p + x, i])
    for a in range(pace.active[i]):
        most += active.press[i, 3 * a] * bodies.rule.room
    return lost if abs(lost) <= most else 0.0


def _sticks(bodies, i):
    """Whether a contact is held along its wall by less than the limit of friction."""
    active, sticks = bodies.active, False
    for a in range(bodies.pace.active[i]):
        most = bodies.touching.friction[active.name[i, a, 1]] * active.press[i, 3 * a]
        along = math.hypot(active.press[i, 3 * a + 1], active.press[i, 3 * a + 2])
        sticks = sticks or along < (1.0 - ENERGY_OF_IMPACT) * most
    return sticks

"""Counters of bodies. They read the way of each centre of mass in a step, and change no bit of it."""

import numpy as np

from ...kernel.jit import outlined
from ...kernel.vector import ZERO, column, dot, put
from ...lanes.watching.crossings import Flown, ParticleMoment
from ...lanes.watching.watchers import Followed
from ...surfaces.periodic.period import has_left, into, moved_into
from .impact_time import COMMIT, STRIKE


def centre(ties, r, i):
    """The centre of mass of a lane, or its velocity if r has velocities."""
    total, mass = ZERO, 0.0
    for p in range(ties.mass.shape[0]):
        for q in range(ties.mass.shape[0]):
            m = ties.mass[p, q]
            if m != 0.0:
                mass += m
                total = total + m * column(r, 3 * q, i)
    return total / mass


def is_free(contacts, i):
    """Whether only gravity has acted on the centre of mass of a lane in its step, so that its way is a parabola."""
    touching, ties = contacts.touching, contacts.ties
    return touching.guides == 0 and min(ties.is_free) and contacts.pace.active[i] == 0


def count_steps(contacts, state):
    """Count the crossings of the centres of all lanes in the steps about to be taken.

    A free flight is counted exactly. A step in which walls, guides or anchors act is counted by its ends.
    """
    pace = contacts.pace
    for i in range(pace.body.size):
        if pace.body[i] >= 0 and (pace.action[i] == COMMIT or pace.action[i] == STRIKE):
            _count_step(contacts, state, i)


@outlined
def _count_step(contacts, state, i):
    ties, lanes, pace, counters = contacts.ties, contacts.lanes, contacts.pace, state.watchers.counters
    number, step, remaining = pace.body[i], pace.step[i], pace.remaining[i]
    followed, period = Followed(state, state.watchers.log), contacts.rule.period
    r, v, end = centre(ties, lanes.r, i), centre(ties, lanes.v, i), centre(ties, lanes.r1, i)
    flown = Flown(r, v, step, remaining, end, ZERO)
    if not is_free(contacts, i):
        before = ParticleMoment(r, v, remaining)
        after = ParticleMoment(end, centre(ties, lanes.v1, i), remaining - step)
        counters.count_step(followed, number, before, after)
        if has_left(period, end):
            counters.come_back(followed, number, before, end, after._replace(r=into(period, end).r))
    elif period is None:
        counters.look_at(counters.gravity, followed, number, flown)
    else:
        counters.look_at_cells(period, counters.gravity, followed, number, flown)


@outlined
def come_into_cell(contacts, state, i):
    """Wrap a lane with a centre of mass outside the cell into it; its energy becomes that of the new place."""
    ties, lanes, period, number = contacts.ties, contacts.lanes, contacts.rule.period, contacts.pace.body[i]
    there = centre(ties, lanes.r, i)
    if not has_left(period, there):
        return
    n = into(period, there).images
    for p in range(lanes.r.shape[0] // 3):
        put(lanes.r, 3 * p, i, moved_into(period, column(lanes.r, 3 * p, i), there))
    for axis, images in enumerate(n):
        state.image[axis, number] += np.int64(images)
    if period.fall is not None:
        state.energy[number] -= state.mass[number] * dot(n, period.fall)

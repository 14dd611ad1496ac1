"""Counters of bodies: they get the way of each centre of mass in a step, and change no bit of it."""

from ...kernel.jit import outlined
from ...kernel.vector import ZERO, column
from ...lanes.watching.crossings import Flown, ParticleMoment
from ...lanes.watching.watchers import Followed
from .impact_time import COMMIT, STRIKE


def centre(ties, r, i):
    """The centre of mass of a lane, or with velocities its velocity."""
    total, mass = ZERO, 0.0
    for p in range(ties.mass.shape[0]):
        for q in range(ties.mass.shape[0]):
            m = ties.mass[p, q]
            if m != 0.0:
                mass += m
                total = total + m * column(r, 3 * q, i)
    return total / mass


def is_free(contacts, i):
    """Whether nothing but gravity has acted on the centre of mass of a lane in its step: it falls in a parabola."""
    touching, ties = contacts.touching, contacts.ties
    return touching.guides == 0 and min(ties.is_free) and contacts.pace.active[i] == 0


def count_steps(contacts, state):
    """Count what the centres of all lanes cross in the steps that are about to be taken.

    A free flight is exact; where walls, guides or anchors act in the step, it is counted by its ends.
    """
    pace = contacts.pace
    for i in range(pace.body.size):
        if pace.body[i] >= 0 and (pace.action[i] == COMMIT or pace.action[i] == STRIKE):
            _count_step(contacts, state, i)


@outlined
def _count_step(contacts, state, i):
    ties, lanes, pace, counters = contacts.ties, contacts.lanes, contacts.pace, state.watchers.counters
    number, step, remaining = pace.body[i], pace.step[i], pace.remaining[i]
    followed = Followed(state, state.watchers.log)
    r, v = centre(ties, lanes.r, i), centre(ties, lanes.v, i)
    end = centre(ties, lanes.r1, i)
    if is_free(contacts, i):
        counters.look_at(counters.gravity, followed, number, Flown(r, v, step, remaining, end, ZERO))
    else:
        after = ParticleMoment(end, centre(ties, lanes.v1, i), remaining - step)
        counters.count_step(followed, number, ParticleMoment(r, v, remaining), after)

"""Impacts of bodies on walls that send them off: with a temperature, or by `laws` of a surface.

An impulse P at a contact point changes its velocity by K P, where K is the (3, 3) inverse mass of the body there. With
the normal n, m = 1/(n K n), and A = m (K_tt - m K_tn K_nt) across it, the velocity u relative to the wall is mapped to
    w_n = u_n,   w_t = A^(-1/2) (u_t - m K_tn u_n),
the velocity of a particle of mass m with the energy m w^2/2 = u K^-1 u/2, the part that an impulse there can change. A
law acts on w. So laws have the same meaning as for particles: a law that conserves the speed conserves the energy of
the body, and a law along the normal gives an impulse along it. A wall with a temperature preserves the canonical
distribution of the body, in which K k_B T is the covariance of u, as no other part of it changes.
"""

import math

import numpy as np

from ...contact.wall_impact import Arriving, by_law
from ...kernel.arrays import scratch
from ...kernel.jit import outlined
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import ZERO, column, dot, square
from ...state import absorb
from .contacts import MOST_CONTACTS, direction, put_direction
from .impact import body_impact, chatters

# The ratio of the two inverse masses across a normal below which the smaller one counts as 0.
_HELD = 1e-12
# The squared speed into a wall that is round-off, relative to that of the fastest point.
_ROUND_OFF = (16.0 * EPSILON) ** 2
# The speed into a wall of a resting contact [m/s].
_AT_REST = 1e-300


class Across(Record):
    """The matrix A^(-1/2), (xx, xy, yy): 0 in directions in which the body cannot move."""

    xx: float
    xy: float
    yy: float

    def of(self, x, y):
        """The product of the matrix with a vector."""
        return self.xx * x + self.xy * y, self.xy * x + self.yy * y


def across_of(schur, mass):
    """Return the `Across` of a contact, from its inverse mass K in the directions of the normal and two tangents."""
    xx = mass * (schur[1, 1] - mass * schur[0, 1] * schur[0, 1])
    xy = mass * (schur[1, 2] - mass * schur[0, 1] * schur[0, 2])
    yy = mass * (schur[2, 2] - mass * schur[0, 2] * schur[0, 2])
    trace, det = xx + yy, xx * yy - xy * xy
    if trace <= _HELD:
        return Across(0.0, 0.0, 0.0)
    if det <= _HELD * trace * trace:
        one = 1.0 / (trace * math.sqrt(trace))
        return Across(one * xx, one * xy, one * yy)
    # A^(1/2) = (A + s)/t by Cayley and Hamilton, and its inverse.
    s = math.sqrt(det)
    one = 1.0 / (s * math.sqrt(trace + 2.0 * s))
    return Across(one * (yy + s), -one * xy, one * (xx + s))


@outlined
def send_off(bodies, state, name, frame, found, i):
    """Send a body off by the law of the first of these contacts at which a law acts; return whether one does."""
    a, acts = 0, False
    while a < found and not acts:
        acts = _by_law(bodies, state, name, frame, (a, False), i)
        a += 1
    return acts


@outlined
def leave_rest(bodies, state, i):
    """Send a body off that rests on a wall with a temperature; return the number of blows, 1 or 0."""
    name, frame = scratch((MOST_CONTACTS, 2), np.int64), scratch((MOST_CONTACTS, 3, 3), np.float64)
    found = bodies.near(i, name, frame, False)
    for a in range(found):
        is_hot = bodies.touching.laws.thermal_of(float(name[a, 1])).is_hot()
        if is_hot and _by_law(bodies, state, name, frame, (a, True), i):
            return 1
    return 0


@outlined
def _by_law(bodies, state, name, frame, contact, i):
    """Send a body off by a law at a `contact` (its number, whether it rests); return whether a law acts."""
    ties, touching, (a, rests) = bodies.ties, bodies.touching, contact
    m, number, w = ties.links + touching.guides, bodies.pace.body[i], name[a, 1]
    one, axes = scratch((1, 2), np.int64), scratch((1, 3, 3), np.float64)
    one[0, 0], one[0, 1] = name[a, 0], w
    for d in range(3):
        put_direction(axes, 0, d, direction(frame, a, d))
    blow = body_impact(bodies, one, axes, (3, 1), i)
    strain, against = scratch(m, np.float64), scratch(m, np.float64)
    rate, p = scratch(3, np.float64), scratch(3, np.float64)
    lost = blow.strain(strain, against, i)
    for d in range(3):
        rate[d] = blow.unstrained_rate(d, strain, i)
    if not rests and rate[0] * rate[0] <= _ROUND_OFF * _fastest(bodies, i):
        return False
    mass = 1.0 / blow.schur[0, 0]
    # Every event has another number, as the body has a blow, or makes a step, between two events.
    event = MOST_CONTACTS * (state.impacts[number] + state.steps[number]) + a
    random = touching.seeding.of_impact(number, event, touching.laws)
    happens, sent = _sent(blow, state, rate, p, (mass, rests), random, i)
    if not happens:
        return False
    row = bodies.walls.row(float(w))
    arrives = touching.place(bodies.lanes.v, name[a, 0], i)
    if state.absorbed_time is not None and sent.wait == math.inf:
        blow.tell(state, 0, arrives, mass * rate[0], i)
        state.impulse[row, number] += mass * rate[0]
        absorb(state, number, w, bodies.rule.end - bodies.pace.remaining[i])
        bodies.pace.remaining[i] = 0.0
        return True
    if sent.keeps:
        # As at an elastic wall, links keep the rates that steps have left.
        lost = 0.0
        for row_of_tie in range(m):
            against[row_of_tie] = 0.0
    lost = blow.taken(lost, rate, p)
    work = blow.push(state, p, against, lost, i)
    blow.tell(state, 0, arrives, p[0], i)
    state.impulse[row, number] += p[0]
    _book(state, touching.laws, (row, number), lost, work, 0.5 * mass * sent.lost)
    return True


def _sent(blow, state, rate, p, at, random, i):
    """Return whether a law acts, and its `Bounce`; set p to the impulses of the wall.

    `at` is the mass of the contact, and whether it rests.
    """
    bodies, schur, (mass, rests) = blow.bodies, blow.schur, at
    touching, walls, w = bodies.touching, bodies.walls_now(i), float(blow.name[0, 1])
    root = across_of(schur, mass)
    first, second = root.of(rate[1] - mass * schur[0, 1] * rate[0], rate[2] - mass * schur[0, 2] * rate[0])
    n, s, t = blow.direction(0), blow.direction(1), blow.direction(2)
    c, into = bodies.spot(bodies.lanes.r, blow.name[0, 0], i), _AT_REST if rests else rate[0]
    carried = walls.velocity(w, c) if bodies.walls_move() else ZERO
    v = into * n + first * s + second * t + carried
    slow = math.inf if chatters(touching, state, bodies.pace.body[i]) else 0.0
    happens, sent = by_law(touching.laws, walls, None, w, Arriving(c, v, square(v), mass, slow), random)
    after = sent.v - carried
    pushed, pulled = root.of(first - dot(after, s), second - dot(after, t))
    p[1], p[2] = mass * pushed, mass * pulled
    p[0] = mass * (rate[0] - dot(after, n) - schur[0, 1] * p[1] - schur[0, 2] * p[2])
    return happens, sent


def _fastest(bodies, i):
    """The squared speed of the fastest point of a body."""
    fastest = 0.0
    for q in range(bodies.lanes.v.shape[0] // 3):
        fastest = max(fastest, square(column(bodies.lanes.v, 3 * q, i)))
    return fastest


def _book(state, laws, place, lost, work, dissipated):
    """Book the energy `lost` to a law, a part of which is dissipated and the rest heat, and the work of walls."""
    row, number = place
    taken = lost if laws.dissipate_all else dissipated
    state.dissipated[number] += taken
    if state.heat is not None:
        state.heat[row, number] += taken - lost
        work += taken - lost
    state.work[number] += work

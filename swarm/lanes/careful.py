"""Advance particles in a cusp or held by several walls, in short steps of each, until it flies, rests or arrives."""

import numpy as np

from ..contact import crossing, events, touching
from ..contact.absence import open_wall_at
from ..contact.events import ARRIVED, CAREFUL, FLYING
from ..kernel.arrays import scratch
from ..kernel.gravity import potential
from ..kernel.jit import long_kernel, outlined
from ..kernel.vector import ZERO, column, put, square
from ..surfaces.in_motion.moving import Carried
from .accounts import book, lose
from .carried import NOT_CARRIED, carry
from .escape import let_out
from .lane_arrays import booked, speed2_scale
from .one_by_one import one_by_one
from .periodic import return_particle
from .watching.crossings import ParticleMoment

# The most short steps of a particle in a frame; they take seconds.
_MOST_SHORT_STEPS = 1e7


@long_kernel
def careful_block(method, walls, gravity, share):
    """Make a short step of each particle that several walls hold; return (status, particle, drawn)."""
    return one_by_one(CAREFUL, _take_care, (method, walls, gravity), share)


def _take_care(method, walls, gravity, share, i):
    """Make a short step of particle i; return whether it may take another one."""
    state, contacts, counters = share.state, share.state.contacts, share.counters
    left = contacts.remaining[i]
    before = _moment(state, i, left if left > 0.0 else share.span)
    _step(method, walls, gravity, share, i)
    end = _moment(state, i, contacts.remaining[i])
    if counters is not None:
        counters.count_step(share, i, before, end)
    if state.period is not None:
        return_particle(state.period, walls, state, i)
    r = column(state.position, 0, i)
    if counters is not None and state.period is not None and square(r - end.r) > 0.0:
        counters.come_back(share, i, before, end.r, end._replace(r=r))
    closed = isinstance(walls, Carried) and _have_closed(walls, method, r, contacts.remaining[i])
    return not closed and not contacts.short_steps[i] > _MOST_SHORT_STEPS


def _moment(state, i, remaining):
    return ParticleMoment(column(state.position, 0, i), column(state.velocity, 0, i), remaining)


@outlined
def _rest(method, walls, gravity, share, i, p, active):
    """Let particle i rest."""
    state, contacts = share.state, share.state.contacts
    loses = method.laws.change_energy
    for s in range(active.shape[1]):
        taken = active[1, s] if loses else 0.0
        contacts.load[s, i] = active[0, s]
        state.impulse[s, i] += (active[0, s] * p.remaining + taken) * state.mass[i]
    if loses:
        # Removes the round-off that the walls have added, as nothing else will from now on.
        r = touching.inside(walls, p.r)
        put(state.position, 0, i, r)
        lose(state, i, p.twice, 2.0 * potential(gravity, r))
        put(state.velocity, 0, i, ZERO)
    contacts.sliding[i] += p.remaining
    share.note_stay(i, p.remaining)
    contacts.remaining[i], contacts.keep[i] = 0.0, 0.0
    contacts.phase[i] = ARRIVED
    share.hand_over(i, ARRIVED)


@outlined
def _step(method, walls, gravity, share, i):
    state, contacts = share.state, share.state.contacts
    impulses = scratch((booked(walls), 1), np.float64)
    r, v, remaining = column(state.position, 0, i), column(state.velocity, 0, i), contacts.remaining[i]
    # A particle that walls carry begins the frame without a remaining time.
    remaining = remaining if remaining > 0.0 else share.span
    now = walls.at(remaining)
    if state.openings is not None:
        wall = open_wall_at(state.openings, method, now, gravity, (r, v), crossing.near(method, r))
        if wall >= 0.0:
            let_out(now, gravity, share, i, wall, r, v, remaining)
            return
    p = events.Particle(r, v, remaining, 2.0 * state.energy[i], speed2_scale(state, i))
    active = scratch((2, walls.length()), np.float64)
    if method.laws.moving is None and events.settles(method, now, gravity, p, active):
        _rest(method, now, gravity, share, i, p, active)
        return
    # Openings and periodic cells need short steps, which look at the places on the way.
    if method.laws.moving is not None and state.openings is None and state.period is None:
        phase = carry(method, walls, gravity, state, i, p)
        if phase != NOT_CARRIED:
            contacts.phase[i] = CAREFUL if phase == ARRIVED else FLYING
            contacts.step[i], contacts.keep[i] = 0.0, 0.0
            contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
            share.hand_over(i, phase)
            return
    contacts.short_steps[i] += 1.0
    if state.openings is not None and square(v) > 0.0:
        # The short step looks at the places on the way.
        p = p._replace(remaining=min(remaining, 2.0 * events.GRAZING * method.size / np.sqrt(events.own_speed2(p))))
    end = events.careful(method, walls, gravity, contacts.met[i], p, impulses)
    for s in range(impulses.shape[0]):
        state.impulse[s, i] += impulses[s, 0] * state.mass[i]
    put(state.position, 0, i, end.r)
    put(state.velocity, 0, i, end.v)
    given_work = 0.0
    for s in range(walls.length(), impulses.shape[0]):
        given_work += 2.0 * impulses[s, 0]
    change = p.twice, end.twice_energy
    book(walls, state, i, contacts.met[i], change, given_work, method.laws.loses, given_work)
    contacts.sliding[i] += end.used
    share.note_stay(i, end.used)
    contacts.remaining[i] = max(remaining - end.used, 0.0)
    phase = FLYING if contacts.remaining[i] > 0.0 else ARRIVED
    contacts.phase[i], contacts.step[i], contacts.keep[i] = FLYING, 0.0, 0.0
    share.hand_over(i, phase)


@outlined
def _have_closed(walls, method, r, remaining):
    """Whether moving walls leave no place for a particle when `remaining` is left of the frame [s]."""
    now, deepest = walls.at(remaining), 0.0
    number = now.numbers_near(r)
    for i in range(number.size):
        deepest = max(deepest, now.distance(number[i], r))
    return deepest > events.TOUCH * method.size

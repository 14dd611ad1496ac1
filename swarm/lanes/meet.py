"""Particles at a wall where their contact lasts, or that they meet while they slide: what becomes of them, one by one."""

import numpy as np

from ..contact import events
from ..contact.events import ARRIVED, CAREFUL, EVENT, FLYING
from ..contact.sliding import One, Two
from ..kernel.jit import inlined, kernel, outlined, scratch
from ..kernel.vector import column, put
from ..status import Status
from ..surfaces import fold as walls
from .arrays import following_particle, speed2_scale

# A particle that meets walls so often and does not move on is left to the careful way, and then given up.
_OFTEN, _MOST = 64.0, 1e6
# It has moved on after this part of a crossing.
_MOVED = 1e-9


@kernel
def meet_block(method, chain, gravity, share):
    """Decide for the particles that a thread draws: (status, particle, drawn)."""
    following, stop, drawn = 0, 0, 0
    while True:
        following, stop, drawn = following_particle(share, EVENT, following, stop, drawn)
        if following == stop:
            return Status.DONE.value, 0, drawn
        if not _decide(method, chain, gravity, share, following):
            return Status.STALLED.value, following, drawn
        following += 1


@outlined
def _decide(method, chain, gravity, share, i):
    """What becomes of particle i; whether it moves on."""
    state, contacts = share.state, share.state.contacts
    r, v, left = column(state.position, 0, i), column(state.velocity, 0, i), contacts.left[i]
    p = events.Particle(r, v, left, 2.0 * state.energy[i], speed2_scale(state, i))
    moved = contacts.events[0, i] - left
    again = 0.0 if abs(moved) > _MOVED * method.size / np.sqrt(p.scale2) else contacts.events[1, i] + 1.0
    contacts.events[0, i], contacts.events[1, i] = left, again
    first, second, wall = contacts.walls[0, i], contacts.walls[1, i], contacts.met[i]
    if again > _OFTEN:
        found = events.Next(CAREFUL, v, 0.0, p.twice, wall, -1.0, 0.0, 0.0)
    elif first < 0.0:
        found = events.enter(method, chain, gravity, wall, p)
    elif second < 0.0:
        found = events.meet(method, One(first), chain, gravity, wall, p)
    else:
        found = events.meet(method, Two(first, second), chain, gravity, wall, p)
    if found.impulse > 0.0:
        state.impulse[int(wall), i] += found.impulse * state.mass[i]
        state.impacts[i] += 1
    _lose(state, i, p.twice, found.twice)
    contacts.sliding[i] -= min(found.wait, left)
    phase, v = found.phase, found.v
    if phase == FLYING:
        v = events.off_the_wall(chain, wall, r, v)
    slides = phase != FLYING
    put(state.velocity, 0, i, v)
    contacts.keep[i] = found.keep
    # The step of before is a good first one where the walls are the same.
    same = found.wall == first and found.other == second
    contacts.step[i] = contacts.step[i] if same else 0.0
    contacts.walls[0, i] = found.wall if slides else -1.0
    contacts.walls[1, i] = found.other if slides else -1.0
    share.phase[i] = phase
    share.pending[phase] += 1
    return again < _MOST


@inlined
def _lose(state, i, before, after):
    """Book what is left of twice the energy per mass."""
    if before != after:
        state.energy[i] = 0.5 * after
        state.dissipated[i] += 0.5 * (before - after) * state.mass[i]


@kernel
def careful_block(method, chain, gravity, share):
    """A short step of each particle that several walls hold, of those that a thread draws: (status, particle, drawn)."""
    following, stop, drawn = 0, 0, 0
    while True:
        following, stop, drawn = following_particle(share, CAREFUL, following, stop, drawn)
        if following == stop:
            return Status.DONE.value, 0, drawn
        _step(method, chain, gravity, share, following)
        following += 1


@outlined
def _step(method, chain, gravity, share, i):
    state, contacts = share.state, share.state.contacts
    given = scratch((walls.length(chain), 1), np.float64)
    r, v, left = column(state.position, 0, i), column(state.velocity, 0, i), contacts.left[i]
    p = events.Particle(r, v, left, 2.0 * state.energy[i], speed2_scale(state, i))
    end = events.careful(method, chain, gravity, contacts.met[i], p, given)
    for s in range(given.shape[0]):
        state.impulse[s, i] += given[s, 0] * state.mass[i]
    put(state.position, 0, i, end.r)
    put(state.velocity, 0, i, end.v)
    _lose(state, i, p.twice, end.twice_energy)
    contacts.sliding[i] += end.used
    contacts.left[i] = max(left - end.used, 0.0)
    phase = FLYING if contacts.left[i] > 0.0 else ARRIVED
    contacts.walls[0, i], contacts.walls[1, i], contacts.step[i], contacts.keep[i] = -1.0, -1.0, 0.0, 0.0
    if phase == ARRIVED:
        contacts.walls[0, i] = contacts.met[i]
    share.phase[i] = phase
    share.pending[phase] += 1

"""Particles at a wall where their contact lasts, or that they meet while they slide: what becomes of each."""

import math

import numpy as np

from ..contact import crossing, events, touching
from ..contact.doorways import leads_on, lets_through, through
from ..contact.events import ARRIVED, CAREFUL, EDGE, EVENT, FLYING, HELD
from ..contact.hold import One, Two, drift
from ..contact.passing import hit_wall, open_wall_at
from ..contact.reflection import given, wall_velocity
from ..contact.sending import Arriving, send
from ..kernel.arrays import scratch
from ..kernel.gravity import potential
from ..kernel.jit import long_kernel, outlined, select
from ..kernel.random import Stream
from ..kernel.vector import ZERO, column, norm, put, square
from ..status import Status
from ..surfaces.moving import Carried
from . import log as impact_log
from .accounts import book, book_sent, book_step, book_work, lose
from .arrays import booked, speed2_scale
from .carried import NOT_CARRIED, carry, is_carried
from .crossings import Moment
from .escape import absorb, escape
from .periodic import return_particle
from .table import LANES

# A particle that meets walls so often and does not move on is left to the careful way, and then given up.
_OFTEN, _MOST = 64.0, 1e6
# Short steps of a particle in a frame: seconds.
_MOST_SHORT_STEPS = 1e7
# It has moved on after this part of a crossing.
_MOVED = 1e-9


@long_kernel
def meet_block(method, walls, gravity, share):
    """Decide for the particles that a thread draws: (status, particle, drawn); LOG_FULL: call it again."""
    return _one_by_one(EVENT, _decide, (method, walls, gravity), share)


@long_kernel
def careful_block(method, walls, gravity, share):
    """A short step of each particle that several walls hold: (status, particle, drawn)."""
    return _one_by_one(CAREFUL, _take_care, (method, walls, gravity), share)


def _one_by_one(phase, advance, scene, share):
    """Advance the particles in a phase that a thread draws, as long as they move on."""
    place, _live, done = impact_log.gone_on(share.log)
    while True:
        place = share.following(phase, place)
        if place.is_end():
            return Status.DONE.value, 0, place.drawn
        if done // LANES >= share.halt[0]:
            return Status.INTERRUPTED.value, 0, place.drawn
        if impact_log.is_full(share.log):
            impact_log.keep_going(share.log, place, 0, done)
            return Status.LOG_FULL.value, 0, place.drawn
        if not advance(*scene, share, place.i):
            is_wrong = math.isnan(share.state.contacts.keep[place.i])
            return select(is_wrong, Status.SENT_WRONG.value, Status.STALLED.value), place.i, place.drawn
        place, done = place.after(), done + 1


@outlined
def _decide(method, walls, gravity, share, i):
    """Decide whether particle i goes on along its walls, or flies; whether it moves on."""
    state, contacts = share.state, share.state.contacts
    r, v, remaining = column(state.position, 0, i), column(state.velocity, 0, i), contacts.remaining[i]
    carried, walls = walls, walls.at(remaining)
    if state.openings is not None and _let_out(method, walls, gravity, share, i, r, v, remaining):
        return True
    p = events.Particle(r, v, remaining, 2.0 * state.energy[i], speed2_scale(state, i))
    moved = contacts.events[0, i] - remaining
    again = 0.0 if abs(moved) > _MOVED * method.size / np.sqrt(p.scale2) else contacts.events[1, i] + 1.0
    contacts.events[0, i], contacts.events[1, i] = remaining, again
    first, second, wall = contacts.walls[0, i], contacts.walls[1, i], contacts.met[i]
    if method.laws.send_off and first >= 0.0 and _send_off(method, carried, gravity, share, i):
        return not math.isnan(contacts.keep[i])
    moving = method.laws.moving
    if moving is not None:
        settles = is_carried(method, carried, gravity, p)
    else:
        settles = events.settles(method, walls, gravity, p, scratch((2, walls.length()), np.float64))
    if again > _OFTEN or settles:
        found = events.Next(CAREFUL, v, 0.0, p.twice, wall, -1.0, 0.0, 0.0)
    elif first < 0.0:
        found = events.enter(method, walls, gravity, wall, p)
    elif second < 0.0:
        found = events.meet(method, One(first), walls, gravity, wall, p)
    else:
        found = events.meet(method, Two(first, second), walls, gravity, wall, p)
    state.impulse[walls.row(wall), i] += found.impulse * state.mass[i]
    if found.impulse > events.NO_IMPACT * np.sqrt(events.own_speed2(p)):
        state.impacts[i] += 1
        share.note_impact(method, carried, i, impact_log.Struck(r, v, found.v, wall, remaining, found.impulse))
    if found.phase in (HELD, EDGE) and found.keep == 0.0:
        _spare(moving, walls, state, i, found, wall)
    u = wall_velocity(moving, walls, wall, r)
    book(carried, state, i, wall, (p.twice, found.twice), given(u, found.v - v), method.laws.loses)
    hops = min(found.wait, remaining)
    contacts.sliding[i] -= hops
    share.note_hops(found.wall, hops)
    phase, v = found.phase, found.v
    if phase == FLYING:
        v = events.off_the_wall(walls, wall, r, v, u)
    slides = phase != FLYING
    _settle(walls, state, i, found)
    put(state.velocity, 0, i, v)
    contacts.keep[i] = found.keep
    # The step of before is a good first one where the walls are the same.
    same = found.wall == first and found.other == second
    contacts.step[i] = contacts.step[i] if same else 0.0
    contacts.walls[0, i] = found.wall if slides else -1.0
    contacts.walls[1, i] = found.other if slides else -1.0
    contacts.phase[i] = phase if phase in (HELD, EDGE) else FLYING
    share.hand_over(i, phase)
    return again < _MOST


def _settle(walls, state, i, found):
    """A particle that begins to slide, on its wall again: where rooms touch what meets one is put inside of it."""
    if walls.inset is not None and (found.phase == HELD or found.phase == EDGE):
        put(state.position, 0, i, walls.project(found.wall, column(state.position, 0, i)))


@outlined
def _let_out(method, walls, gravity, share, i, r, v, remaining):
    """Whether particle i has escaped, since the wall that it has met is open there."""
    openings, met, near = share.state.openings, share.state.contacts.met, crossing.near(method, r)
    # Where this one is open, a closed one at the same place.
    met[i] = hit_wall(openings, method, walls, (r, v), met[i], near)
    if not lets_through(openings, walls, met[i], r, near):
        return False
    if leads_on(walls, met[i], r):
        _go_through(walls, gravity, share, i, met[i], r, v)
    else:
        _leave(share, i, met[i], r, v, remaining)
    return True


@outlined
def _go_through(walls, gravity, share, i, wall, r, v):
    """Particle i flies into the room on the other side of a wall, with the speed that it has kept across its walls."""
    state, contacts = share.state, share.state.contacts
    first, second, keep = contacts.walls[0, i], contacts.walls[1, i], contacts.keep[i]
    if keep > 0.0 and first >= 0.0:
        n = walls.unit_normal(first, r)
        n = n + walls.unit_normal(second, r) if second >= 0.0 else n
        v = v - (keep / norm(n)) * n
    r, v = through(walls, gravity, wall, (r, v))
    put(state.position, 0, i, r)
    put(state.velocity, 0, i, v)
    contacts.keep[i], contacts.step[i] = 0.0, 0.0
    contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
    contacts.phase[i] = FLYING
    share.hand_over(i, FLYING)


@outlined
def _leave(share, i, wall, r, v, remaining):
    """Particle i has escaped through a wall."""
    escape(share, i, wall, r, v, remaining)
    _end_frame(share, i)


def _end_frame(share, i):
    """Nothing is left of the frame of particle i, which no wall holds."""
    contacts = share.state.contacts
    contacts.remaining[i], contacts.keep[i] = 0.0, 0.0
    contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
    contacts.phase[i] = FLYING
    share.hand_over(i, ARRIVED)


@outlined
def _send_off(method, walls, gravity, share, i):
    """Whether a law of the wall that a sliding particle meets sends it off: then it flies, or is absorbed."""
    state, contacts, laws = share.state, share.state.contacts, method.laws
    wall, r, v = contacts.met[i], column(state.position, 0, i), column(state.velocity, 0, i)
    remaining = contacts.remaining[i]
    now, before, fall = walls.at(remaining), 2.0 * state.energy[i], 2.0 * potential(gravity, r)
    random = Stream(share.seed, share.first + i, state.impacts[i], 0, laws.across)
    # What slides along another wall meets it without end: the surface's restitution and an edge are for slow impacts.
    slow = events.GRAZING * np.sqrt(max(speed2_scale(state, i), square(v)))
    sent = send(laws, now, wall, Arriving(r, v, before - fall, slow, state.mass[i]), random)
    if not sent.happens:
        return False
    if laws.own is not None and math.isnan(sent.v.x):
        # Who asks whether it goes on finds it.
        contacts.keep[i] = math.nan
        return True
    after = select(sent.keeps, before + sent.work, square(sent.v) + fall)
    heat = book_sent(laws, state, i, walls.row(wall), (before, after - sent.work), sent.lost)
    if share.counts is not None:
        share.counts.give(wall, heat, sent.wait)
    book_work(walls, state, i, wall, sent.work)
    state.energy[i] = 0.5 * after
    put(state.velocity, 0, i, sent.v)
    state.impacts[i] += 1
    share.note_impact(method, walls, i, impact_log.Struck(r, v, sent.v, wall, remaining, sent.impulse))
    state.impulse[walls.row(wall), i] += sent.impulse * state.mass[i]
    if state.absorbed is not None and not sent.wait < remaining:
        if sent.wait == math.inf:
            absorb(share, i, wall, remaining)
        else:
            state.starts[i] = share.moment - remaining + sent.wait
        _end_frame(share, i)
        return True
    contacts.remaining[i] = remaining - sent.wait
    contacts.phase[i], contacts.keep[i] = FLYING, 0.0
    share.hand_over(i, FLYING)
    return True


@outlined
def _spare(moving, walls, state, i, found, wall):
    """Book how much less its walls give particle i, which chatters, than one that has no speed across them."""
    r, v = column(state.position, 0, i), column(state.velocity, 0, i)
    turned = v - found.impulse * walls.unit_normal(wall, r)
    if found.phase == HELD:
        active = One(found.wall)
        taken = active.split_at(walls, drift(moving, active, walls, r), r, turned)
    else:
        edge = Two(found.wall, found.other)
        taken = edge.split_at(walls, drift(moving, edge, walls, r), r, turned)
        state.impulse[walls.row(found.other), i] += taken.c * state.mass[i]
    state.impulse[walls.row(found.wall), i] += taken.b * state.mass[i]


# --- Short steps -----------------------------------------------------------------------------------------


def _take_care(method, walls, gravity, share, i):
    """A short step of particle i; whether it moves on."""
    state, contacts = share.state, share.state.contacts
    if share.counters is None:
        _step(method, walls, gravity, share, i)
        if state.period is not None:
            return_particle(state.period, walls, state, i)
    else:
        _count_step(method, walls, gravity, share, i)
    r = column(state.position, 0, i)
    closed = isinstance(walls, Carried) and _have_closed(walls, method, r, contacts.remaining[i])
    return not closed and not contacts.short_steps[i] > _MOST_SHORT_STEPS


@outlined
def _count_step(method, walls, gravity, share, i):
    """A short step of particle i, and what it crosses."""
    state, counters, remaining = share.state, share.counters, share.state.contacts.remaining
    left = remaining[i]
    before = Moment(column(state.position, 0, i), column(state.velocity, 0, i), left if left > 0.0 else share.span)
    _step(method, walls, gravity, share, i)
    end = Moment(column(state.position, 0, i), column(state.velocity, 0, i), remaining[i])
    counters.count_step(share, i, before, end)
    if state.period is not None:
        return_particle(state.period, walls, state, i)
        back = Moment(column(state.position, 0, i), end.v, end.remaining)
        if square(back.r - end.r) > 0.0:
            counters.come_back(share, i, before, end.r, back)


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
        # Round-off that its walls have gathered, which nothing takes back from now on
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
    # What is carried begins the frame so.
    remaining = remaining if remaining > 0.0 else share.span
    now = walls.at(remaining)
    if state.openings is not None:
        wall = open_wall_at(state.openings, method, now, gravity, (r, v), crossing.near(method, r))
        if wall >= 0.0 and leads_on(now, wall, r):
            contacts.remaining[i] = remaining
            _go_through(now, gravity, share, i, wall, r, v)
            return
        if wall >= 0.0:
            _leave(share, i, wall, r, v, remaining)
            return
    p = events.Particle(r, v, remaining, 2.0 * state.energy[i], speed2_scale(state, i))
    active = scratch((2, walls.length()), np.float64)
    if method.laws.moving is None and events.settles(method, now, gravity, p, active):
        _rest(method, now, gravity, share, i, p, active)
        return
    # Step by step, where places on its way are looked at.
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
        # A short step, where the places on its way are looked at.
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
    book_step(walls, state, i, contacts.met[i], change, given_work, method.laws.loses)
    contacts.sliding[i] += end.used
    share.note_stay(i, end.used)
    contacts.remaining[i] = max(remaining - end.used, 0.0)
    phase = FLYING if contacts.remaining[i] > 0.0 else ARRIVED
    contacts.phase[i], contacts.step[i], contacts.keep[i] = FLYING, 0.0, 0.0
    share.hand_over(i, phase)


@outlined
def _have_closed(walls, method, r, remaining):
    """Whether walls that move leave no place for a particle, with so much of the frame left [s]."""
    now, deepest = walls.at(remaining), 0.0
    number = now.numbers_near(r)
    for i in range(number.size):
        deepest = max(deepest, now.distance(number[i], r))
    return deepest > events.TOUCH * method.size

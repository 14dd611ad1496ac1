"""Decide how particles go on that meet a wall while they slide, or at a wall where their contact lasts."""

import math

import numpy as np

from ..contact import crossing, events
from ..contact.absence import hit_wall, lets_through
from ..contact.events import CAREFUL, EDGE, EVENT, FLYING, HELD
from ..contact.hold import One, Two, drift
from ..contact.reflection import given, wall_velocity
from ..contact.wall_impact import Arriving, by_law
from ..contact.wall_impact import book as book_impact
from ..kernel.arrays import scratch
from ..kernel.jit import long_kernel, outlined
from ..kernel.vector import column, put, square
from .accounts import book
from .carried import is_carried
from .escape import detain, end_frame, let_out
from .lane_arrays import speed2_scale
from .one_by_one import one_by_one
from .watching.log import Struck

# A particle that meets walls this often without moving on is left to the careful way, and later given up.
_OFTEN, _MOST = 64.0, 1e6
# A particle moves on if it advances by this fraction of a crossing.
_MOVED = 1e-9


@long_kernel
def meet_block(method, walls, gravity, share):
    """Decide for the particles that a thread draws; return (status, particle, drawn). After LOG_FULL call it again."""
    return one_by_one(EVENT, _decide, (method, walls, gravity), share)


@outlined
def _decide(method, walls, gravity, share, i):
    """Decide whether particle i goes on along its walls or flies; return whether it makes progress."""
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
        struck = Struck(i, wall, share.moment - remaining, r, v, found.v, found.impulse * state.mass[i])
        share.watchers.hit(state.image, share.watchers.with_slip(method.laws, walls, struck))
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
    # The last step is a good first one if the walls are the same.
    same = found.wall == first and found.other == second
    contacts.step[i] = contacts.step[i] if same else 0.0
    contacts.walls[0, i] = found.wall if slides else -1.0
    contacts.walls[1, i] = found.other if slides else -1.0
    contacts.phase[i] = phase if phase in (HELD, EDGE) else FLYING
    share.hand_over(i, phase)
    return again < _MOST


def _settle(walls, state, i, found):
    """Put a particle that begins to slide back onto its wall: where rooms touch, a hit is put inside of its room."""
    if walls.inset is not None and (found.phase == HELD or found.phase == EDGE):
        put(state.position, 0, i, walls.project(found.wall, column(state.position, 0, i)))


@outlined
def _let_out(method, walls, gravity, share, i, r, v, remaining):
    """Let particle i out if the wall that it has met is open there; return whether it was let out."""
    openings, met, near = share.state.openings, share.state.contacts.met, crossing.near(method, r)
    # Replaces an open wall by a closed wall at the same place.
    met[i] = hit_wall(openings, method, walls, (r, v), met[i], near)
    if not lets_through(openings, walls, met[i], r, near):
        return False
    let_out(walls, gravity, share, i, met[i], r, v, remaining)
    return True


@outlined
def _send_off(method, walls, gravity, share, i):
    """Let a law of the wall that a sliding particle meets send it off, to fly or be absorbed; return whether it did."""
    state, contacts, laws = share.state, share.state.contacts, method.laws
    wall, r, v = contacts.met[i], column(state.position, 0, i), column(state.velocity, 0, i)
    remaining = contacts.remaining[i]
    now, mass = walls.at(remaining), state.mass[i]
    random = share.seeding.of_impact(i, state.impacts[i], laws)
    # A particle that slides along another wall meets this one without end: restitution and edges are for slow impacts.
    slow = events.GRAZING * np.sqrt(max(speed2_scale(state, i), square(v)))
    happens, sent = by_law(laws, now, gravity, wall, Arriving(r, v, 2.0 * state.energy[i], mass, slow), random)
    if not happens:
        return False
    if laws.own is not None and math.isnan(sent.v.x):
        # The test whether the particle goes on finds this NaN.
        contacts.keep[i] = math.nan
        return True
    heat = book_impact(laws, state, (walls.row(wall), i, i), mass, sent)
    if share.counts is not None:
        share.counts.give(wall, heat, sent.wait)
    state.energy[i] = 0.5 * sent.twice_energy
    put(state.velocity, 0, i, sent.v)
    struck = Struck(i, wall, share.moment - remaining, r, v, sent.v, sent.impulse * mass)
    share.watchers.hit(state.image, share.watchers.with_slip(laws, now, struck))
    if state.absorbed_time is not None and not detain(share, i, wall, remaining, sent.wait):
        end_frame(share, i)
        return True
    contacts.remaining[i] = remaining - sent.wait
    contacts.phase[i], contacts.keep[i] = FLYING, 0.0
    share.hand_over(i, FLYING)
    return True


@outlined
def _spare(moving, walls, state, i, found, wall):
    """Book the difference of the impulses on particle i, which chatters, from those on one without normal speed."""
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

"""Contacts of a body that last: one more constraint g(q1) = g(q0) for each, as long as its multiplier pushes.

The walls press with a force on each contact, part of the free motion of a trial step. After each trial the forces are
corrected by Gauss-Seidel with the inverse mass that the links leave, until gaps and signs are right: then no contact
has moved through its wall, so the forces have done no work but that of friction.
"""

import math

import numpy as np

from ...kernel.jit import inlined, outlined, scratch
from ...kernel.vector import Vec, cross, dot, norm
from ...surfaces import fold as walls
from . import blow

# Sweeps over the contacts after a trial, and the rest of a gap, in units of round-off, with which the forces are right.
_SWEEPS, _SETTLED = 50, 32.0
# The most that an error of friction moves a contact [m/s]; and after so many trials gaps may be larger by the factor:
# where more contacts than three hold a point, their forces converge slowly.
_CREEP, _TRIALS, _LARGER = 1e-7, 60, 1e3


@outlined
def begin(touching, chain, rule, lanes, pace, held, i):
    """The contacts at the start of a step, which press with nothing yet."""
    name = scratch((blow.MOST_CONTACTS, 2), np.int64)
    frame = scratch((blow.MOST_CONTACTS, 3, 3), np.float64)
    found = blow.near(touching, chain, rule, (lanes.r, lanes.v), i, (name, frame), False)
    pace.held[i] = found
    for a in range(found):
        held.name[i, a, 0], held.name[i, a, 1] = name[a, 0], name[a, 1]
        for d in range(3):
            held.press[i, 3 * a + d] = 0.0
            for x in range(3):
                held.frame[i, a, d, x] = frame[a, d, x]
    _load(touching, lanes, pace, held, i)


@outlined
def press(ties, touching, chain, rule, lanes, paces, i):
    """Correct the forces after a trial; whether they were right."""
    pace, held = paces
    found, h = pace.held[i], pace.step[i]
    rows = 3 * found
    name = scratch((blow.MOST_CONTACTS, 2), np.int64)
    frame = scratch((blow.MOST_CONTACTS, 3, 3), np.float64)
    system = scratch((ties.links, ties.links), np.float64)
    answer = scratch((3 * blow.MOST_CONTACTS, ties.links), np.float64)
    schur = scratch((3 * blow.MOST_CONTACTS, 3 * blow.MOST_CONTACTS), np.float64)
    moved = scratch(3 * blow.MOST_CONTACTS, np.float64)
    change = scratch(3 * blow.MOST_CONTACTS, np.float64)
    for a in range(found):
        k, wall = held.name[i, a, 0], held.name[i, a, 1]
        name[a, 0], name[a, 1] = k, wall
        y0, y1 = blow.point_of(touching, lanes.r, k, i), blow.point_of(touching, lanes.r1, k, i)
        n = walls.step_normal(chain, float(wall), y0, y1)
        _turn(held.frame, i, a, n)
        for x in range(3):
            for d in range(3):
                frame[a, d, x] = held.frame[i, a, d, x]
        # (q1 - q0)/|D| = n.(y1 - y0), and what a point was outside by round-off
        for d in range(3):
            moved[3 * a + d] = dot(blow.direction(frame, 3 * a + d), y1 - y0)
        moved[3 * a] += max(walls.distance(chain, float(wall), y0), 0.0)
    blow.links(ties, lanes.r, i, system)
    blow.respond(ties, touching, (name, frame, rows), (lanes.r, i), system, answer, schur)
    half = 0.5 * h * h
    _sweep(touching, (name, found), schur, moved, (held.press, i), change, half)
    # Which way a point creeps by friction is less exact: what it loses is booked whatever it is.
    room, right = tolerated(rule, pace, i), True
    for a in range(found):
        off = moved[3 * a]
        right = right and (abs(off) <= room if held.press[i, 3 * a] > 0.0 else off <= room)
        creep = max(abs(change[3 * a + 1]), abs(change[3 * a + 2])) * schur[3 * a, 3 * a] * half
        right = right and creep <= max(_CREEP * h, room)
    _load(touching, lanes, pace, held, i)
    return right


@inlined
def tolerated(rule, pace, i):
    """How far a contact that lasts may be off its wall [m]."""
    larger = 1.0
    for k in range(1, 4):
        larger *= _LARGER if pace.stuck[i] > k * _TRIALS else 1.0
    return _SETTLED * rule.room * larger


@inlined
def _turn(frame, i, a, n):
    """Turn the frame of a contact to this normal."""
    t = Vec(frame[i, a, 1, 0], frame[i, a, 1, 1], frame[i, a, 1, 2])
    t = t - dot(t, n) * n
    t = t / norm(t)
    s = cross(n, t)
    frame[i, a, 0, 0], frame[i, a, 0, 1], frame[i, a, 0, 2] = n.x, n.y, n.z
    frame[i, a, 1, 0], frame[i, a, 1, 1], frame[i, a, 1, 2] = t.x, t.y, t.z
    frame[i, a, 2, 0], frame[i, a, 2, 1], frame[i, a, 2, 2] = s.x, s.y, s.z


@inlined
def _sweep(touching, contacts, schur, moved, presses, change, half):
    """Gauss-Seidel: no contact ends outside, none pulls, and one with friction stays or slides within its cone."""
    name, found = contacts
    press_of, i = presses
    for a in range(3 * found):
        change[a] = 0.0
    for _turn in range(_SWEEPS):
        largest, size = 0.0, 0.0
        for a in range(found):
            j, mu = 3 * a, touching.friction[name[a, 1]]
            left = moved[j]
            for b in range(3 * found):
                left -= half * schur[j, b] * change[b]
            new = max(0.0, press_of[i, j] + left / (half * schur[j, j]))
            largest, size = max(largest, abs(new - press_of[i, j])), max(size, new)
            change[j] += new - press_of[i, j]
            press_of[i, j] = new
            if mu > 0.0:
                one, other = moved[j + 1], moved[j + 2]
                for b in range(3 * found):
                    one -= half * schur[j + 1, b] * change[b]
                    other -= half * schur[j + 2, b] * change[b]
                stiff = half * max(schur[j + 1, j + 1], schur[j + 2, j + 2])
                one, other = press_of[i, j + 1] + one / stiff, press_of[i, j + 2] + other / stiff
                length = math.sqrt(one * one + other * other)
                within = min(1.0, mu * new / length) if length > 0.0 else 1.0
                largest = max(largest, abs(within * one - press_of[i, j + 1]), abs(within * other - press_of[i, j + 2]))
                change[j + 1] += within * one - press_of[i, j + 1]
                change[j + 2] += within * other - press_of[i, j + 2]
                press_of[i, j + 1], press_of[i, j + 2] = within * one, within * other
        if largest <= 1e-16 * size:
            break


@inlined
def _load(touching, lanes, pace, held, i):
    """The deceleration of every point by these forces, W sum b p d."""
    for q in range(lanes.load.shape[0]):
        for x in range(3):
            total = 0.0
            for a in range(3 * pace.held[i]):
                force = held.press[i, a]
                if force != 0.0:
                    total += force * touching.reach[held.name[i, a // 3, 0], q] * held.frame[i, a // 3, a % 3, x]
            lanes.load[q, x, i] = total


@outlined
def end(touching, lanes, pace, held, state, i):
    """Book what the walls did in the step; the contacts last as long as one of them pushes."""
    number, h, pushes = pace.body[i], pace.step[i], False
    for a in range(pace.held[i]):
        force = held.press[i, 3 * a]
        pushes = pushes or force > 0.0
        state.impulse[held.name[i, a, 1], number] += h * force
        for d in range(1, 3):
            along = Vec(held.frame[i, a, d, 0], held.frame[i, a, d, 1], held.frame[i, a, d, 2])
            u = blow.point_of(touching, lanes.ra, held.name[i, a, 0], i)
            c = blow.point_of(touching, lanes.r1, held.name[i, a, 0], i)
            state.dissipated[number] += held.press[i, 3 * a + d] * dot(along, c - u)
    state.sliding[number] += h
    for q in range(lanes.load.shape[0]):
        for x in range(3):
            lanes.load[q, x, i] = 0.0
    if not pushes:
        pace.held[i] = 0

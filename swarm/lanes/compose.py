"""One composed step of every lane that slides: loops without branches, and what the step may end with."""

import math
from typing import NamedTuple

import numpy as np

from ..contact import events, hold
from ..contact import laws as wall_laws
from ..contact import sliding as slides
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import Array, by_type, inlined, select
from ..kernel.vector import ZERO, column, either, put, square
from ..methods import contract as methods
from .arrays import STRIDE, table

# What a lane holds: position, velocity and acceleration, what presses on its walls, the time left, the next step, the
# speed it keeps across the walls, twice its energy, the square of its speed scale, its walls, and where a step is cut.
R, V, A, PRESS, LEFT, STEP, KEEP, TWICE, SCALE2, WALL, CUT = 0, 3, 6, 9, 11, 12, 13, 14, 15, 16, 18
# The step of this pass: its length, how far the composition has come, what presses at its end, its impulses, the work
# of friction, by how much it may be off, and by how much the last sweep but one.
H, R1, V1, PRESS1, IMPULSE, WORK, ALLOWED, STILL = 19, 20, 23, 26, 28, 30, 31, 32
# The part of the composition under way: w0, the last guess of its end, the direction in which it slides; the changes of
# velocity that the accelerations of the last two parts would make in the whole step; how often the step has been cut.
W, END, TOWARD, CHANGE, BEFORE, TRIALS, ROWS = 33, 36, 39, 42, 45, 48, 49
# A step of this part of a crossing, or of the size, is the shortest.
SHORTEST, _NO_WAY = 1e-10, 1e-15
# Friction has stopped a particle where this part of |v|^2 is left.
_STOPPED = 1e-24


class Lanes(NamedTuple):
    """Arrays of one column a lane."""

    rows: Array  # (ROWS, stride)
    particle: Array  # int64
    moving: Array  # bool, whether the sweeps of a step go on
    event: Array  # int64, what the step of this pass may end with


# What a step may end with.
LIFTED, MET, FAILED, STOPPED, STUCK = 1, 2, 4, 8, 16


def empty() -> Lanes:
    """Lanes for one block."""
    return Lanes(table(ROWS), np.zeros(STRIDE, np.int64), np.zeros(STRIDE, np.bool_), np.zeros(STRIDE, np.int64))


# --- One composed step of every lane ---------------------------------------------------------------------


@inlined
def _start(method, gravity, lanes, live):
    """How long the step of every live lane is, by how much it may be off, and from where it goes."""
    rows, friction, tolerance = lanes.rows, methods.friction(method), methods.sliding_tolerance(method)
    for i in range(live):
        v, a = column(rows, V, i), column(rows, A, i)
        h = select(rows[STEP, i] < rows[LEFT, i], rows[STEP, i], rows[LEFT, i])
        h = select(rows[CUT, i] < h, rows[CUT, i], h)
        stop = slides.longest(friction, v, a)
        h = select(stop < h, stop, h)
        # The tolerance is that of a crossing at the speed, or in the pull along the walls, that the particle has now.
        speed = math.sqrt(0.5 * (square(v) + math.sqrt(square(a)) * method.size))
        rows[H, i], rows[ALLOWED, i] = h, tolerance * speed * h
        r, taken = column(rows, R, i), accelerated(gravity, ZERO, 1.0) - a
        rows[STILL, i] = slides.still(r, v, h * taken, rows[ALLOWED, i])
        put(rows, R1, i, r)
        put(rows, V1, i, v)
        put(rows, CHANGE, i, h * a)
        put(rows, BEFORE, i, h * a)
        rows[IMPULSE, i], rows[IMPULSE + 1, i], rows[WORK, i] = 0.0, 0.0, 0.0
        lanes.event[i] = 0


@inlined
def compose(kind, method, chain, gravity, lanes, live):
    """One composed step of every live lane, from its R, V and A to its R1 and V1."""
    rows, moving, friction = lanes.rows, lanes.moving, methods.friction(method)
    rubs = wall_laws.is_given(friction)
    _start(method, gravity, lanes, live)
    for k in range(slides.PARTS):
        for i in range(live):
            r, v, h = column(rows, R1, i), column(rows, V1, i), slides.part(k) * rows[H, i]
            last = column(rows, CHANGE, i)
            change = last + slides.lead(k) * (last - column(rows, BEFORE, i))
            put(rows, BEFORE, i, last)
            put(rows, END, i, r + h * (v + (0.5 * slides.part(k)) * change))
            if rubs:
                toward = slides.direction(friction, v, last)
                held = hold.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
                slowed = slides.slow(friction, held, chain, gravity, r, (v, toward), 0.5 * h)
                v = slowed.v
                rows[WORK, i] += slowed.lost
                put(rows, TOWARD, i, toward)
            put(rows, W, i, accelerated(gravity, v, 0.5 * h))
            moving[i] = True
        for _sweep in range(slides.SWEEPS):
            some = False
            for i in range(live):
                some = _sweep_lane(kind, chain, lanes, i, slides.part(k)) | some
            if not some:
                break
        for i in range(live):
            h, w, v0, r0 = slides.part(k) * rows[H, i], column(rows, W, i), column(rows, V1, i), column(rows, R1, i)
            held = hold.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
            # The last sweep
            taken = hold.split(held, chain, r0, column(rows, END, i), w)
            r, v1 = r0 + h * taken.along, accelerated(gravity, 2.0 * taken.along - w, 0.5 * h)
            if rubs:
                slowed = slides.slow(friction, held, chain, gravity, r, (v1, column(rows, TOWARD, i)), 0.5 * h)
                v1 = slowed.v
                rows[WORK, i] += slowed.lost
            put(rows, R1, i, r)
            put(rows, V1, i, v1)
            put(rows, CHANGE, i, slides.inverse_part(k) * (v1 - v0))
            rows[IMPULSE, i] += 2.0 * taken.b
            rows[IMPULSE + 1, i] += 2.0 * taken.c
            lanes.event[i] |= select(moving[i], FAILED, 0)


@inlined
def _sweep_lane(kind, chain, lanes, i, part):
    """One sweep of a lane that still moves: whether it needs another."""
    rows, moving = lanes.rows, lanes.moving
    held = hold.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
    r0, end, w = column(rows, R1, i), column(rows, END, i), column(rows, W, i)
    swept = slides.sweep(held, chain, part * rows[H, i], (r0, end, w), rows[STILL, i])
    on = moving[i]
    put(rows, END, i, either(on, swept.r, end))
    more = on & swept.moves
    moving[i] = more
    return more


# --- Its end ---------------------------------------------------------------------------------------------


@inlined
def end_steps(kind, method, chain, gravity, lanes, live):
    """Take the steps that are as exact as asked and end without an event; lengthen or shorten the next."""
    rows, friction = lanes.rows, methods.friction(method)
    for i in range(live):
        held = hold.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
        h, scale2, keep = rows[H, i], rows[SCALE2, i], rows[KEEP, i]
        r0, v0, a0 = column(rows, R, i), column(rows, V, i), column(rows, A, i)
        r1 = hold.settle(held, chain, column(rows, R1, i))
        twice = rows[TWICE, i] - rows[WORK, i]
        v1 = hold.split_at(held, chain, r1, column(rows, V1, i)).along
        v1 = slides.restored(v1, twice - 2.0 * potential(gravity, r1) - keep * keep, scale2)
        force = slides.force(friction, held, chain, gravity, r1, v1)
        ratio = slides.error(h, (r0, v0, a0), (r1, v1, force.acceleration), rows[ALLOWED, i])
        path = slides.Path(r0, v0, r1, v1, h)
        lifted = hold.lets_go(held, force.n, force.m)
        met = slides.meets(chain, 0.0, held, path, events.near(method, r1))
        good = (ratio <= 1.0) & (lanes.event[i] == 0)
        fine = good & (not lifted) & (not met)
        happened = select(lifted, LIFTED, 0) | select(met, MET, 0)
        lanes.event[i] |= select(good, happened, 0)
        lanes.moving[i] = fine
        # What the end of the frame or an event cuts says nothing of the length; and a step that is to be cut must be
        # found so again after a halt.
        whole = (fine & (h == rows[STEP, i])) | (not (ratio <= 1.0))
        rows[STEP, i] = select(whole, slides.next_step(h, ratio), rows[STEP, i])
        rows[CUT, i] = select(fine, np.inf, rows[CUT, i])
        rows[LEFT, i] -= select(fine, h, 0.0)
        rows[TWICE, i] = select(fine, twice, rows[TWICE, i])
        put(rows, R1, i, r1)
        put(rows, V1, i, v1)
        rows[PRESS1, i], rows[PRESS1 + 1, i] = force.n, force.m
        put(rows, R, i, either(fine, r1, r0))
        put(rows, V, i, either(fine, v1, v0))
        put(rows, A, i, either(fine, force.acceleration, a0))
        rows[PRESS, i] = select(fine, force.n, rows[PRESS, i])
        rows[PRESS + 1, i] = select(fine, force.m, rows[PRESS + 1, i])
        lanes.event[i] |= _stop(friction, fine, v1, scale2)
        # Near an apex steps become shorter without end, in time or, of a slow particle, in length.
        step = rows[STEP, i]
        way2 = step * step * (square(v1) + step * step * square(accelerated(gravity, ZERO, 1.0)))
        short = (step < SHORTEST * method.size / math.sqrt(scale2)) | (way2 < (_NO_WAY * method.size) ** 2)
        lanes.event[i] |= select(short, STUCK, 0)


@by_type
def _stop(friction, fine, v, scale2):
    """Whether friction has stopped a particle."""
    return select(fine & (square(v) <= _STOPPED * scale2), STOPPED, 0)


@_stop.register(type(None))
def _(friction, fine, v, scale2):
    return 0


# --- What it gives ----------------------------------------------------------------------------------------


@inlined
def account(method, state, lanes, i):
    """What a step that is taken gives to the state."""
    rows, p = lanes.rows, lanes.particle[i]
    if not lanes.moving[i]:
        return
    state.contacts.sliding[p] += rows[H, i]
    push(state, lanes, i, rows[IMPULSE, i], rows[IMPULSE + 1, i])
    rows[TRIALS, i] = 0.0
    if wall_laws.is_given(methods.friction(method)):
        lose(state, lanes, i, rows[WORK, i])


@inlined
def push(state, lanes, i, first, second):
    """Impulses per mass to the walls that hold a lane."""
    rows, p = lanes.rows, lanes.particle[i]
    state.impulse[int(rows[WALL, i]), p] += first * state.mass[p]
    if rows[WALL + 1, i] >= 0.0:
        state.impulse[int(rows[WALL + 1, i]), p] += second * state.mass[p]


@inlined
def lose(state, lanes, i, twice):
    """Book twice the energy per mass that a lane has lost; its row knows what is left."""
    p = lanes.particle[i]
    state.energy[p] = 0.5 * lanes.rows[TWICE, i]
    state.dissipated[p] += 0.5 * twice * state.mass[p]

"""Particles that slide, a block of them at once, in lanes: one kernel for one wall, one for the edges of two.

One pass is one composed step of every lane, in loops without branches. What a step may end with (the wall lets go,
another wall is met, the particle stops) is found one lane at a time: the step is cut there and taken again, so that it
ends at the instant to round-off. A lane writes what it gives its walls step by step, so that a halt changes no bit.
"""

import math
from typing import NamedTuple

import numpy as np

from ..contact import events
from ..contact import laws as wall_laws
from ..contact import sliding as slides
from ..contact.events import ARRIVED, CAREFUL, EDGE, EVENT, FLYING, HELD
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import Array, by_type, index, inlined, kernel, outlined, select
from ..kernel.vector import ZERO, column, either, put, square
from ..methods import contract as methods
from ..status import Status
from ..surfaces import fold as walls
from .arrays import LANES, STRIDE, following_particle, speed2_scale, table, with_distances

# What a lane holds: position, velocity and acceleration, what presses on its walls, the time left, the next step, the
# speed it keeps across the walls, twice its energy, the square of its speed scale, its walls, and where a step is cut.
R, V, A, PRESS, LEFT, STEP, KEEP, TWICE, SCALE2, WALL, CUT = 0, 3, 6, 9, 11, 12, 13, 14, 15, 16, 18
# The step of this pass: its length, how far the composition has come, what presses at its end, its impulses, the work
# of friction, by how much it may be off, and by how much the last sweep but one.
H, R1, V1, PRESS1, IMPULSE, WORK, ALLOWED, STILL = 19, 20, 23, 26, 28, 30, 31, 32
# The part of the composition under way: w0, the last guess of its end, the direction in which it slides; the changes of
# velocity that the accelerations of the last two parts would make in the whole step; how often the step has been cut.
W, END, TOWARD, CHANGE, BEFORE, TRIALS, ROWS = 33, 36, 39, 42, 45, 48, 49
# Times that a step is cut before the lane is given up: it takes four or so.
_MOST_TRIALS = 100
# The first step of a particle that begins to slide, in crossings; the walls correct it.
_FIRST = 1e-3
# A step that is tried again is so much shorter; one of this part of a crossing, or of the size, is the shortest.
_RETRY, _SHORTEST, _NO_WAY = 0.25, 1e-10, 1e-15
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


@by_type
def _phase(kind):
    return HELD


_phase.register(slides.Two, lambda kind: EDGE)


@kernel
def slide_block(kind, method, chain, gravity, share, lanes):
    """Advance the particles of this kind, `One` or `Two`, that a thread draws: (status, particle, drawn).

    Each until it has arrived, flies, or is held by other walls; `share.pending` counts what is left to other kernels.
    """
    lanes = with_distances(lanes)
    following, stop, drawn, live, passes = 0, 0, 0, 0, 0
    while live < LANES:
        following, stop, drawn, loaded = _refill(
            kind, method, chain, gravity, share, lanes, live, (following, stop, drawn)
        )
        if not loaded:
            break
        live += 1
    while live > 0:
        if passes >= share.halt[0]:
            _leave(kind, chain, share, lanes, live)
            return Status.INTERRUPTED.value, 0, drawn
        passes += 1
        _compose(kind, method, chain, gravity, lanes, live)
        _end_steps(kind, method, chain, gravity, lanes, live)
        for i in range(live):
            _account(method, share.state, lanes, i)
        # From the last, so that every lane behind one that leaves is still under way, and may take its place.
        for i in range(live - 1, -1, -1):
            phase = _next_phase(kind, method, chain, gravity, share.state, lanes, i)
            if phase != _phase(kind):
                _retire(kind, chain, share, lanes, i, phase)
                following, stop, drawn, loaded = _refill(
                    kind, method, chain, gravity, share, lanes, i, (following, stop, drawn)
                )
                if not loaded:
                    live -= 1
                    _move(lanes, live, i)
    return Status.DONE.value, 0, drawn


@outlined
def _leave(kind, chain, share, lanes, live):
    """The live lanes back into their particles, which go on when the frame does."""
    for i in range(live):
        _retire(kind, chain, share, lanes, i, _phase(kind))


@outlined
def _refill(kind, method, chain, gravity, share, lanes, lane, at):
    """The next particle that slides into a lane: (particle, stop, draws) to go on from, and whether there is one."""
    following, stop, drawn = at
    while True:
        following, stop, drawn = following_particle(share, _phase(kind), following, stop, drawn)
        if following == stop:
            return following, stop, drawn, False
        following += 1
        if _load(kind, method, chain, gravity, share, lanes, lane, following - 1):
            return following, stop, drawn, True


@inlined
def _next_phase(kind, method, chain, gravity, state, lanes, i):
    """What a lane does after a step."""
    phase = _phase(kind)
    if lanes.event[i] != 0:
        phase = _decide(kind, method, chain, gravity, state, lanes, i)
    return phase if lanes.rows[LEFT, i] > 0.0 else ARRIVED


# --- One composed step of every lane ---------------------------------------------------------------------


@inlined
def _compose(kind, method, chain, gravity, lanes, live):
    rows, moving = lanes.rows, lanes.moving
    friction, tolerance = methods.friction(method), methods.sliding_tolerance(method)
    rubs = wall_laws.is_given(friction)
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
    for k in range(slides.PARTS):
        for i in range(live):
            r, v, h = column(rows, R1, i), column(rows, V1, i), slides.part(k) * rows[H, i]
            last = column(rows, CHANGE, i)
            change = last + slides.lead(k) * (last - column(rows, BEFORE, i))
            put(rows, BEFORE, i, last)
            put(rows, END, i, r + h * (v + (0.5 * slides.part(k)) * change))
            if rubs:
                toward = slides.direction(friction, v, last)
                held = slides.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
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
            held = slides.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
            # The last sweep
            taken = slides.split(held, chain, r0, column(rows, END, i), w)
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
    held = slides.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
    r0, end, w = column(rows, R1, i), column(rows, END, i), column(rows, W, i)
    swept = slides.sweep(held, chain, part * rows[H, i], (r0, end, w), rows[STILL, i])
    on = moving[i]
    put(rows, END, i, either(on, swept.r, end))
    more = on & swept.moves
    moving[i] = more
    return more


# --- Its end ---------------------------------------------------------------------------------------------


@inlined
def _end_steps(kind, method, chain, gravity, lanes, live):
    """Take the steps that are as exact as asked and end without an event; lengthen or shorten the next."""
    rows, friction = lanes.rows, methods.friction(method)
    for i in range(live):
        held = slides.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
        h, scale2, keep = rows[H, i], rows[SCALE2, i], rows[KEEP, i]
        r0, v0, a0 = column(rows, R, i), column(rows, V, i), column(rows, A, i)
        r1 = slides.settle(held, chain, column(rows, R1, i))
        twice = rows[TWICE, i] - rows[WORK, i]
        v1 = slides.split_at(held, chain, r1, column(rows, V1, i)).along
        v1 = slides.restored(v1, twice - 2.0 * potential(gravity, r1) - keep * keep, scale2)
        force = slides.force(friction, held, chain, gravity, r1, v1)
        ratio = slides.error(h, (r0, v0, a0), (r1, v1, force.acceleration), rows[ALLOWED, i])
        path = slides.Path(r0, v0, r1, v1, h)
        lifted = slides.lets_go(held, force.n, force.m)
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
        short = (step < _SHORTEST * method.size / math.sqrt(scale2)) | (way2 < (_NO_WAY * method.size) ** 2)
        lanes.event[i] |= select(short, STUCK, 0)


@by_type
def _stop(friction, fine, v, scale2):
    """Whether friction has stopped a particle."""
    return select(fine & (square(v) <= _STOPPED * scale2), STOPPED, 0)


@_stop.register(type(None))
def _(friction, fine, v, scale2):
    return 0


@inlined
def _account(method, state, lanes, i):
    """What a step that is taken gives to the state."""
    rows, p = lanes.rows, lanes.particle[i]
    if not lanes.moving[i]:
        return
    state.contacts.sliding[p] += rows[H, i]
    _push(state, lanes, i, rows[IMPULSE, i], rows[IMPULSE + 1, i])
    rows[TRIALS, i] = 0.0
    if wall_laws.is_given(methods.friction(method)):
        _lose(state, lanes, i, rows[WORK, i])


@inlined
def _push(state, lanes, i, first, second):
    """Impulses per mass to the walls that hold a lane."""
    rows, p = lanes.rows, lanes.particle[i]
    state.impulse[int(rows[WALL, i]), p] += first * state.mass[p]
    if rows[WALL + 1, i] >= 0.0:
        state.impulse[int(rows[WALL + 1, i]), p] += second * state.mass[p]


@inlined
def _lose(state, lanes, i, twice):
    """Book twice the energy per mass that a lane has lost; its row knows what is left."""
    p = lanes.particle[i]
    state.energy[p] = 0.5 * lanes.rows[TWICE, i]
    state.dissipated[p] += 0.5 * twice * state.mass[p]


# --- Into lanes and out of them --------------------------------------------------------------------------


@outlined
def _load(kind, method, chain, gravity, share, lanes, lane, i):
    """Particle i into a lane; whether it slides: it may also rest until the end of the frame, or fly."""
    rows, state = lanes.rows, share.state
    contacts = state.contacts
    begins = not contacts.left[i] > 0.0
    left = share.span if begins else contacts.left[i]
    r, v, twice = column(state.position, 0, i), column(state.velocity, 0, i), 2.0 * state.energy[i]
    scale2 = speed2_scale(state, i)
    lanes.particle[lane] = i
    rows[LEFT, lane], rows[CUT, lane], rows[TRIALS, lane], rows[SCALE2, lane] = left, np.inf, 0.0, scale2
    rows[WALL, lane], rows[WALL + 1, lane] = contacts.walls[0, i], contacts.walls[1, i]
    rows[STEP, lane], rows[KEEP, lane], rows[TWICE, lane] = contacts.step[i], contacts.keep[i], twice
    if begins:
        held = slides.of_lane(kind, rows[WALL, lane], rows[WALL + 1, lane])
        # Frames show the speed that is kept across the walls too.
        v = slides.split_at(held, chain, r, v).along
    put(rows, R, lane, r)
    put(rows, V, lane, v)
    phase = _set_going(kind, method, chain, gravity, state, lanes, lane)
    if phase != _phase(kind):
        _retire(kind, chain, share, lanes, lane, phase)
        return False
    return True


@outlined
def _set_going(kind, method, chain, gravity, state, lanes, i):
    """The forces on a lane at the start of its next step; what it does next, which may be to rest."""
    rows, friction = lanes.rows, methods.friction(method)
    held = slides.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
    r, v, left = column(rows, R, i), column(rows, V, i), rows[LEFT, i]
    force = slides.force(friction, held, chain, gravity, r, v)
    put(rows, A, i, force.acceleration)
    rows[PRESS, i], rows[PRESS + 1, i] = force.n, force.m
    if not rows[STEP, i] > 0.0:
        rows[STEP, i] = _FIRST * method.size / np.sqrt(rows[SCALE2, i])
    if square(v) == 0.0 and events.rests(gravity, force):
        p, contacts = lanes.particle[i], state.contacts
        contacts.sliding[p] += left
        contacts.phase[p], contacts.load[int(rows[WALL, i]), p] = ARRIVED, force.n
        if rows[WALL + 1, i] >= 0.0:
            contacts.load[int(rows[WALL + 1, i]), p] = force.m
        _push(state, lanes, i, force.n * left, force.m * left)
        rows[LEFT, i] = 0.0
        return ARRIVED
    return _phase(kind)


@outlined
def _retire(kind, chain, share, lanes, i, phase):
    """A lane back into its particle, for what it does next."""
    rows, p, contacts = lanes.rows, index(lanes.particle[i]), share.state.contacts
    v, keep = column(rows, V, i), rows[KEEP, i]
    slid = phase != FLYING and phase != CAREFUL
    if keep > 0.0 and not (slid and rows[LEFT, i] > 0.0):
        held = slides.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
        taken = slides.split_at(held, chain, column(rows, R, i), v)
        v = v + keep * slides.inward(held, taken.n, taken.m)
    if phase == FLYING:
        v = events.off_the_wall(chain, rows[WALL, i], column(rows, R, i), v)
    put(share.state.position, 0, p, column(rows, R, i))
    put(share.state.velocity, 0, p, v)
    contacts.walls[0, p] = rows[WALL, i] if slid else -1.0
    contacts.walls[1, p] = rows[WALL + 1, i] if slid else -1.0
    if phase != ARRIVED:
        contacts.phase[p] = phase if slid else FLYING
    elif contacts.phase[p] != ARRIVED:
        contacts.phase[p] = _phase(kind)
    contacts.left[p] = rows[LEFT, i] if phase != ARRIVED else 0.0
    contacts.step[p] = rows[STEP, i] if slid else 0.0
    contacts.keep[p] = keep
    share.phase[p] = phase
    share.pending[phase] += 1


@inlined
def _move(lanes, source, target):
    """The last live lane into the free slot."""
    for row in range(R1):
        lanes.rows[row, target] = lanes.rows[row, source]
    lanes.rows[TRIALS, target] = lanes.rows[TRIALS, source]
    lanes.particle[target] = lanes.particle[source]


# --- Events ----------------------------------------------------------------------------------------------


@outlined
def _decide(kind, method, chain, gravity, state, lanes, i):
    """What a lane does whose step may not be taken as it is.

    The step is cut where the event is, and taken again, until the event is at its start.
    """
    rows, event, h = lanes.rows, lanes.event[i], lanes.rows[H, i]
    if event & STOPPED:
        # All that is above the potential energy, down to what round-off has added to the kinetic one.
        lost = rows[TWICE, i] - 2.0 * potential(gravity, column(rows, R, i))
        rows[TWICE, i] -= lost
        _lose(state, lanes, i, lost)
        rows[KEEP, i] = 0.0
        put(rows, V, i, ZERO)
        return _set_going(kind, method, chain, gravity, state, lanes, i)
    if event & STUCK:
        return _give_up(state, lanes, i)
    if event & FAILED:
        return _shorten(kind, method, chain, state, lanes, i)
    held = slides.of_lane(kind, rows[WALL, i], rows[WALL + 1, i])
    r, v = column(rows, R, i), column(rows, V, i)
    cut = 1.0
    if event & LIFTED:
        particle = events.Particle(r, v, rows[LEFT, i], rows[TWICE, i], rows[SCALE2, i])
        phase, cut = _lift(kind, lanes, i, events.weightless(method, gravity, particle))
        if phase != _phase(kind):
            return phase
    if event & MET:
        path = slides.Path(r, v, column(rows, R1, i), column(rows, V1, i), h)
        met = events.arrival(chain, 0.0, held, path, events.near(method, r))
        if met.time == 0.0:
            state.contacts.met[lanes.particle[i]] = met.wall
            put(rows, R, i, walls.settle(chain, met.wall, r))
            return EVENT
        cut = min(cut, met.time)
    if not cut < 1.0:
        # It passes near a wall.
        return _take(kind, method, chain, gravity, state, lanes, i)
    rows[CUT, i] = cut * h
    rows[TRIALS, i] += 1.0
    return _phase(kind) if rows[TRIALS, i] <= _MOST_TRIALS else _give_up(state, lanes, i)


@outlined
def _take(kind, method, chain, gravity, state, lanes, i):
    """Take a step after all."""
    rows = lanes.rows
    put(rows, R, i, column(rows, R1, i))
    put(rows, V, i, column(rows, V1, i))
    rows[LEFT, i], rows[CUT, i] = rows[LEFT, i] - rows[H, i], np.inf
    rows[TWICE, i] -= rows[WORK, i]
    lanes.moving[i] = True
    _account(method, state, lanes, i)
    return _set_going(kind, method, chain, gravity, state, lanes, i)


@inlined
def _give_up(state, lanes, i):
    """Leave a lane to the careful way: it is at an apex, or where the walls have no edge."""
    state.contacts.met[lanes.particle[i]] = lanes.rows[WALL, i]
    return CAREFUL


@outlined
def _shorten(kind, method, chain, state, lanes, i):
    """A lane whose step has no solution: a shorter one, or none over the edge of a solid, beyond which is no wall."""
    rows, h = lanes.rows, lanes.rows[H, i]
    rows[STEP, i], rows[CUT, i] = _RETRY * h, np.inf
    if h > _SHORTEST * method.size / math.sqrt(rows[SCALE2, i]):
        return _phase(kind)
    end = column(rows, R, i) + h * column(rows, V, i)
    if walls.outside(chain, -1.0, end) or not h > 0.0:
        return _give_up(state, lanes, i)
    put(rows, R, i, end)
    rows[LEFT, i] -= h
    return FLYING


@by_type
def _lift(kind, lanes, i, none):
    """What a lane does that its walls let go now, or the part of the step after which they do: (phase, part)."""
    rows = lanes.rows
    if rows[PRESS, i] <= none:
        return FLYING, 0.0
    return _phase(kind), _part(rows[PRESS, i], rows[PRESS1, i])


@_lift.register(slides.Two)
def _(kind, lanes, i, none):
    rows = lanes.rows
    if rows[PRESS, i] <= none and rows[PRESS1, i] < 0.0:
        rows[WALL, i] = rows[WALL + 1, i]
        rows[WALL + 1, i] = -1.0
        return HELD, 0.0
    if rows[PRESS + 1, i] <= none and rows[PRESS1 + 1, i] < 0.0:
        rows[WALL + 1, i] = -1.0
        return HELD, 0.0
    return _phase(kind), min(_part(rows[PRESS, i], rows[PRESS1, i]), _part(rows[PRESS + 1, i], rows[PRESS1 + 1, i]))


@inlined
def _part(start, end):
    """Where a straight line from `start` falls through 0, if it does."""
    return start / (start - end) if end < 0.0 else 1.0

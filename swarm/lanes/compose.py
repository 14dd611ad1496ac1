"""One composed step of every lane that slides: loops without branches, and what the step may end with."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..contact import crossing, hold
from ..contact import laws as wall_laws
from ..contact import sliding as slides
from ..contact.passing import may_pass
from ..contact.reflection import relative, wall_velocity
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import Array, by_type, inlined, outlined, select
from ..kernel.vector import ZERO, column, either, put, square
from ..methods import contract as methods
from ..surfaces import fold as walls
from ..surfaces.moving import at, during
from ..surfaces.period import is_beyond
from .arrays import STRIDE, table

# What a lane holds: position, velocity and acceleration, what presses on its walls, the time left, the next step, the
# speed it keeps across the walls, twice its energy, the square of its speed scale, its walls, and where a step is cut.
R, V, A, PRESS, LEFT, STEP, KEEP, TWICE, SCALE2, WALL, CUT = 0, 3, 6, 9, 11, 12, 13, 14, 15, 16, 18
# The step of this pass: its length, how far the composition has come, what presses at its end, its impulses, the work
# of friction, by how much it may be off, and by how much the last sweep but one.
H, R1, V1, PRESS1, IMPULSE, WORK, ALLOWED, STILL = 19, 20, 23, 26, 28, 30, 31, 32
# The part of the composition under way: w0, the last guess of its end, the direction in which it slides; the changes of
# velocity that the accelerations of the last two parts would make in the whole step; how often the step has been cut;
# twice the work of the second wall, where walls move.
W, END, TOWARD, CHANGE, BEFORE, TRIALS, GIVEN = 33, 36, 39, 42, 45, 48, 49
# The particle and the time left when all lanes were looked at last.
LOOKED, ROWS = 50, 52
# A step of this part of a crossing, or of the size, is the shortest.
SHORTEST, _NO_WAY = 1e-10, 1e-15
# Friction has stopped a particle where this part of |v|^2 is left.
SLOWEST = 1e-24


class Lanes(NamedTuple):
    """Arrays of one column a lane."""

    rows: Array  # (ROWS, stride)
    particle: Array  # int64
    unsolved: Array  # bool, whether the sweeps of a step go on; at its end, whether it is taken
    event: Array  # int64, what the step of this pass may end with
    gained: Array  # twice what walls that move give in the step of this pass, per mass
    after: Array  # twice the energy per mass at its end
    period: Any  # the cell where it repeats
    openings: Any  # of the walls, or None


# What a step may end with.
LIFTED, MET, FAILED, STOPPED, STUCK, LEAVES, PASSES = 1, 2, 4, 8, 16, 32, 64


def empty(period: Any = None, openings: Any = None) -> Lanes:
    """Lanes for one block."""
    return Lanes(
        table(ROWS),
        np.zeros(STRIDE, np.int64),
        np.zeros(STRIDE, np.bool_),
        np.zeros(STRIDE, np.int64),
        table(1)[0],
        table(1)[0],
        period,
        openings,
    )


# --- One composed step of every lane ---------------------------------------------------------------------


@inlined
def _start(method, chain, gravity, lanes, live):
    """How long the step of every live lane is, by how much it may be off, and from where it goes."""
    rows, friction, tolerance = lanes.rows, methods.friction(method), methods.sliding_tolerance(method)
    moving = wall_laws.moving(methods.laws(method))
    for i in range(live):
        v, a = column(rows, V, i), column(rows, A, i)
        h = select(rows[STEP, i] < rows[LEFT, i], rows[STEP, i], rows[LEFT, i])
        h = select(rows[CUT, i] < h, rows[CUT, i], h)
        r = column(rows, R, i)
        stop = _longest(moving, friction, at(chain, rows[LEFT, i]), rows[WALL, i], (r, v, a))
        h = select(stop < h, stop, h)
        # The tolerance is that of a crossing at the speed, or in the pull along the walls, that the particle has now.
        speed = math.sqrt(0.5 * (square(v) + math.sqrt(square(a)) * method.size))
        rows[H, i], rows[ALLOWED, i] = h, tolerance * speed * h
        taken = accelerated(gravity, ZERO, 1.0) - a
        rows[STILL, i] = slides.still(r, v, h * taken, rows[ALLOWED, i])
        put(rows, R1, i, r)
        put(rows, V1, i, v)
        put(rows, CHANGE, i, h * a)
        put(rows, BEFORE, i, h * a)
        rows[IMPULSE, i], rows[IMPULSE + 1, i], rows[WORK, i], rows[GIVEN, i] = 0.0, 0.0, 0.0, 0.0
        lanes.event[i] = 0


@by_type
def _longest(moving, friction, chain, wall, motion):
    """A time within which a particle that slides with friction surely does not stop on its first wall."""
    _r, v, a = motion
    return slides.longest(friction, v, a)


@_longest.register(wall_laws.Moves)
def _(moving, friction, chain, wall, motion):
    r, v, a = motion
    return slides.longest(friction, v - walls.velocity(chain, wall, r), a - walls.acceleration(chain, wall, r))


@inlined
def compose(kind, method, chain, gravity, lanes, live):
    """One composed step of every live lane, from its R, V and A to its R1 and V1."""
    rows, unsolved, friction = lanes.rows, lanes.unsolved, methods.friction(method)
    rubs, moving = friction is not None, wall_laws.moving(methods.laws(method))
    _start(method, chain, gravity, lanes, live)
    for k in range(slides.PARTS):
        for i in range(live):
            r, v, h = column(rows, R1, i), column(rows, V1, i), slides.part(k) * rows[H, i]
            now = at(chain, rows[LEFT, i] - slides.before(k) * rows[H, i])
            last = column(rows, CHANGE, i)
            change = last + slides.lead(k) * (last - column(rows, BEFORE, i))
            put(rows, BEFORE, i, last)
            put(rows, END, i, r + h * (v + (0.5 * slides.part(k)) * change))
            if rubs:
                u = wall_velocity(moving, now, rows[WALL, i], r)
                toward = slides.direction(
                    friction, relative(u, v), _drive(moving, now, rows[WALL, i], r, last, rows[H, i])
                )
                held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
                slowed = slides.slow(friction, held, now, gravity, r, (v, toward, u), 0.5 * h)
                v = slowed.v
                rows[WORK, i] += slowed.lost
                put(rows, TOWARD, i, toward)
            put(rows, W, i, accelerated(gravity, v, 0.5 * h))
            unsolved[i] = True
        for _sweep in range(slides.SWEEPS):
            some = False
            for i in range(live):
                some = _sweep_lane(kind, moving, chain, lanes, i, k) | some
            if not some:
                break
        for i in range(live):
            h, w, v0, r0 = slides.part(k) * rows[H, i], column(rows, W, i), column(rows, V1, i), column(rows, R1, i)
            held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
            left, after = _when(lanes, i, k)
            step, end = during(chain, left, after), column(rows, END, i)
            # The last sweep
            drift = hold.mean_drift(moving, held, step, r0, end, h)
            taken = held.split(step, drift, r0, end, w)
            r, v1 = r0 + h * taken.along, accelerated(gravity, 2.0 * taken.along - w, 0.5 * h)
            if rubs:
                now = at(chain, after)
                u = wall_velocity(moving, now, rows[WALL, i], r)
                slowed = slides.slow(friction, held, now, gravity, r, (v1, column(rows, TOWARD, i), u), 0.5 * h)
                v1 = slowed.v
                rows[WORK, i] += slowed.lost
            put(rows, R1, i, r)
            put(rows, V1, i, v1)
            put(rows, CHANGE, i, slides.inverse_part(k) * (v1 - v0))
            rows[IMPULSE, i] += 2.0 * taken.b
            rows[IMPULSE + 1, i] += 2.0 * taken.c
            rows[GIVEN, i] += hold.given_by_second(drift, taken)
            lanes.event[i] |= select(unsolved[i], FAILED, 0)


@inlined
def _when(lanes, i, k):
    """How much of the frame is left at the start and at the end of part k."""
    left, h = lanes.rows[LEFT, i], lanes.rows[H, i]
    return left - slides.before(k) * h, left - (slides.before(k) + slides.part(k)) * h


@by_type
def _drive(moving, chain, wall, r, change, h):
    """What sets a particle in motion that is at rest on its first wall."""
    return change


@_drive.register(wall_laws.Moves)
def _(moving, chain, wall, r, change, h):
    return change - h * walls.acceleration(chain, wall, r)


@inlined
def _sweep_lane(kind, moving, chain, lanes, i, k):
    """One sweep of a lane that still moves: whether it needs another."""
    rows, unsolved = lanes.rows, lanes.unsolved
    held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
    r0, end, w = column(rows, R1, i), column(rows, END, i), column(rows, W, i)
    left, after = _when(lanes, i, k)
    step = during(chain, left, after)
    swept = slides.sweep(moving, held, step, slides.part(k) * rows[H, i], (r0, end, w), rows[STILL, i])
    on = unsolved[i]
    put(rows, END, i, either(on, swept.r, end))
    more = on & swept.moves
    unsolved[i] = more
    return more


# --- Its end ---------------------------------------------------------------------------------------------


@inlined
def end_steps(kind, method, chain, gravity, lanes, live):
    """Take the steps that are as exact as asked and end without an event; lengthen or shorten the next."""
    rows, laws = lanes.rows, methods.laws(method)
    friction, moving = wall_laws.friction(laws), wall_laws.moving(laws)
    for i in range(live):
        held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
        start, now = at(chain, rows[LEFT, i]), at(chain, rows[LEFT, i] - rows[H, i])
        h, scale2, keep = rows[H, i], rows[SCALE2, i], rows[KEEP, i]
        r0, v0, a0 = column(rows, R, i), column(rows, V, i), column(rows, A, i)
        r1 = held.settle(now, column(rows, R1, i))
        v1 = held.split_at(now, hold.drift(moving, held, now, r1), r1, column(rows, V1, i)).along
        rest = 2.0 * potential(gravity, r1) + keep * keep
        twice = twice_after(moving, rows[TWICE, i] - rows[WORK, i], square(v1) + rest)
        v1 = _restored(moving, v1, twice - rest, scale2)
        force = slides.force(laws, held, now, gravity, r1, v1)
        ratio = slides.error(h, (r0, v0, a0), (r1, v1, force.acceleration), rows[ALLOWED, i])
        path = crossing.Path(r0, v0, r1, v1, h)
        lifted = held.lets_go(force.n, force.m)
        met = crossing.meets(start, now, held, path, crossing.near(method, r1))
        good = (ratio <= 1.0) & (lanes.event[i] == 0)
        leaves = is_beyond(lanes.period, r1)
        passes = may_pass(lanes.openings, held, path)
        fine = good & (not lifted) & (not met) & (not leaves) & (not passes)
        happened = select(lifted, LIFTED, 0) | select(met, MET, 0) | select(leaves, LEAVES, 0)
        happened |= select(passes, PASSES, 0)
        lanes.event[i] |= select(good, happened, 0)
        lanes.unsolved[i] = fine
        # What the end of the frame or an event cuts says nothing of the length; and a step that is to be cut must be
        # found so again after a halt.
        whole = (fine & (h == rows[STEP, i])) | (not (ratio <= 1.0))
        rows[STEP, i] = select(whole, slides.next_step(h, ratio), rows[STEP, i])
        rows[CUT, i] = select(fine, np.inf, rows[CUT, i])
        rows[LEFT, i] -= select(fine, h, 0.0)
        lanes.gained[i], lanes.after[i] = twice + rows[WORK, i] - rows[TWICE, i], twice
        rows[TWICE, i] = select(fine, twice, rows[TWICE, i])
        put(rows, R1, i, r1)
        put(rows, V1, i, v1)
        rows[PRESS1, i], rows[PRESS1 + 1, i] = force.n, force.m
        put(rows, R, i, either(fine, r1, r0))
        put(rows, V, i, either(fine, v1, v0))
        put(rows, A, i, either(fine, force.acceleration, a0))
        rows[PRESS, i] = select(fine, force.n, rows[PRESS, i])
        rows[PRESS + 1, i] = select(fine, force.m, rows[PRESS + 1, i])
        lanes.event[i] |= _stop(friction, fine, relative(wall_velocity(moving, now, rows[WALL, i], r1), v1), scale2)
        # Near an apex steps become shorter without end, in time or, of a slow particle, in length.
        step = rows[STEP, i]
        way2 = step * step * (square(v1) + step * step * square(accelerated(gravity, ZERO, 1.0)))
        short = (step < SHORTEST * method.size / math.sqrt(scale2)) | (way2 < (_NO_WAY * method.size) ** 2)
        lanes.event[i] |= select(short, STUCK, 0)


@by_type
def twice_after(moving, kept, now):
    """Twice the energy per mass after a step: that of before, or what there is where walls do work."""
    return kept


@twice_after.register(wall_laws.Moves)
def _(moving, kept, now):
    return now


@by_type
def _restored(moving, v, speed2, scale2):
    """A velocity with that of its square which the energy says, where walls at rest hold the particle."""
    return slides.restored(v, speed2, scale2)


@_restored.register(wall_laws.Moves)
def _(moving, v, speed2, scale2):
    return v


@by_type
def _stop(friction, fine, v, scale2):
    """Whether friction has stopped a particle."""
    return select(fine & (square(v) <= SLOWEST * scale2), STOPPED, 0)


@_stop.register(type(None))
def _(friction, fine, v, scale2):
    return 0


# --- What it gives ----------------------------------------------------------------------------------------


@inlined
def account(method, chain, state, lanes, i):
    """What a step that is taken gives to the state."""
    rows, p = lanes.rows, lanes.particle[i]
    if not lanes.unsolved[i]:
        return
    state.contacts.sliding[p] += rows[H, i]
    push(chain, state, lanes, i, rows[IMPULSE, i], rows[IMPULSE + 1, i])
    rows[TRIALS, i] = 0.0
    if methods.friction(method) is not None:
        lose(state, lanes, i, rows[WORK, i])
    work(wall_laws.moving(methods.laws(method)), chain, state, lanes, i, lanes.gained[i], rows[GIVEN, i])


@inlined
def push(chain, state, lanes, i, first, second):
    """Impulses per mass to the walls that hold a lane."""
    rows, p = lanes.rows, lanes.particle[i]
    state.impulse[walls.row(chain, rows[WALL, i]), p] += first * state.mass[p]
    if rows[WALL + 1, i] >= 0.0:
        state.impulse[walls.row(chain, rows[WALL + 1, i]), p] += second * state.mass[p]


@by_type
def work(moving, chain, state, lanes, i, twice, second):
    """Book twice the work per mass of walls that move, and of it that of the second wall."""


@work.register(wall_laws.Moves)
def _(moving, chain, state, lanes, i, twice, second):
    rows, p = lanes.rows, lanes.particle[i]
    behind = state.impulse.shape[0] // 2
    state.energy[p] = 0.5 * rows[TWICE, i]
    state.impulse[behind + walls.row(chain, rows[WALL, i]), p] += 0.5 * (twice - second) * state.mass[p]
    if rows[WALL + 1, i] >= 0.0:
        state.impulse[behind + walls.row(chain, rows[WALL + 1, i]), p] += 0.5 * second * state.mass[p]


@inlined
def lose(state, lanes, i, twice):
    """Book twice the energy per mass that a lane has lost; its row knows what is left."""
    p = lanes.particle[i]
    state.energy[p] = 0.5 * lanes.rows[TWICE, i]
    state.dissipated[p] += 0.5 * twice * state.mass[p]


@outlined
def with_kept(kind, chain, lanes, i):
    """The velocity of a lane with the speed that it keeps across its walls."""
    rows, v, keep = lanes.rows, column(lanes.rows, V, i), lanes.rows[KEEP, i]
    if not keep > 0.0:
        return v
    held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
    taken = held.split_at(chain, None, column(rows, R, i), v)
    return v + keep * held.inward(taken.n, taken.m)

"""Particles that slide, a block of them at once, in lanes: one kernel for one wall, one for the edges of two.

One pass is one composed step of every lane, in loops without branches. What a step may end with (the wall lets go,
another wall is met, the particle stops) is found one lane at a time: the step is cut there and taken again, so that it
ends at the instant to round-off. A lane writes what it gives its walls step by step, so that a halt changes no bit.
"""

import math

import numpy as np

from ..contact import crossing, events, hold
from ..contact import laws as wall_laws
from ..contact import sliding as slides
from ..contact.events import ARRIVED, CAREFUL, EVENT, FLYING, HELD
from ..contact.passing import part_until_open
from ..contact.reflection import wall_velocity
from ..kernel.gravity import potential
from ..kernel.jit import by_type, index, inlined, long_kernel, outlined
from ..kernel.vector import ZERO, column, put, square
from ..methods import contract as methods
from ..status import Status
from ..surfaces import fold as walls
from ..surfaces.moving import at
from ..surfaces.period import part_until
from .arrays import LANES, LOOK, following_particle, goes_on_by, speed2_scale, with_distances
from .compose import (
    CUT,
    FAILED,
    KEEP,
    LEAVES,
    LEFT,
    LIFTED,
    LOOKED,
    MET,
    PASSES,
    PRESS,
    PRESS1,
    R1,
    SCALE2,
    SHORTEST,
    STEP,
    STOPPED,
    STUCK,
    TRIALS,
    TWICE,
    V1,
    WALL,
    WORK,
    A,
    H,
    R,
    V,
    account,
    compose,
    end_steps,
    lose,
    push,
    twice_after,
    with_kept,
    work,
)  # fmt: skip
from .escape import is_at_opening
from .stay import AGAIN, phase_of, stay
from .wrap import return_particle, return_sliding

# Times that a step is cut before the lane is given up: it takes four or so.
_MOST_TRIALS = 100
# The first step of a particle that begins to slide, in crossings; the walls correct it.
_FIRST = 1e-3
# A step that is tried again is so much shorter.
_RETRY = 0.25


@long_kernel
def slide_block(kind, method, chain, gravity, share, lanes):
    """Advance the particles of this kind, `One` or `Two`, that a thread draws: (status, particle, drawn).

    Each until it has arrived, flies, or is held by other walls; `share.pending` counts what is left to other kernels.
    """
    lanes = with_distances(lanes)
    following, stop, drawn, live, passes = 0, 0, 0, 0, 0
    while live < LANES:
        following, stop, drawn, loaded = _refill(
            kind, method, chain, gravity, share, lanes, live, (following, stop, drawn, passes)
        )
        if not loaded:
            break
        lanes.rows[LOOKED, live] = -1.0
        live += 1
    moving = wall_laws.moving(methods.laws(method))
    while live > 0:
        status, particle = _over(method, share, lanes, live, passes)
        if status != Status.DONE.value:
            _leave(kind, moving, chain, share, lanes, live)
            return status, particle, drawn
        passes += 1
        compose(kind, method, chain, gravity, lanes, live)
        end_steps(kind, method, chain, gravity, lanes, live)
        for i in range(live):
            account(method, chain, share.state, lanes, i)
        # From the last, so that every lane behind one that leaves is still under way, and may take its place.
        for i in range(live - 1, -1, -1):
            phase = _next_phase(kind, method, chain, gravity, share.state, lanes, i)
            phase = return_sliding(lanes.period, chain, share.state, lanes, i, phase)
            if phase != phase_of(kind):
                _retire(kind, moving, chain, share, lanes, i, phase)
                following, stop, drawn, loaded = _refill(
                    kind, method, chain, gravity, share, lanes, i, (following, stop, drawn, passes)
                )
                if not loaded:
                    live -= 1
                    _move(lanes, live, i)
    # A halt may have kept it from loading more.
    return (Status.INTERRUPTED.value if passes >= share.halt[0] else Status.DONE.value), 0, drawn


@outlined
def _over(method, share, lanes, live, passes):
    """Whether the call ends before the next pass: (status, particle), a halt or one that got nowhere since a look."""
    if passes >= share.halt[0]:
        return Status.INTERRUPTED.value, 0
    if passes % LOOK != 0:
        return Status.DONE.value, 0
    rows = lanes.rows
    for i in range(live):
        p, left = lanes.particle[i], rows[LEFT, i]
        if rows[LOOKED, i] == float(p) and goes_on_by(method, column(rows, V, i), left) >= rows[LOOKED + 1, i] - left:
            return Status.TIMELESS.value, p
        rows[LOOKED, i], rows[LOOKED + 1, i] = float(p), left
    return Status.DONE.value, 0


@outlined
def _leave(kind, moving, chain, share, lanes, live):
    """The live lanes back into their particles, which go on when the frame does."""
    for i in range(live):
        _retire(kind, moving, chain, share, lanes, i, phase_of(kind))


@outlined
def _refill(kind, method, chain, gravity, share, lanes, lane, at):
    """The next particle that slides into a lane: (particle, stop, draws) to go on from, and whether there is one.

    None after a halt: what is loaded may rest or fly at once, one particle after the other.
    """
    following, stop, drawn, passes = at
    while True:
        if passes >= share.halt[0]:
            return following, stop, drawn, False
        following, stop, drawn = following_particle(share, phase_of(kind), following, stop, drawn)
        if following == stop:
            return following, stop, drawn, False
        following += 1
        if _load(kind, method, chain, gravity, share, lanes, lane, following - 1):
            return following, stop, drawn, True


@inlined
def _next_phase(kind, method, chain, gravity, state, lanes, i):
    """What a lane does after a step."""
    phase = phase_of(kind)
    if lanes.event[i] != 0:
        phase = _decide(kind, method, chain, gravity, state, lanes, i)
    return phase if lanes.rows[LEFT, i] > 0.0 else ARRIVED


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
        held, now = kind.of_lane(rows[WALL, lane], rows[WALL + 1, lane]), at(chain, left)
        # Frames show the speed that is kept across the walls too.
        v = held.split_at(now, hold.drift(wall_laws.moving(methods.laws(method)), held, now, r), r, v).along
    put(rows, R, lane, r)
    put(rows, V, lane, v)
    phase = _set_going(kind, method, chain, gravity, state, lanes, lane)
    if phase != phase_of(kind):
        _retire(kind, wall_laws.moving(methods.laws(method)), chain, share, lanes, lane, phase)
        return False
    return True


@outlined
def _set_going(kind, method, chain, gravity, state, lanes, i):
    """The forces on a lane at the start of its next step; what it does next, which may be to rest."""
    rows, laws = lanes.rows, methods.laws(method)
    held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
    r, v, left = column(rows, R, i), column(rows, V, i), rows[LEFT, i]
    now = at(chain, left)
    if is_at_opening(lanes.openings, kind, method, now, state, lanes, i):
        return EVENT
    force = slides.force(laws, held, now, gravity, r, v)
    put(rows, A, i, force.acceleration)
    rows[PRESS, i], rows[PRESS + 1, i] = force.n, force.m
    if not rows[STEP, i] > 0.0:
        rows[STEP, i] = _FIRST * method.size / np.sqrt(rows[SCALE2, i])
    if wall_laws.moving(laws) is not None:
        return stay(wall_laws.moving(laws), kind, method, chain, gravity, state, lanes, i)
    if square(v) == 0.0 and events.rests(gravity, force):
        p, contacts = lanes.particle[i], state.contacts
        contacts.sliding[p] += left
        contacts.phase[p], contacts.load[walls.row(chain, rows[WALL, i]), p] = ARRIVED, force.n
        if rows[WALL + 1, i] >= 0.0:
            contacts.load[walls.row(chain, rows[WALL + 1, i]), p] = force.m
        push(chain, state, lanes, i, force.n * left, force.m * left)
        rows[LEFT, i] = 0.0
        return ARRIVED
    return phase_of(kind)


@outlined
def _retire(kind, moving, chain, share, lanes, i, phase):
    """A lane back into its particle, for what it does next."""
    rows, p, contacts = lanes.rows, index(lanes.particle[i]), share.state.contacts
    if phase == AGAIN:
        phase = phase_of(kind)
    v, keep = column(rows, V, i), rows[KEEP, i]
    slid = phase != FLYING and phase != CAREFUL
    if not (slid and rows[LEFT, i] > 0.0):
        v = with_kept(kind, at(chain, rows[LEFT, i]), lanes, i)
    if phase == FLYING:
        now, r = at(chain, rows[LEFT, i]), column(rows, R, i)
        v = events.off_the_wall(now, rows[WALL, i], r, v, wall_velocity(moving, now, rows[WALL, i], r))
    put(share.state.position, 0, p, column(rows, R, i))
    put(share.state.velocity, 0, p, v)
    contacts.walls[0, p] = rows[WALL, i] if slid else -1.0
    contacts.walls[1, p] = rows[WALL + 1, i] if slid else -1.0
    if phase != ARRIVED:
        contacts.phase[p] = phase if slid else FLYING
    elif contacts.phase[p] != ARRIVED:
        contacts.phase[p] = phase_of(kind)
    contacts.left[p] = rows[LEFT, i] if phase != ARRIVED else 0.0
    contacts.step[p] = rows[STEP, i] if slid else 0.0
    contacts.keep[p] = keep
    return_particle(lanes.period, chain, share.state, p)
    share.phase[p] = phase
    share.pending[phase] += 1


@inlined
def _move(lanes, source, target):
    """The last live lane into the free slot."""
    for row in range(R1):
        lanes.rows[row, target] = lanes.rows[row, source]
    for row in (TRIALS, LOOKED, LOOKED + 1):
        lanes.rows[row, target] = lanes.rows[row, source]
    lanes.particle[target] = lanes.particle[source]


# --- Events ----------------------------------------------------------------------------------------------


@outlined
def _decide(kind, method, chain, gravity, state, lanes, i):
    """What a lane does whose step may not be taken as it is.

    The step is cut where the event is, and taken again, until the event is at its start.
    """
    rows, event, h = lanes.rows, lanes.event[i], lanes.rows[H, i]
    if event & STOPPED:
        _stop(wall_laws.moving(methods.laws(method)), chain, gravity, state, lanes, i)
        return _set_going(kind, method, chain, gravity, state, lanes, i)
    if event & STUCK:
        return _give_up(state, lanes, i)
    if event & FAILED:
        return _shorten(kind, method, chain, state, lanes, i)
    held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
    r, v = column(rows, R, i), column(rows, V, i)
    cut = 1.0
    if event & LIFTED:
        particle = events.Particle(r, v, rows[LEFT, i], rows[TWICE, i], rows[SCALE2, i])
        phase, cut = _lift(kind, lanes, i, events.weightless(method, gravity, particle))
        if phase != phase_of(kind):
            return phase
    if event & MET:
        path = crossing.Path(r, v, column(rows, R1, i), column(rows, V1, i), h)
        met = crossing.arrival(chain, held, path, crossing.near(method, r), rows[LEFT, i])
        # At once, or so soon that the time left does not change.
        if rows[LEFT, i] - met.time * h == rows[LEFT, i]:
            state.contacts.met[lanes.particle[i]] = met.wall
            put(rows, R, i, walls.settle(at(chain, rows[LEFT, i]), met.wall, r))
            return EVENT
        cut = min(cut, met.time)
    if event & (LEAVES | PASSES):
        path = crossing.Path(r, v, column(rows, R1, i), column(rows, V1, i), h)
        cut = min(cut, part_until(lanes.period, crossing.cubic(path)))
        cut = min(
            cut, part_until_open(lanes.openings, method, at(chain, rows[LEFT, i]), held, path, crossing.near(method, r))
        )
    if not cut < 1.0:
        # It passes near a wall.
        return _take(kind, method, chain, gravity, state, lanes, i)
    rows[CUT, i] = cut * h
    rows[TRIALS, i] += 1.0
    return phase_of(kind) if rows[TRIALS, i] <= _MOST_TRIALS else _give_up(state, lanes, i)


@by_type
def _stop(moving, chain, gravity, state, lanes, i):
    """Friction has stopped a lane."""
    rows = lanes.rows
    # All that is above the potential energy, down to what round-off has added to the kinetic one.
    lost = rows[TWICE, i] - 2.0 * potential(gravity, column(rows, R, i))
    rows[TWICE, i] -= lost
    lose(state, lanes, i, lost)
    rows[KEEP, i] = 0.0
    put(rows, V, i, ZERO)


@_stop.register(wall_laws.Moves)
def _(moving, chain, gravity, state, lanes, i):
    rows, r, v = lanes.rows, column(lanes.rows, R, i), column(lanes.rows, V, i)
    u = walls.velocity(at(chain, rows[LEFT, i]), rows[WALL, i], r)
    lost, twice = square(v - u) + rows[KEEP, i] * rows[KEEP, i], square(u) + 2.0 * potential(gravity, r)
    given = twice - rows[TWICE, i] + lost
    rows[TWICE, i], rows[KEEP, i] = twice, 0.0
    lose(state, lanes, i, lost)
    work(moving, chain, state, lanes, i, given, 0.0)
    put(rows, V, i, u)


@outlined
def _take(kind, method, chain, gravity, state, lanes, i):
    """Take a step after all."""
    rows = lanes.rows
    put(rows, R, i, column(rows, R1, i))
    put(rows, V, i, column(rows, V1, i))
    rows[LEFT, i], rows[CUT, i] = rows[LEFT, i] - rows[H, i], np.inf
    rows[TWICE, i] = twice_after(wall_laws.moving(methods.laws(method)), rows[TWICE, i] - rows[WORK, i], lanes.after[i])
    lanes.unsolved[i] = True
    account(method, chain, state, lanes, i)
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
    if h > SHORTEST * method.size / math.sqrt(rows[SCALE2, i]):
        return phase_of(kind)
    end = column(rows, R, i) + h * column(rows, V, i)
    if walls.outside(at(chain, rows[LEFT, i] - h), -1.0, end) or not h > 0.0:
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
    return phase_of(kind), _part(rows[PRESS, i], rows[PRESS1, i])


@_lift.register(hold.Two)
def _(kind, lanes, i, none):
    rows = lanes.rows
    if rows[PRESS, i] <= none and rows[PRESS1, i] < 0.0:
        rows[WALL, i] = rows[WALL + 1, i]
        rows[WALL + 1, i] = -1.0
        return HELD, 0.0
    if rows[PRESS + 1, i] <= none and rows[PRESS1 + 1, i] < 0.0:
        rows[WALL + 1, i] = -1.0
        return HELD, 0.0
    return phase_of(kind), min(_part(rows[PRESS, i], rows[PRESS1, i]), _part(rows[PRESS + 1, i], rows[PRESS1 + 1, i]))


@inlined
def _part(start, end):
    """Where a straight line from `start` falls through 0, if it does."""
    return start / (start - end) if end < 0.0 else 1.0

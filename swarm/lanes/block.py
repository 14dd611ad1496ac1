"""Particles to one time, a block of them at once, in lanes.

One pass does one flight and one contact for every live lane, in loops without branches, which LLVM vectorises. Lanes
that reached the frame time retire, and the next particle, or the last live lane, takes their slot. The result does not
depend on which lane or block a particle is in.
"""

from typing import NamedTuple

from ..kernel.gravity import Gravity, Nothing
from ..kernel.jit import by_type, by_type_outlined, index, inlined, kernel, select
from ..methods import base as methods
from ..status import Status
from ..surfaces import chain as walls
from ..surfaces import flights
from ..surfaces.course import MORE_STEPS, SAFE_STEPS
from .arrays import (
    EIGHT,
    HITS,
    K0,
    K1,
    K2,
    LANES,
    LEFT,
    VX,
    VY,
    VZ,
    X,
    Y,
    Z,
    count_sweeps,
    following_particle,
    keep_failure,
    leave,
    load,
    move,
    retire,
    with_distances,
)
from .solve import solution, solve

# Impacts of one particle in one frame after which it is given up: seconds, not hours, in a cusp.
MOST_HITS = 1e8
# Passes after which a call of `advance_block` that nobody halts would return.
NEVER = 2**63 - 1


class Hard(NamedTuple):
    """With it a kernel can do hard contacts: half of what there is to compile, and seldom met in a smooth cavity."""

    most_hits: float


@kernel
def advance_block(method, chain, gravity, hard, state, done, halted, span, draws, halt, lanes):
    """Advance what `draws` gives by `span` and return (status, particle, drawn): DONE, or the first that failed.

    `drawn` is how many draws that were; `span` is in the method's unit; `lanes` are any. After `halt[0]` passes, which
    another thread may change at any time, it ends before the next: (INTERRUPTED, live lanes, drawn), and
    `lanes.left_behind` has what these held, which the next call takes as `halted`. Particles that are `done` are left
    alone, and those that arrive become it: where `hard` is None, the first hard contact ends it with HARD_CONTACT, to
    go on from there with what can do it.
    """
    lanes = with_distances(lanes)
    following, stop, drawn, live, passes = 0, 0, 0, 0, 0
    while live < LANES:
        following, stop, drawn = following_particle(draws, done, following, stop, drawn)
        if following == stop:
            break
        load(method, chain, lanes, index(live), state, halted, following, span)
        following += 1
        live += 1
    while live > 0:
        if passes >= halt[0]:
            leave(lanes, live)
            return Status.INTERRUPTED.value, live, drawn
        passes += 1
        some_arrived, some_hard = _pass(method, chain, gravity, state.multipliers, lanes, live)
        if some_hard:
            status, lane = _hard_passes(hard, method, chain, gravity, lanes, live)
            if status != Status.DONE.value:
                keep_failure(state.multipliers, lanes, lane)
                return status, lanes.particle[lane], drawn
        count_sweeps(state.multipliers, lanes, live)
        if not (some_arrived or some_hard):
            continue
        # From the last, so that every lane behind one that has arrived is still under way, and may take its place.
        for k in range(_marked(lanes, live) - 1, -1, -1):
            lane = index(lanes.order[k])
            retire(method, chain, lanes, lane, state)
            done[index(lanes.particle[lane])] = True
            following, stop, drawn = following_particle(draws, done, following, stop, drawn)
            if following < stop:
                load(method, chain, lanes, lane, state, halted, following, span)
                following += 1
            else:
                live -= 1
                move(chain, lanes, live, lane)
    return Status.DONE.value, 0, drawn


@inlined
def _marked(lanes, live):
    """How many lanes are marked; which, is in `order`.

    Without a branch: which lanes arrive no processor foresees, and each wrong guess costs some 6 ns. All lanes one by
    one were an eighth of the time of a frame with 75 impacts.
    """
    marked, order, some, count = lanes.marked, lanes.order, lanes.some, index(0)
    eights = 0
    for k in range((live + EIGHT - 1) // EIGHT):
        some[eights] = k
        eights += lanes.eights[k] != 0
    for k in range(eights):
        first = EIGHT * some[k]
        for lane in range(first, min(first + EIGHT, live)):
            order[count] = lane
            count += index(marked[lane])
    return int(count)


@inlined
def _pass(method, chain, gravity, multipliers, lanes, live):
    """A flight and a contact of every lane: (whether one reached the end of the frame, whether one is hard)."""
    _fly(gravity, method, chain, lanes, live)
    unknown, rows = methods.unknown(method), lanes.rows
    solve(unknown, method, chain, gravity, multipliers, lanes, live)
    some_arrived, some_hard = False, False
    for i in range(live):
        arrived, hard = _end(
            method, chain, lanes, i,
            methods.contact(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], rows[K1, i], rows[K2, i], lanes.surface[i],
                *solution(unknown, method, lanes, i),
            ),
        )  # fmt: skip
        some_arrived, some_hard = some_arrived | arrived, some_hard | hard
    return some_arrived, some_hard


@by_type
def _fly(gravity, method, chain, lanes, live):
    """Every lane to its next contact, or to the end of the frame.

    A shorter loop has more lanes under way in a processor, a longer one writes less. Measured in a sphere, nanoseconds
    an impact: first hit, flight and contact in one loop 7.2, a loop for each 5.2; now that there is less to do, flight
    and contact in one loop 3.6, first hit and flight 3.3 (an ellipsoid 4.4, 3.9). The safe steps of a fall in one loop
    110, a loop for each 35. (With |v|^2 and 1/|v|^2 kept a lane no less, and their round-off is that of every flight of
    a particle: the angular momentum in a sphere drifted five times as fast.)
    """


@_fly.register(Nothing)
def _(gravity, method, chain, lanes, live):
    rows = lanes.rows
    for i in range(live):
        time, wall = 0.0, 0.0
        if methods.seeks(method):
            time, wall = flights.first_hit(
                chain, gravity, rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i]
            )
        _flight(method, chain, gravity, lanes, i, time, wall)


@_fly.register(Gravity)
def _(gravity, method, chain, lanes, live):
    if methods.seeks(method):
        _fall(chain, gravity, lanes, live)
    for i in range(live):
        time, wall = 0.0, 0.0
        if methods.seeks(method):
            time, wall = flights.end_fall(chain, lanes.course, 0, i)
        _flight(method, chain, gravity, lanes, i, time, wall)


@inlined
def _fall(chain, gravity, lanes, live):
    """The course of every lane to its first hit, by safe steps."""
    rows, course, marked = lanes.rows, lanes.course, lanes.marked
    for i in range(live):
        flights.begin_fall(
            chain, course, 0, i,
            rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
            gravity.x, gravity.y, gravity.z,
        )  # fmt: skip
    for _step in range(SAFE_STEPS):
        for i in range(live):
            flights.step_fall(chain, course, 0, i)
    # The few that need more, one by one: a flight in two parts would look like a short one.
    for i in range(live):
        marked[i] = _needs_more(chain, lanes, i)
    for k in range(_marked(lanes, live)):
        lane = lanes.order[k]
        for _step in range(MORE_STEPS):
            flights.step_fall(chain, course, 0, lane)
            if not _needs_more(chain, lanes, lane):
                break


@inlined
def _needs_more(chain, lanes, i):
    """Whether more safe steps may find a hit in this frame."""
    time, wall = flights.end_fall(chain, lanes.course, 0, i)
    return (wall < 0.0) & (time < lanes.rows[LEFT, i])


@inlined
def _flight(method, chain, gravity, lanes, i, time, wall):
    """A lane to its next contact, `time` from here at `wall` if the method seeks it, or to the end of the frame."""
    rows = lanes.rows
    x, y, z, vx, vy, vz, left, lanes.surface[i] = methods.flight(
        method, chain, gravity,
        rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
        rows[LEFT, i], rows[K0, i], rows[K1, i], rows[K2, i], time, wall, rows[HITS, i],
    )  # fmt: skip
    _put(lanes, i, x, y, z, vx, vy, vz, left)


@inlined
def _end(method, chain, lanes, i, contact):
    """What the contact made of a lane: (whether it reached the end of the frame, whether it is hard)."""
    x, y, z, vx, vy, vz, left, wall, given, hits, energy = contact
    _put(lanes, i, x, y, z, vx, vy, vz, left)
    _count(method, lanes, i, left, hits, energy)
    lanes.surface[i] = wall
    _add_impulse(chain.rest, chain, lanes.impulse, i, wall, given)
    return not (left > 0.0), wall <= methods.HARD


@inlined
def _put(lanes, i, x, y, z, vx, vy, vz, left):
    """Where a lane is now, and how much of its frame is left."""
    rows = lanes.rows
    rows[X, i], rows[Y, i], rows[Z, i] = x, y, z
    rows[VX, i], rows[VY, i], rows[VZ, i] = vx, vy, vz
    rows[LEFT, i] = left


@inlined
def _count(method, lanes, i, left, hits, energy):
    """What a contact counts, whether the lane has arrived, and the energy where contacts may lose some."""
    rows = lanes.rows
    rows[HITS, i] += hits
    if methods.dissipates(method):
        rows[K0, i] = energy
    lanes.marked[i] = not (left > 0.0)


@by_type
def _add_impulse(rest, chain, impulse, lane, surface, given):
    """impulse[surface, lane] += given, without a branch; a loop over rows here would not vectorise."""


@_add_impulse.register(Nothing)
def _(rest, chain, impulse, lane, surface, given):
    # One wall: what is given is 0, or it is given by that.
    impulse[0, lane] += given


@_add_impulse.register(walls.Chain)
def _(rest, chain, impulse, lane, surface, given):
    _add_to(chain, impulse, 0, lane, surface, given)


@by_type
def _add_to(chain, impulse, row, lane, surface, given):
    """The same for the walls from `row` on."""


@_add_to.register(walls.Chain)
def _(chain, impulse, row, lane, surface, given):
    impulse[row, lane] += select(surface == 0.0, given, 0.0)
    _add_to(chain.rest, impulse, row + 1, lane, surface - 1.0, given)


@_add_to.register(Nothing)
def _(chain, impulse, row, lane, surface, given):
    pass


@by_type_outlined
def _hard_passes(hard, method, chain, gravity, lanes, live):
    """The hard lanes, one by one: (worst status, its lane)."""
    raise NotImplementedError


@_hard_passes.register(Nothing)
def _(hard, method, chain, gravity, lanes, live):
    return Status.HARD_CONTACT.value, 0


@_hard_passes.register(Hard)
def _(hard, method, chain, gravity, lanes, live):
    rows, surface = lanes.rows, lanes.surface
    worst, where = 0, 0
    for i in range(live):
        if surface[i] <= methods.HARD:
            x, y, z, vx, vy, vz, left, hits, energy, status = methods.hard_pass(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], rows[K1, i], rows[K2, i], methods.HARD - surface[i],
                lanes.impulse, lanes.record, i,
            )  # fmt: skip
            _put(lanes, i, x, y, z, vx, vy, vz, left)
            _count(method, lanes, i, left, hits, energy)
            if rows[HITS, i] > hard.most_hits:
                status = Status.STALLED.value
            if status > worst:
                worst, where = status, i
    return worst, where

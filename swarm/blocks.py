"""Particles to one time, a block of them at once, in lanes.

One pass does one flight and one contact for every live lane, in loops without branches, which LLVM vectorises. Lanes
that reached the frame time retire, and the next particle, or the last live lane, takes their slot. The result does not
depend on which lane or block a particle is in.
"""

from typing import NamedTuple

from ._jit import by_type, by_type_outlined, inlined, kept, kernel, select
from .gravity import Gravity, Nothing
from .inner_solve import solve
from .lanes import (
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
    lanes_in,
    leave,
    load,
    move,
    retire,
)
from .methods import base as methods
from .status import Status
from .surfaces import chain as walls
from .surfaces import flights
from .surfaces.course import MORE_STEPS, SAFE_STEPS

# Impacts of one particle in one frame after which it is given up: seconds, not hours, in a cusp.
MOST_HITS = 1e8


class Hard(NamedTuple):
    """With it a kernel can do hard contacts: half of what there is to compile, and seldom met in a smooth cavity."""

    most_hits: float


@kernel
def advance_block(method, chain, gravity, hard, state, done, halted, span, draws, halt, room):
    """Advance what `draws` gives by `span` and return (status, particle, drawn): DONE, or the first that failed.

    `drawn` is how many draws that were; `span` is in the method's unit; `room` is any. `halt[0]` set to 1 by another
    thread ends it at its next pass: (INTERRUPTED, live lanes, drawn), and `room` has what these held, which the next
    call takes as `halted`. Particles that are `done` are left alone, and those that arrive become it: where `hard` is
    None, the first hard contact ends it with HARD_CONTACT, to go on from there with what can do it.
    """
    lanes = lanes_in(room, chain)
    following, stop, drawn, live = 0, 0, 0, 0
    while live < LANES:
        following, stop, drawn = following_particle(draws, done, following, stop, drawn)
        if following == stop:
            break
        load(method, lanes, live, state, halted, following, span)
        following += 1
        live += 1
    while live > 0:
        if halt[0] != 0:
            leave(lanes, live, room.left_behind)
            return Status.INTERRUPTED.value, live, drawn
        _fly(method, chain, gravity, lanes, live)
        solve(methods.unknown(method), method, chain, gravity, state.multipliers, lanes, live)
        retired, hard_lanes = _contact(method, chain, gravity, lanes, live)
        if hard_lanes > 0:
            finished, status, lane = _hard_passes(hard, method, chain, gravity, lanes, live)
            if status != Status.DONE.value:
                keep_failure(state.multipliers, lanes, lane)
                return status, lanes.particle[lane], drawn
            retired += finished
        count_sweeps(state.multipliers, lanes, live)
        if retired == 0:
            continue
        # From the last, so that every lane behind one that has arrived is still under way, and may take its place.
        for k in range(_arrivals(lanes, live) - 1, -1, -1):
            lane = lanes.arrived[k]
            retire(method, lanes, lane, state)
            done[lanes.particle[lane]] = True
            following, stop, drawn = following_particle(draws, done, following, stop, drawn)
            if following < stop:
                load(method, lanes, lane, state, halted, following, span)
                following += 1
            else:
                live -= 1
                move(lanes, live, lane)
    return Status.DONE.value, 0, drawn


@inlined
def _arrivals(lanes, live):
    """How many lanes reached the end of the frame; which, is in `arrived`.

    Without a branch: in what order lanes arrive no processor foresees, and each wrong guess costs some 6 ns.
    """
    left, arrived, count = lanes.rows[LEFT], lanes.arrived, 0
    for lane in range(live):
        arrived[count] = lane
        count += not (left[lane] > 0.0)
    return count


@inlined
def _fly(method, chain, gravity, lanes, live):
    """Every lane to its next contact, or to the end of the frame."""
    rows, surface = lanes.rows, lanes.surface
    time, wall = 0.0, 0.0
    if methods.seeks(method):
        _seek(gravity, chain, lanes, live)
    for i in range(live):
        if methods.seeks(method):
            time, wall = lanes.time[i], kept(surface[i])
        x, y, z, vx, vy, vz, left, surface[i] = methods.flight(
            method, chain, gravity,
            rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
            rows[LEFT, i], rows[K0, i], rows[K1, i], rows[K2, i], time, wall, rows[HITS, i],
        )  # fmt: skip
        rows[X, i], rows[Y, i], rows[Z, i] = x, y, z
        rows[VX, i], rows[VY, i], rows[VZ, i] = vx, vy, vz
        rows[LEFT, i] = left


@by_type
def _seek(gravity, chain, lanes, live):
    """The first hit of every lane.

    Root and division wait for one another, and the shorter a loop is the more lanes a processor has under way. Measured
    in a sphere, nanoseconds an impact: flight and contact in one loop 7.2, a loop for each 5.4, the first hit before
    them in its own 5.2; the safe steps of a fall in one loop 110, a loop for each 35.
    """


@_seek.register(Nothing)
def _(gravity, chain, lanes, live):
    rows, time, wall = lanes.rows, lanes.time, lanes.surface
    for i in range(live):
        time[i], wall[i] = flights.first_hit(
            chain, gravity, rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i]
        )


@_seek.register(Gravity)
def _(gravity, chain, lanes, live):
    rows, course, time, wall = lanes.rows, lanes.course, lanes.time, lanes.surface
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
        time[i], wall[i] = flights.end_fall(chain, course, 0, i)
        for _step in range(MORE_STEPS):
            if wall[i] >= 0.0 or time[i] >= rows[LEFT, i]:
                break
            flights.step_fall(chain, course, 0, i)
            time[i], wall[i] = flights.end_fall(chain, course, 0, i)


@by_type
def _turn(unknown, method, chain, gravity, lanes, live):
    """The velocity of every lane after its contact, where one loop with the rest of the contact would be too long."""


@_turn.register(object)
def _(unknown, method, chain, gravity, lanes, live):
    rows, surface, kappa, turned = lanes.rows, lanes.surface, lanes.kappa, lanes.turned
    if methods.turns(method):
        for i in range(live):
            turned[0, i], turned[1, i], turned[2, i], turned[3, i] = methods.turn(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], rows[K1, i], surface[i], kappa[i],
            )  # fmt: skip


@_turn.register(Nothing)
def _(unknown, method, chain, gravity, lanes, live):
    pass


@inlined
def _contact(method, chain, gravity, lanes, live):
    """The contact of every lane that has one: (lanes that reached the end of the frame, hard lanes)."""
    rows, surface = lanes.rows, lanes.surface
    impulse, kappa, unsolved, turned = lanes.impulse, lanes.kappa, lanes.unsolved, lanes.turned
    retired, hard_lanes = 0, 0
    tx, ty, tz, given = 0.0, 0.0, 0.0, 0.0
    _turn(methods.unknown(method), method, chain, gravity, lanes, live)
    for i in range(live):
        if methods.turns(method):
            tx, ty, tz, given = turned[0, i], turned[1, i], turned[2, i], turned[3, i]
        x, y, z, vx, vy, vz, left, wall, given, hits, energy = methods.contact(
            method, chain, gravity,
            rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
            rows[LEFT, i], rows[K0, i], rows[K1, i], rows[K2, i], surface[i], kappa[i], unsolved[i],
            tx, ty, tz, given,
        )  # fmt: skip
        rows[X, i], rows[Y, i], rows[Z, i] = x, y, z
        rows[VX, i], rows[VY, i], rows[VZ, i] = vx, vy, vz
        rows[LEFT, i] = left
        rows[HITS, i] += hits
        if methods.dissipates(method):
            rows[K0, i] = energy
        surface[i] = wall
        _add_impulse(chain, impulse, 0, i, wall, given)
        is_hard = wall <= methods.HARD
        hard_lanes += is_hard
        retired += (not (left > 0.0)) & (not is_hard)
    return retired, hard_lanes


@by_type
def _add_impulse(chain, impulse, row, lane, surface, given):
    """impulse[surface, lane] += given, without a branch; a loop over rows here would not vectorise."""
    raise NotImplementedError


@_add_impulse.register(walls.Chain)
def _(chain, impulse, row, lane, surface, given):
    impulse[row, lane] += select(surface == 0.0, given, 0.0)
    _add_impulse(chain.rest, impulse, row + 1, lane, surface - 1.0, given)


@_add_impulse.register(Nothing)
def _(chain, impulse, row, lane, surface, given):
    pass


@by_type_outlined
def _hard_passes(hard, method, chain, gravity, lanes, live):
    """The hard lanes, one by one: (lanes that reached the end of the frame, worst status, its lane)."""
    raise NotImplementedError


@_hard_passes.register(Nothing)
def _(hard, method, chain, gravity, lanes, live):
    return 0, Status.HARD_CONTACT.value, 0


@_hard_passes.register(Hard)
def _(hard, method, chain, gravity, lanes, live):
    rows, surface = lanes.rows, lanes.surface
    retired, worst, where = 0, 0, 0
    for i in range(live):
        if surface[i] <= methods.HARD:
            x, y, z, vx, vy, vz, left, hits, energy, status = methods.hard_pass(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], rows[K1, i], rows[K2, i], methods.HARD - surface[i],
                lanes.impulse, lanes.record, i,
            )  # fmt: skip
            rows[X, i], rows[Y, i], rows[Z, i] = x, y, z
            rows[VX, i], rows[VY, i], rows[VZ, i] = vx, vy, vz
            rows[LEFT, i] = left
            rows[HITS, i] += hits
            if methods.dissipates(method):
                rows[K0, i] = energy
            retired += not (left > 0.0)
            if rows[HITS, i] > hard.most_hits:
                status = Status.STALLED.value
            if status > worst:
                worst, where = status, i
    return retired, worst, where

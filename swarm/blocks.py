"""One block of particles to one time, in lanes.

One pass does one flight and one contact for every live lane, in loops without branches, which LLVM vectorises. Lanes
that reached the frame time retire, and the next particle, or the last live lane, takes their slot. The result does not
depend on which lane or block a particle is in.
"""

import numpy as np

from ._jit import by_type, inlined, kept, kernel, select
from .contact.uzawa import ACCELERATION, BEFORE, GAIN, MEAN, MISS, MULTIPLIER, STORED, SWEEPS, UNCONVERGED
from .gravity import Gravity, Nothing
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
    keep_failure,
    load,
    move,
    retire,
    room,
)
from .methods import base as methods
from .status import Status
from .surfaces import chain as walls
from .surfaces import flights
from .surfaces.course import MORE_STEPS, SAFE_STEPS

# Impacts of one particle in one frame after which it is given up: seconds, not hours, in a cusp.
_MOST_HITS = 1e8


@kernel
def advance_block(method, chain, gravity, state, span, start, stop, halt):
    """Advance particles start to stop by `span` and return (status, particle): the first that failed, or the last.

    `span` is in the method's unit. `halt[0]` set to 1 by another thread stops the block at its next pass.
    """
    lanes = room(chain)
    live = min(LANES, stop - start)
    for lane in range(live):
        load(method, lanes, lane, state, start + lane, span)
    following = start + live
    while live > 0:
        if halt[0] != 0:
            return Status.INTERRUPTED.value, stop - 1
        _fly(method, chain, gravity, lanes, live)
        _solve(method, chain, gravity, lanes, live)
        retired, hard = _contact(method, chain, gravity, lanes, live)
        if hard > 0:
            finished, status, lane = _hard_passes(method, chain, gravity, lanes, live)
            if status != Status.DONE.value:
                keep_failure(state.multipliers, lanes, lane)
                return status, lanes.particle[lane]
            retired += finished
        count_sweeps(state.multipliers, lanes, live)
        lane = 0
        while retired > 0:
            if lanes.rows[LEFT, lane] > 0.0:
                lane += 1
                continue
            retire(method, lanes, lane, state)
            retired -= 1
            if following < stop:
                load(method, lanes, lane, state, following, span)
                following += 1
                # It may be done already: a span of 0.
                lane += 1
            else:
                live -= 1
                move(lanes, live, lane)
    return Status.DONE.value, stop - 1


@inlined
def _fly(method, chain, gravity, lanes, live):
    """Every lane to its next contact, or to the end of the frame."""
    rows, surface = lanes.rows, lanes.surface
    time, wall = 0.0, 0.0
    if methods.falls(method, gravity):
        _fall(gravity, chain, lanes, live)
    for i in range(live):
        if methods.falls(method, gravity):
            time, wall = lanes.time[i], kept(surface[i])
        x, y, z, vx, vy, vz, left, surface[i] = methods.flight(
            method, chain, gravity,
            rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
            rows[LEFT, i], rows[K0, i], rows[K1, i], rows[K2, i], time, wall,
        )  # fmt: skip
        rows[X, i], rows[Y, i], rows[Z, i] = x, y, z
        rows[VX, i], rows[VY, i], rows[VZ, i] = vx, vy, vz
        rows[LEFT, i] = left


@by_type
def _fall(gravity, chain, lanes, live):
    """The safe steps of every lane, a loop for each.

    In one loop every step waits for the one before it (measured: 110 instead of 45 ns an impact in a sphere).
    """


@_fall.register(Gravity)
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


@inlined
def _solve(method, chain, gravity, lanes, live):
    """The contact's unknown of every lane, and its multiplier where the method has one."""
    rows, surface, kappa, unsolved = lanes.rows, lanes.surface, lanes.kappa, lanes.unsolved
    record, sweeping = lanes.record, lanes.sweeping
    if methods.most_sweeps(method, chain) > 0:
        for i in range(live):
            kappa[i], unsolved[i] = methods.guess(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], surface[i],
            )  # fmt: skip
    if methods.has_multiplier(method):
        for i in range(live):
            record[MULTIPLIER, i], kappa[i], record[ACCELERATION, i] = methods.first_multiplier(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], surface[i], kappa[i],
            )  # fmt: skip
            sweeping[i] = unsolved[i]
            record[BEFORE, i], record[MISS, i] = np.nan, np.nan
            record[SWEEPS, i], record[STORED, i], record[UNCONVERGED, i] = 0.0, 0.0, 0.0
    _newton(method, chain, gravity, lanes, live)
    if methods.has_multiplier(method):
        for _sweep in range(methods.multiplier_sweeps(method)):
            if _update_multipliers(method, lanes, live) == 0:
                break
            _newton(method, chain, gravity, lanes, live)
        for i in range(live):
            unsolved[i] = unsolved[i] | sweeping[i]


@inlined
def _update_multipliers(method, lanes, live):
    """The end of a sweep of the loop (8): how many lanes need another."""
    rows, record, kappa, unsolved, sweeping = lanes.rows, lanes.record, lanes.kappa, lanes.unsolved, lanes.sweeping
    remaining = 0
    for i in range(live):
        old = kept(record[MULTIPLIER, i])
        new, miss, more = methods.next_multiplier(
            method,
            rows[LEFT, i],
            record[ACCELERATION, i],
            old,
            record[MEAN, i],
            record[STORED, i],
            record[BEFORE, i],
            record[MISS, i],
        )
        going = sweeping[i]
        record[BEFORE, i] = select(going, old, kept(record[BEFORE, i]))
        record[MISS, i] = select(going, miss, kept(record[MISS, i]))
        record[SWEEPS, i] += select(going, 1.0, 0.0)
        # What the inner solve left unsolved is for the careful way, at once.
        going = going & more & (not unsolved[i])
        # The first Newton step for the new multiplier needs no evaluation.
        kappa[i] += select(going, record[GAIN, i] * (new - old), 0.0)
        record[MULTIPLIER, i] = select(going, new, old)
        unsolved[i] = unsolved[i] | going
        sweeping[i] = going
        remaining += going
    return remaining


@inlined
def _newton(method, chain, gravity, lanes, live):
    """Sweeps of the inner solve, until the last lane is solved."""
    rows, surface, kappa, unsolved = lanes.rows, lanes.surface, lanes.kappa, lanes.unsolved
    record = lanes.record
    for _sweep in range(methods.most_sweeps(method, chain)):
        remaining = 0
        for i in range(live):
            going = unsolved[i]
            kappa[i], unsolved[i], mean, stored, gain = methods.improve(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], surface[i], kept(kappa[i]), going, record[MULTIPLIER, i],
            )  # fmt: skip
            if methods.has_multiplier(method):
                record[MEAN, i] = select(going, mean, kept(record[MEAN, i]))
                record[STORED, i] = select(going, stored, kept(record[STORED, i]))
                record[GAIN, i] = select(going, gain, kept(record[GAIN, i]))
            remaining += unsolved[i]
        if remaining == 0:
            break


@inlined
def _contact(method, chain, gravity, lanes, live):
    """The contact of every lane that has one: (lanes that reached the end of the frame, hard lanes)."""
    rows, surface = lanes.rows, lanes.surface
    impulse, kappa, unsolved = lanes.impulse, lanes.kappa, lanes.unsolved
    turned = lanes.turned
    retired, hard_lanes = 0, 0
    tx, ty, tz, given = 0.0, 0.0, 0.0, 0.0
    if methods.turns(method):
        for i in range(live):
            turned[0, i], turned[1, i], turned[2, i], turned[3, i] = methods.turn(
                method, chain, gravity,
                rows[X, i], rows[Y, i], rows[Z, i], rows[VX, i], rows[VY, i], rows[VZ, i],
                rows[LEFT, i], rows[K0, i], rows[K1, i], surface[i], kappa[i],
            )  # fmt: skip
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


@inlined
def _hard_passes(method, chain, gravity, lanes, live):
    """The hard lanes, one by one: (lanes that reached the end of the frame, worst status, its lane)."""
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
            if rows[HITS, i] > _MOST_HITS:
                status = Status.STALLED.value
            if status > worst:
                worst, where = status, i
    return retired, worst, where

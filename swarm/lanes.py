"""One block of particles to one time, in lanes.

A block is copied into lane arrays; one pass does one flight and one contact for every live lane, in loops without
branches, which LLVM vectorises. Lanes that reached the frame time retire, and the next particle, or the last live lane,
takes their slot. The result does not depend on which lane or block a particle is in.
"""

from typing import NamedTuple

import numpy as np

from ._jit import Array, by_type, by_type_outlined, inlined, kept, kernel, select
from .contact.uzawa import ACCELERATION, BEFORE, GAIN, MEAN, MISS, MULTIPLIER, RECORDS, STORED, SWEEPS, UNCONVERGED
from .gravity import Gravity, Nothing
from .methods import base as methods
from .particles import Multipliers
from .status import Status
from .surfaces import chain as walls
from .surfaces.base import MORE_STEPS, SAFE_STEPS

# Lanes of a block: 256 x 16 rows of 8 bytes fit in the L1 cache.
_LANES = 256
# The row stride is not a power of two, so that the rows of a lane do not share a cache set.
_STRIDE = 264
# Impacts of one particle in one frame after which it is given up: seconds, not hours, in a cusp.
_MOST_HITS = 1e8

_X, _Y, _Z, _VX, _VY, _VZ, _LEFT, _K0, _K1, _K2, _HITS, _ROWS = range(12)


class Lanes(NamedTuple):
    """Arrays of one column a lane."""

    rows: Array  # (_ROWS, stride) position, velocity, time left, the method's constants, impacts
    impulse: Array  # (surfaces, stride) normal impulse per mass
    surface: Array  # the wall of the contact in this pass, -1 for none, HARD - wall where the lane is hard
    kappa: Array  # the contact's unknown
    unsolved: Array  # bool, whether its solve goes on
    sweeping: Array  # bool, whether the loop of its multiplier goes on
    record: Array  # (RECORDS, stride) the loop of its multiplier
    course: Array  # (walls COURSE, stride) the safe steps of a fall
    time: Array  # when the fall meets `surface`
    turned: Array  # (4, stride) velocity and impulse after the contact, where `turn` finds them
    particle: Array  # int64, the particle in the lane


@kernel
def advance_block(method, chain, gravity, state, span, start, stop, halt):
    """Advance particles start to stop by `span` and return (status, particle): the first that failed, or the last.

    `span` is in the method's unit. `halt[0]` set to 1 by another thread stops the block at its next pass.
    """
    lanes = Lanes(
        np.empty((_ROWS, _STRIDE)),
        np.empty((walls.length(chain), _STRIDE)),
        np.empty(_STRIDE),
        np.zeros(_STRIDE),
        np.zeros(_STRIDE, np.bool_),
        np.zeros(_STRIDE, np.bool_),
        np.zeros((RECORDS, _STRIDE)),
        np.zeros((walls.length(chain) * walls.COURSE, _STRIDE)),
        np.empty(_STRIDE),
        np.zeros((4, _STRIDE)),
        np.empty(_STRIDE, np.int64),
    )
    live = min(_LANES, stop - start)
    for lane in range(live):
        _load(method, lanes, lane, state, start + lane, span)
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
                _keep_failure(state.multipliers, lanes, lane)
                return status, lanes.particle[lane]
            retired += finished
        _count_sweeps(state.multipliers, lanes, live)
        lane = 0
        while retired > 0:
            if lanes.rows[_LEFT, lane] > 0.0:
                lane += 1
                continue
            _retire(method, lanes, lane, state)
            retired -= 1
            if following < stop:
                _load(method, lanes, lane, state, following, span)
                following += 1
                # It may be done already: a span of 0.
                lane += 1
            else:
                live -= 1
                _move(lanes, live, lane)
    return Status.DONE.value, stop - 1


# --- A particle in and out -------------------------------------------------------------------------------


@inlined
def _load(method, lanes, lane, state, i, span):
    """Particle i into a lane."""
    rows, impulse, particle = lanes.rows, lanes.impulse, lanes.particle
    position, velocity = state.position, state.velocity
    for axis in range(3):
        rows[_X + axis, lane] = position[axis, i]
        rows[_VX + axis, lane] = velocity[axis, i]
    constants = methods.lane_constants(
        method, state.mass[i], state.energy[i], velocity[0, i], velocity[1, i], velocity[2, i]
    )
    rows[_K0, lane], rows[_K1, lane], rows[_K2, lane] = constants
    rows[_LEFT, lane], rows[_HITS, lane] = span, 0.0
    for s in range(impulse.shape[0]):
        impulse[s, lane] = 0.0
    particle[lane] = i


@inlined
def _retire(method, lanes, lane, state):
    """A lane back into its particle."""
    rows, impulse = lanes.rows, lanes.impulse
    position, velocity, impacts, total = state.position, state.velocity, state.impacts, state.impulse
    i = lanes.particle[lane]
    for axis in range(3):
        position[axis, i] = rows[_X + axis, lane]
        velocity[axis, i] = rows[_VX + axis, lane]
    impacts[i] += np.int64(rows[_HITS, lane])
    for s in range(impulse.shape[0]):
        total[s, i] += impulse[s, lane] * state.mass[i]
    if methods.dissipates(method):
        # Each particle knows its energy: what it has lost is accounted for with it.
        now = 0.5 * rows[_K0, lane]
        state.dissipated[i] += state.mass[i] * (state.energy[i] - now)
        state.energy[i] = now


@inlined
def _move(lanes, source, target):
    """The last live lane into the free slot. What flight and contact leave for each other need not move."""
    rows, impulse, particle = lanes.rows, lanes.impulse, lanes.particle
    for row in range(_ROWS):
        rows[row, target] = rows[row, source]
    for s in range(impulse.shape[0]):
        impulse[s, target] = impulse[s, source]
    particle[target] = particle[source]


# --- The passes ------------------------------------------------------------------------------------------


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
            rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
            rows[_LEFT, i], rows[_K0, i], rows[_K1, i], rows[_K2, i], time, wall,
        )  # fmt: skip
        rows[_X, i], rows[_Y, i], rows[_Z, i] = x, y, z
        rows[_VX, i], rows[_VY, i], rows[_VZ, i] = vx, vy, vz
        rows[_LEFT, i] = left


@by_type
def _fall(gravity, chain, lanes, live):
    """The safe steps of every lane, a loop for each.

    In one loop every step waits for the one before it (measured: 110 instead of 45 ns an impact in a sphere).
    """


@_fall.register(Gravity)
def _(gravity, chain, lanes, live):
    rows, course, time, wall = lanes.rows, lanes.course, lanes.time, lanes.surface
    for i in range(live):
        walls.begin_fall(
            chain, course, 0, i,
            rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
            gravity.x, gravity.y, gravity.z,
        )  # fmt: skip
    for _step in range(SAFE_STEPS):
        for i in range(live):
            walls.step_fall(chain, course, 0, i)
    # The few that need more, one by one: a flight in two parts would look like a short one.
    for i in range(live):
        time[i], wall[i] = walls.end_fall(chain, course, 0, i)
        for _step in range(MORE_STEPS):
            if wall[i] >= 0.0 or time[i] >= rows[_LEFT, i]:
                break
            walls.step_fall(chain, course, 0, i)
            time[i], wall[i] = walls.end_fall(chain, course, 0, i)


@inlined
def _solve(method, chain, gravity, lanes, live):
    """The contact's unknown of every lane, and its multiplier where the method has one."""
    rows, surface, kappa, unsolved = lanes.rows, lanes.surface, lanes.kappa, lanes.unsolved
    record, sweeping = lanes.record, lanes.sweeping
    if methods.most_sweeps(method, chain) > 0:
        for i in range(live):
            kappa[i], unsolved[i] = methods.guess(
                method, chain, gravity,
                rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
                rows[_LEFT, i], rows[_K0, i], surface[i],
            )  # fmt: skip
    if methods.has_multiplier(method):
        for i in range(live):
            record[MULTIPLIER, i], kappa[i], record[ACCELERATION, i] = methods.first_multiplier(
                method, chain, gravity,
                rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
                rows[_LEFT, i], rows[_K0, i], surface[i], kappa[i],
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
            rows[_LEFT, i],
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
                rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
                rows[_LEFT, i], rows[_K0, i], surface[i], kept(kappa[i]), going, record[MULTIPLIER, i],
            )  # fmt: skip
            if methods.has_multiplier(method):
                record[MEAN, i] = select(going, mean, kept(record[MEAN, i]))
                record[STORED, i] = select(going, stored, kept(record[STORED, i]))
                record[GAIN, i] = select(going, gain, kept(record[GAIN, i]))
            remaining += unsolved[i]
        if remaining == 0:
            break


@by_type_outlined
def _count_sweeps(multipliers, lanes, live):
    """Add the records of the lanes that had a contact to their particles; nothing where there are no multipliers."""


@_count_sweeps.register(Multipliers)
def _(multipliers, lanes, live):
    record = lanes.record
    for i in range(live):
        if record[SWEEPS, i] > 0.0:
            particle = lanes.particle[i]
            multipliers.sweeps[particle] += np.int64(record[SWEEPS, i])
            multipliers.contacts[particle] += 1
            multipliers.unconverged[particle] += np.int64(record[UNCONVERGED, i])
            multipliers.stored_energy[particle] = max(multipliers.stored_energy[particle], record[STORED, i])
            record[SWEEPS, i] = 0.0


@by_type_outlined
def _keep_failure(multipliers, lanes, lane):
    """Keep the record of the lane that failed, for the error."""


@_keep_failure.register(Multipliers)
def _(multipliers, lanes, lane):
    particle = lanes.particle[lane]
    multipliers.sweeps[particle] = np.int64(lanes.record[SWEEPS, lane])
    multipliers.stored_energy[particle] = lanes.record[STORED, lane]
    multipliers.left[particle] = lanes.rows[_LEFT, lane]


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
                rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
                rows[_LEFT, i], rows[_K0, i], rows[_K1, i], surface[i], kappa[i],
            )  # fmt: skip
    for i in range(live):
        if methods.turns(method):
            tx, ty, tz, given = turned[0, i], turned[1, i], turned[2, i], turned[3, i]
        x, y, z, vx, vy, vz, left, wall, given, hits, energy = methods.contact(
            method, chain, gravity,
            rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
            rows[_LEFT, i], rows[_K0, i], rows[_K1, i], rows[_K2, i], surface[i], kappa[i], unsolved[i],
            tx, ty, tz, given,
        )  # fmt: skip
        rows[_X, i], rows[_Y, i], rows[_Z, i] = x, y, z
        rows[_VX, i], rows[_VY, i], rows[_VZ, i] = vx, vy, vz
        rows[_LEFT, i] = left
        rows[_HITS, i] += hits
        if methods.dissipates(method):
            rows[_K0, i] = energy
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
                rows[_X, i], rows[_Y, i], rows[_Z, i], rows[_VX, i], rows[_VY, i], rows[_VZ, i],
                rows[_LEFT, i], rows[_K0, i], rows[_K1, i], rows[_K2, i], methods.HARD - surface[i],
                lanes.impulse, lanes.record, i,
            )  # fmt: skip
            rows[_X, i], rows[_Y, i], rows[_Z, i] = x, y, z
            rows[_VX, i], rows[_VY, i], rows[_VZ, i] = vx, vy, vz
            rows[_LEFT, i] = left
            rows[_HITS, i] += hits
            if methods.dissipates(method):
                rows[_K0, i] = energy
            retired += not (left > 0.0)
            if rows[_HITS, i] > _MOST_HITS:
                status = Status.STALLED.value
            if status > worst:
                worst, where = status, i
    return retired, worst, where

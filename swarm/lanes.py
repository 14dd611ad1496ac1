"""The particles that are being advanced, one a lane: arrays that fit in the cache, the ways in and out."""

from typing import NamedTuple

import numpy as np

from ._jit import Array, by_type_outlined, inlined, next_of, outlined
from .contact.uzawa import RECORDS, STORED, SWEEPS, UNCONVERGED
from .methods import base as methods
from .particles import Multipliers
from .surfaces import chain as walls
from .surfaces import flights

# Lanes of a block: 256 x 16 rows of 8 bytes fit in the L1 cache.
LANES = 256
# The row stride is not a power of two, so that the rows of a lane do not share a cache set.
_STRIDE = 264
X, Y, Z, VX, VY, VZ, LEFT, K0, K1, K2, HITS, ROWS = range(12)


class Lanes(NamedTuple):
    """Arrays of one column a lane."""

    rows: Array  # (ROWS, stride) position, velocity, time left, the method's constants, impacts
    impulse: Array  # (surfaces, stride) normal impulse per mass
    surface: Array  # the wall of the contact in this pass, -1 for none, HARD - wall where the lane is hard
    kappa: Array  # the contact's unknown
    unsolved: Array  # bool, whether its solve goes on
    sweeping: Array  # bool, whether the loop of its multiplier goes on
    record: Array  # (RECORDS, stride) the loop of its multiplier
    course: Array  # (walls COURSE, stride) the safe steps of a fall
    time: Array  # when the flight meets `surface`
    turned: Array  # (4, stride) velocity and impulse after the contact, where `turn` finds them
    particle: Array  # int64, the particle in the lane
    arrived: Array  # int64, the lanes that reached the end of the frame in this pass, `_arrivals` of them


class Room(NamedTuple):
    """The arrays of `Lanes` that NumPy makes: in a kernel each kind of them takes a tenth of a second to compile."""

    surface: Array
    kappa: Array
    unsolved: Array
    sweeping: Array
    record: Array
    time: Array
    particle: Array
    arrived: Array
    left_behind: Array  # (ROWS + walls, LANES) what the lanes hold when a halt ends the block


class Halted(NamedTuple):
    """Particles that a halt caught on their way: what their lanes held between two passes, one a column.

    Their way cannot be cut in two: a flight that ends at the halt and one that goes on from there are rounded twice.
    """

    particle: Array  # int64, in order
    rows: Array  # (ROWS + walls, particles) the lane's rows, then its impulses


class Draws(NamedTuple):
    """Where the particles of a block come from: draw k is of those from k size to (k + 1) size, for one thread alone.

    A thread draws when a lane is free, so its lanes are full until there are no more: shares of fixed size, each with
    its own end, cost 14 % with 512 particles a share and 3 % with 4096, and leave a thread idle while the other has
    the last one.
    """

    ticket: Array  # (1,) the next draw, of all threads
    size: int
    mine: Array  # the draws of this thread, in order


def room(walls: int) -> Room:
    """Room for one block."""
    return Room(
        np.empty(_STRIDE),
        np.zeros(_STRIDE),
        np.zeros(_STRIDE, np.bool_),
        np.zeros(_STRIDE, np.bool_),
        np.zeros((RECORDS, _STRIDE)),
        np.empty(_STRIDE),
        np.empty(_STRIDE, np.int64),
        np.empty(_STRIDE, np.int64),
        np.empty((ROWS + walls, LANES)),
    )


def nobody(walls: int) -> Halted:
    """No particle was halted."""
    return Halted(np.empty(0, np.int64), np.empty((ROWS + walls, 0)))


@inlined
def lanes_in(room, chain):
    """Lanes in that room. The tables of a pass are made here, where the compiler sees how far their rows are apart."""
    count = walls.length(chain)
    return Lanes(
        _table(ROWS),
        _table(count),
        room.surface,
        room.kappa,
        room.unsolved,
        room.sweeping,
        room.record,
        _table(count * flights.COURSE),
        room.time,
        _table(4),
        room.particle,
        room.arrived,
    )


@inlined
def _table(rows):
    return np.empty((rows, _STRIDE))


@inlined
def following_particle(draws, done, i, stop, drawn):
    """(particle, stop, draws so far): the first from i on that is not done, of another draw if need be; or stop."""
    while True:
        while i < stop and done[i]:
            i += 1
        if i < stop:
            return i, stop, drawn
        k = next_of(draws.ticket)
        i = min(k * draws.size, done.size)
        stop = min(i + draws.size, done.size)
        if i == stop:
            return i, stop, drawn
        draws.mine[drawn] = k
        drawn += 1


@inlined
def load(method, lanes, lane, state, halted, i, span):
    """Particle i into a lane, as it starts the frame, or as a halt left it."""
    rows, impulse, particle = lanes.rows, lanes.impulse, lanes.particle
    particle[lane] = i
    if halted.particle.size > 0 and _pick_up(lanes, lane, halted, i):
        return
    position, velocity = state.position, state.velocity
    for axis in range(3):
        rows[X + axis, lane] = position[axis, i]
        rows[VX + axis, lane] = velocity[axis, i]
    constants = methods.lane_constants(
        method, state.mass[i], state.energy[i], velocity[0, i], velocity[1, i], velocity[2, i]
    )
    rows[K0, lane], rows[K1, lane], rows[K2, lane] = constants
    rows[LEFT, lane], rows[HITS, lane] = span, 0.0
    for s in range(impulse.shape[0]):
        impulse[s, lane] = 0.0


@outlined
def _pick_up(lanes, lane, halted, i):
    """What a halt left of particle i into a lane; whether there is any."""
    first, last = 0, halted.particle.size
    while first < last:
        middle = (first + last) // 2
        if halted.particle[middle] < i:
            first = middle + 1
        else:
            last = middle
    if first == halted.particle.size or halted.particle[first] != i:
        return False
    for row in range(ROWS):
        lanes.rows[row, lane] = halted.rows[row, first]
    for s in range(lanes.impulse.shape[0]):
        lanes.impulse[s, lane] = halted.rows[ROWS + s, first]
    return True


@outlined
def leave(lanes, live, left_behind):
    """The live lanes, between two passes: what one pass leaves for the next."""
    for lane in range(live):
        for row in range(ROWS):
            left_behind[row, lane] = lanes.rows[row, lane]
        for s in range(lanes.impulse.shape[0]):
            left_behind[ROWS + s, lane] = lanes.impulse[s, lane]


@inlined
def retire(method, lanes, lane, state):
    """A lane back into its particle."""
    rows, impulse = lanes.rows, lanes.impulse
    position, velocity, impacts, total = state.position, state.velocity, state.impacts, state.impulse
    i = lanes.particle[lane]
    for axis in range(3):
        position[axis, i] = rows[X + axis, lane]
        velocity[axis, i] = rows[VX + axis, lane]
    impacts[i] += np.int64(rows[HITS, lane])
    for s in range(impulse.shape[0]):
        total[s, i] += impulse[s, lane] * state.mass[i]
    if methods.dissipates(method):
        # Each particle knows its energy: what it has lost is accounted for with it.
        now = 0.5 * rows[K0, lane]
        state.dissipated[i] += state.mass[i] * (state.energy[i] - now)
        state.energy[i] = now


@inlined
def move(lanes, source, target):
    """The last live lane into the free slot. What flight and contact leave for each other need not move."""
    rows, impulse, particle = lanes.rows, lanes.impulse, lanes.particle
    for row in range(ROWS):
        rows[row, target] = rows[row, source]
    for s in range(impulse.shape[0]):
        impulse[s, target] = impulse[s, source]
    particle[target] = particle[source]


# --- What the loop of the multiplier took ----------------------------------------------------------------


@by_type_outlined
def count_sweeps(multipliers, lanes, live):
    """Add the records of the lanes that had a contact to their particles; nothing where there are no multipliers."""


@count_sweeps.register(Multipliers)
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
def keep_failure(multipliers, lanes, lane):
    """Keep the record of the lane that failed, for the error."""


@keep_failure.register(Multipliers)
def _(multipliers, lanes, lane):
    particle = lanes.particle[lane]
    multipliers.sweeps[particle] = np.int64(lanes.record[SWEEPS, lane])
    multipliers.stored_energy[particle] = lanes.record[STORED, lane]
    multipliers.left[particle] = lanes.rows[LEFT, lane]

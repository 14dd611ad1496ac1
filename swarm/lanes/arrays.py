"""The particles that are being advanced, one a lane: arrays that fit in the cache, the ways in and out."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..contact.events import ARRIVED, EVENT
from ..contact.laws import loses
from ..contact.uzawa import RECORDS, STORED, SWEEPS, UNCONVERGED
from ..kernel.jit import Array, by_type, by_type_outlined, index, inlined, next_of, outlined, select, spaced
from ..kernel.vector import column, put
from ..methods import contract as methods
from ..particles import Contacts, Multipliers
from ..surfaces import flights
from ..surfaces import fold as walls
from ..surfaces.moving import Carried

# Lanes of a block: 256 x 16 rows of 8 bytes fit in the L1 cache.
LANES = 256
# The row stride is not a power of two, so that the rows of a lane do not share a cache set.
STRIDE = 264
# Bytes of a line of the cache, and of a number of eight flags.
_LINE, EIGHT = 64, 8
# After so many passes lanes are looked at: who has moved on since by less than this part of the time left would need
# 1e9 passes, and is given up if it got nowhere.
LOOK, _MOVED = 1024, 1e-6
R, V, LEFT, OWN, HITS, ROWS = 0, 3, 6, 7, 10, 11
# After them there is room for 6 rows of `seek`, and for what a lane was when all were looked at: particle, time left
# and impacts. As an array of its own that made the impacts in an ellipsoid twice as dear.
LOOKED = ROWS + 6

with_distances = spaced(STRIDE)


class Lanes(NamedTuple):
    """Arrays of one column a lane. NumPy makes them: what a kernel makes takes it a tenth of a second to compile."""

    rows: Array  # (LOOKED + 3, stride) position, velocity, time left, constants, impacts; what follows is no part of it
    impulse: Array  # (booked, stride) normal impulse per mass, then the work of walls that move
    wall: Array  # that of the contact in this pass, -1 for none, HARD - wall where the lane is hard
    kappa: Array  # the contact's unknown
    unsolved: Array  # bool, whether its solve goes on
    sweeping: Array  # bool, whether the loop of its multiplier goes on
    record: Array  # (RECORDS, stride) the loop of its multiplier
    course: Array  # (walls COURSE, stride) the safe steps of a fall
    turned: Array  # (4, stride) velocity and impulse after the contact, where `turn` finds them
    particle: Array  # int64, the particle in the lane
    marked: Array  # bool, what one loop says to the next: of a fall that it needs more steps, then that it has arrived
    eights: Array  # int64, `marked` of eight lanes in one number: the same memory
    some: Array  # int64, those `eights` of which one is marked
    order: Array  # int64, the lanes that are marked
    left_behind: Array  # (ROWS + booked, stride) what the lanes hold when a halt ends the block
    period: Any = None  # the cell where it repeats
    before: Any = None  # what a lane is before its contact, where impacts are logged or counted by wall


class Halted(NamedTuple):
    """Particles that a halt caught on their way: what their lanes held between two passes, one a column.

    Their way cannot be cut in two: a flight that ends at the halt and one that goes on from there are rounded twice.
    """

    particle: Array  # int64, in order
    rows: Array  # (ROWS + booked, particles) the lane's rows, then its impulses


class Draws(NamedTuple):
    """Where the particles of a block come from: draw k is of those from k size to (k + 1) size, for one thread alone.

    A thread draws when a lane is free, so its lanes are full until there are no more: shares of fixed size, each with
    its own end, cost 14 % with 512 particles a share and 3 % with 4096, and leave a thread idle while the other has
    the last one.
    """

    ticket: Array  # (1,) how many of `order` are drawn, by all threads
    order: Array  # int64, the draws
    size: int
    mine: Array  # int64, the draws of this thread, in order


class Share(NamedTuple):
    """What one thread advances of a frame, and by how much."""

    state: Any  # `particles.State`
    phase: Array  # (N,) int8, who flies, slides on one wall or on two, or has arrived
    pending: Array  # (PHASES,) int64, how many particles are left to other kernels, by their phase
    halted: Halted
    draws: Draws
    halt: Array  # (1,) int64, passes after which to return
    span: float  # in the method's unit
    seed: int  # of random numbers
    first: int  # the number of particle 0 in the whole run, for them
    moment: float  # at which the frame ends [s]
    log: Any = None  # `log.Log` of impacts
    counts: Any = None  # `log.Counts` of them


def empty(walls: int, rows: int, period: Any = None) -> Lanes:
    """Lanes for one block, with so many rows of what walls give."""
    eights = np.zeros(STRIDE // EIGHT, np.int64)
    return Lanes(
        rows=table(LOOKED + 3),
        impulse=table(rows),
        wall=table(1)[0],
        kappa=table(1)[0],
        unsolved=np.zeros(STRIDE, np.bool_),
        sweeping=np.zeros(STRIDE, np.bool_),
        record=table(RECORDS),
        course=table(walls * flights.COURSE),
        turned=table(4),
        particle=np.zeros(STRIDE, np.int64),
        marked=eights.view(np.bool_),
        eights=eights,
        some=np.zeros_like(eights),
        order=np.zeros(STRIDE, np.int64),
        left_behind=table(ROWS + rows),
        period=period,
    )


def table(rows: int) -> NDArray[np.float64]:
    """Rows of numbers that begin with a line of the cache, so that no vector reaches into two of them."""
    size = 8 * rows * STRIDE
    memory = np.zeros(size + _LINE, np.uint8)
    first = -memory.ctypes.data % _LINE
    return memory[first : first + size].view(np.float64).reshape(rows, STRIDE)


def none_halted(rows: int) -> Halted:
    """No particle was halted; with so many rows of what walls give."""
    return Halted(np.empty(0, np.int64), np.empty((ROWS + rows, 0)))


@inlined
def lane_of(method, rows, i):
    """What is in a lane."""
    kept = methods.own(method, rows[OWN, i], rows[OWN + 1, i], rows[OWN + 2, i])
    return methods.Lane(column(rows, R, i), column(rows, V, i), rows[LEFT, i], rows[HITS, i], kept)


def take(draws: Draws, some: int) -> Array:
    """The next `some` draws of all threads, for one."""
    first = min(some * next_of(draws.ticket), draws.order.size)
    return draws.order[first : first + some]


@inlined
def following_particle(share, phase, i, stop, drawn):
    """(particle, stop, draws so far): the first from i on that is in this phase, of another draw if need be; or stop.

    Counts those in other phases, which other kernels advance.
    """
    draws, phases, pending = share.draws, share.phase, share.pending
    while True:
        while i < stop and phases[i] != phase:
            pending[phases[i]] += 1
            i += 1
        if i < stop:
            return i, stop, drawn
        k = next_of(draws.ticket)
        if k >= draws.order.size:
            return i, i, drawn
        k = draws.order[k]
        i = k * draws.size
        stop = min(i + draws.size, phases.size)
        draws.mine[drawn] = k
        drawn += 1


@inlined
def load(method, chain, lanes, lane, share, i):
    """Particle i into a lane, as it starts the frame, or as a halt left it."""
    rows, impulse, particle = lanes.rows, lanes.impulse, lanes.particle
    particle[lane] = i
    state, halted = share.state, share.halted
    left = rest_of_frame(state.contacts, i)
    if halted.particle.size > 0 and not left > 0.0 and _pick_up(lanes, lane, halted, i):
        return
    i = index(i)
    put(rows, R, lane, column(state.position, 0, i))
    put(rows, V, lane, column(state.velocity, 0, i))
    own = methods.constants(method, state.mass[i], state.energy[i], speed2_scale(state, i))
    rows[OWN, lane], rows[OWN + 1, lane], rows[OWN + 2, lane] = own
    rows[LEFT, lane], rows[HITS, lane] = select(left > 0.0, left, share.span), 0.0
    for s in range(booked(chain)):
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
def leave(lanes, live):
    """The live lanes, between two passes: what one pass leaves for the next."""
    left_behind = lanes.left_behind
    for lane in range(live):
        for row in range(ROWS):
            left_behind[row, lane] = lanes.rows[row, lane]
        for s in range(lanes.impulse.shape[0]):
            left_behind[ROWS + s, lane] = lanes.impulse[s, lane]


@inlined
def retire(method, chain, lanes, lane, share):
    """A lane back into its particle, which has arrived or goes on along a wall."""
    state = share.state
    rows, impulse, impacts, total = lanes.rows, lanes.impulse, state.impacts, state.impulse
    i = index(lanes.particle[lane])
    put(state.position, 0, i, column(rows, R, lane))
    put(state.velocity, 0, i, column(rows, V, lane))
    impacts[i] += np.int64(rows[HITS, lane])
    for s in range(booked(chain)):
        total[s, i] += impulse[s, lane] * state.mass[i]
    if methods.dissipates(method):
        # Each particle knows its energy: what it has lost is accounted for with it.
        now = 0.5 * rows[OWN, lane]
        if loses(methods.laws(method)):
            state.dissipated[i] += state.mass[i] * (state.energy[i] - now + _work(chain, impulse, lane))
        state.energy[i] = now
    phase = hand_over(state.contacts, i, rows[LEFT, lane], lanes.wall[lane])
    share.phase[i] = phase
    share.pending[phase] += 1


@by_type
def booked(chain):
    """How many rows book what the walls give: their impulses, then the work of those that move."""
    return walls.length(chain)


@by_type
def _work(chain, impulse, lane):
    """What walls that move have given a lane, per mass."""
    return 0.0


booked.register(Carried, lambda chain: 2 * walls.length(chain))


@_work.register(Carried)
def _(chain, impulse, lane):
    total = 0.0
    for s in range(walls.length(chain), 2 * walls.length(chain)):
        total += impulse[s, lane]
    return total


@inlined
def move(chain, lanes, source, target):
    """The last live lane into the free slot. What flight and contact leave for each other need not move."""
    rows, impulse, particle = lanes.rows, lanes.impulse, lanes.particle
    for row in range(ROWS):
        rows[row, target] = rows[row, source]
    for s in range(booked(chain)):
        impulse[s, target] = impulse[s, source]
    particle[target] = particle[source]


@inlined
def heat(state, i, wall, before, after):
    """Book what a thermal wall gives to particle i, from twice its energies per mass."""
    # What impacts have taken since the energy was written is booked when the particle leaves its lane.
    pending = state.energy[i] - 0.5 * before
    state.energy[i] = 0.5 * after + pending
    state.heat[wall, i] += 0.5 * (after - before) * state.mass[i]


# --- Between the kernels of a frame ----------------------------------------------------------------------


@by_type
def rest_of_frame(contacts, i):
    """What is left of the frame of a particle that comes from a wall; 0 at its start."""
    return 0.0


@rest_of_frame.register(Contacts)
def _(contacts, i):
    left = contacts.left[i]
    # Where nothing lasts none of these arrays is written: their memory is not even there.
    if left > 0.0:
        contacts.left[i] = 0.0
    return left


@inlined
def speed2_scale(state, i):
    """The square of the speed that a particle's energy scale is that of."""
    scale = state.inverse_scale[i]
    return select(scale > 0.0, 2.0 / select(scale > 0.0, scale, 1.0), 1.0)


@inlined
def goes_on_by(method, v, left):
    """The time from one look to the next by which a particle must go on that has so much left of its frame [s]."""
    return min(methods.instant(method, v), _MOVED * left)


@by_type
def hand_over(contacts, i, left, wall):
    """Leave a particle that has arrived, or whose contact lasts, to what comes next: its phase."""
    return ARRIVED


@hand_over.register(Contacts)
def _(contacts, i, left, wall):
    if not left > 0.0:
        return ARRIVED
    contacts.left[i], contacts.met[i] = left, wall
    contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
    return EVENT


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

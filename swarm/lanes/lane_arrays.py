"""The particles that are being advanced, one in each lane: arrays that fit in the cache, and how lanes are filled."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..contact.events import ARRIVED, EVENT
from ..contact.uzawa import RECORDS
from ..kernel.arrays import index
from ..kernel.jit import Array, outlined, select
from ..kernel.record import Record
from ..kernel.vector import Vec, column, norm, put, square
from ..methods import contract as methods
from ..surfaces.in_motion.moving import Carried
from ..surfaces.presence.doors import Faced
from ..surfaces.time_of_impact import aim, flights
from .table import EIGHT, STRIDE, Advanced, Number, Rows, copy_lane, table

_named = Rows()


class Flying(Advanced):
    """A particle that flies, in its lane."""

    r, v, remaining, own, hits = _named.vector(), _named.vector(), _named.number(), _named.vector(), _named.number()
    # The first number that a method keeps of a particle: twice its energy per mass, where contacts change it.
    twice = Number(own.row)

    # The rows of a particle. After them are the flight of a lane that `seek` closes up, and its state at the last look:
    # with a separate array for that state, impacts in an ellipsoid took twice as long.
    ROWS = _named.count
    CLOSED_UP = _named.take(6)
    looked_particle, looked_left, looked_hits = _named.number(), _named.number(), _named.number()
    looked_r, looked_v = _named.vector(), _named.vector()
    ALL = _named.count

    def look(self, p):
        """Keep the state for the next look, with all that the flight depends on."""
        Advanced.look(self, p)
        self.looked_hits, self.looked_r, self.looked_v = self.hits, self.r, self.v

    def goes_round(self, p):
        """Whether particle p of this lane is in its state of the last look: then it goes round without end."""
        off = square(self.r - self.looked_r) + square(self.v - self.looked_v)
        return self.looked_particle == p and self.looked_left == self.remaining and off == 0.0

    def hardly_turns(self, p, most):
        """Whether particle p of this lane stood still while it met walls, and `most` impacts would not turn it round.

        Between walls at an angle each impact turns it by this angle, and it leaves after less than half a turn.
        """
        stood = self.looked_particle == p and self.looked_left == self.remaining
        turn, hits = norm(self.v - self.looked_v), self.hits - self.looked_hits
        return stood and square(self.r - self.looked_r) == 0.0 and most * turn < math.pi * hits * norm(self.v)

    def put_end(self, end):
        """Write the place, the velocity and the remaining time at the end of a flight or a contact."""
        self.r, self.v, self.remaining = end.r, end.v, end.remaining


class Lanes(NamedTuple):
    """Arrays with a column for each lane. NumPy makes them: in a kernel this takes a tenth of a second to compile."""

    rows: Array  # (Flying.ALL, stride)
    impulse: Array  # (booked, stride) normal impulse per mass, then the work of moving walls
    wall: Array  # the wall of the contact in this pass, -1 for none, HARD - wall where the lane is hard
    kappa: Array  # the unknown of the contact
    unsolved: Array  # bool, whether the solve goes on
    sweeping: Array  # bool, whether the loop of the multiplier goes on
    record: Array  # (RECORDS, stride) the loop of the multiplier
    course: Array  # (walls COURSE and more, stride) the safe steps of a flight, or its first hit so far
    turned: Array  # (4, stride) velocity and impulse after the contact, where `turn` finds them
    flown: Array  # the time of the flight before the contact, where the method asks for it
    particle: Array  # int64, the particle in the lane
    marked: Array  # bool, from one loop to the next: a fall needs more steps, later the lane has arrived
    eights: Array  # int64, `marked` of eight lanes in one number: the same memory
    some: Array  # int64, the `eights` with a marked lane
    order: Array  # int64, the lanes that are marked
    left_behind: Array  # (ROWS + booked, stride) contents of the lanes when a halt ends the block
    period: Any = None  # the periodic cell
    before: Any = None  # the state of a lane before its contact, where impacts are logged or counted by wall
    began: Any = None  # the state before its flight, where there are counters
    stand: Any = None  # (walls, stride) 1 of a wall that stands in the step of the lane, 0 of one that is open to it

    def lane(self, i):
        """The rows of a lane."""
        return Flying(self.rows, i)

    def given(self, method, i):
        """The `Lane` that methods take as an argument."""
        lane = self.lane(i)
        flown = self.flown[i] if method.asks_flown else None
        return methods.Lane(lane.r, lane.v, lane.remaining, lane.hits, method.own(*lane.own), flown)

    def faced(self, walls, i):
        """Return the walls that the step of a lane meets, without those that are open to it."""
        if self.stand is None:
            return walls
        return Faced(walls, tuple(self.stand[k, i] for k, _wall in enumerate(walls.each)))

    def load(self, method, walls, share, i, k):
        """Load particle i into lane k, at the start of the frame or where a halt stopped it."""
        self.particle[k] = i
        if share.counters is not None:
            share.counters.load(share.state, self, i, k)
        state, lane, remaining = share.state, self.lane(k), 0.0
        if state.contacts is not None:
            remaining = state.contacts.remaining[i]
            # Where no contact lasts, these arrays are never written, and so take no memory.
            if remaining > 0.0:
                state.contacts.remaining[i] = 0.0
        if state.late is not None:
            remaining = state.late[i]
            state.late[i] = 0.0
        if share.halted.particle.size > 0 and not remaining > 0.0 and self._pick_up(share.halted, i, k):
            return
        i = index(i)
        lane.r, lane.v = column(state.position, 0, i), column(state.velocity, 0, i)
        lane.own = Vec(*method.constants(state.mass[i], state.energy[i], speed2_scale(state, i)))
        lane.remaining, lane.hits = select(remaining > 0.0, remaining, share.span), 0.0
        for s in range(booked(walls)):
            self.impulse[s, k] = 0.0

    @outlined
    def _pick_up(self, halted, i, k):
        """Load particle i into lane k where a halt stopped it; return whether one did."""
        first, last = 0, halted.particle.size
        while first < last:
            middle = (first + last) // 2
            if halted.particle[middle] < i:
                first = middle + 1
            else:
                last = middle
        if first == halted.particle.size or halted.particle[first] != i:
            return False
        copy_lane(halted.rows, first, self.rows, k, Flying.ROWS)
        for s in range(self.impulse.shape[0]):
            self.impulse[s, k] = halted.rows[Flying.ROWS + s, first]
        return True

    @outlined
    def leave(self, live):
        """Copy the live lanes, between two passes, to `left_behind`."""
        for k in range(live):
            copy_lane(self.rows, k, self.left_behind, k, Flying.ROWS)
            for s in range(self.impulse.shape[0]):
                self.left_behind[Flying.ROWS + s, k] = self.impulse[s, k]

    def retire(self, method, walls, share, k):
        """Write lane k back to the arrays of its particle, which has arrived or goes on along a wall."""
        state, lane, i = share.state, self.lane(k), index(self.particle[k])
        put(state.position, 0, i, lane.r)
        put(state.velocity, 0, i, lane.v)
        if share.counters is not None:
            share.counters.retire(state, self, i, k)
        state.impacts[i] += np.int64(lane.hits)
        for s in range(booked(walls)):
            state.impulse[s, i] += self.impulse[s, k] * state.mass[i]
        if method.dissipates:
            # The energy of each particle is kept, so its loss is booked with it.
            now = 0.5 * lane.twice
            if method.laws.loses:
                work = 0.0
                for s in range(walls.length(), booked(walls)):
                    work += self.impulse[s, k]
                state.dissipated[i] += state.mass[i] * (state.energy[i] - now + work)
            state.energy[i] = now
        phase = ARRIVED
        if state.contacts is not None and lane.remaining > 0.0:
            phase, contacts = EVENT, state.contacts
            contacts.remaining[i], contacts.met[i] = lane.remaining, self.wall[k]
            contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
        share.hand_over(i, phase)

    def move(self, walls, counters, source, target):
        """Move the last live lane to the free slot, without what flight and contact leave for each other."""
        copy_lane(self.rows, source, self.rows, target, Flying.ROWS)
        copy_lane(self.impulse, source, self.impulse, target, booked(walls))
        self.particle[target] = self.particle[source]
        if counters is not None:
            counters.move(self, source, target)


class Halted(Record):
    """Particles that a halt stopped on their way: the contents of their lanes between two passes, one a column.

    Their flights cannot be cut in two: one that ends at the halt and one that goes on from there are rounded twice.
    """

    particle: Array  # int64, in order
    rows: Array  # (ROWS + booked, particles) the lane's rows, then its impulses

    def time_left(self):
        """The time left of the frame, of each particle."""
        return self.rows[Flying.remaining.row]

    def places(self):
        """The positions, (3, particles) [m]."""
        return self.rows[Flying.r.row : Flying.r.row + 3]


def empty(walls: int, given: int, period: Any = None, rows: int = Flying.ALL) -> Lanes:
    """Allocate lanes for one block, with `given` rows for the walls, and `rows` rows of a particle."""
    eights = np.zeros(STRIDE // EIGHT, np.int64)
    return Lanes(
        rows=table(rows),
        impulse=table(given),
        wall=table(1)[0],
        kappa=table(1)[0],
        unsolved=np.zeros(STRIDE, np.bool_),
        sweeping=np.zeros(STRIDE, np.bool_),
        record=table(RECORDS),
        course=table(walls * flights.COURSE + aim.WALLS),
        turned=table(4),
        flown=table(1)[0],
        particle=np.zeros(STRIDE, np.int64),
        marked=eights.view(np.bool_),
        eights=eights,
        some=np.zeros(STRIDE // EIGHT, np.int64),
        order=np.zeros(STRIDE, np.int64),
        left_behind=table(Flying.ROWS + given),
        period=period,
    )


def none_halted(rows: int) -> Halted:
    """Return no halted particles, with `rows` rows for the walls."""
    return Halted(np.empty(0, np.int64), np.empty((Flying.ROWS + rows, 0)))


# --- For one particle -----------------------------------------------------------------------------------


def booked(walls):
    """The number of rows for the walls: their impulses, then the works of moving walls."""
    return 2 * walls.length() if isinstance(walls, Carried) else walls.length()


def speed2_scale(state, i):
    """Return twice the energy scale of a particle per mass, the square of a speed."""
    scale = state.inverse_scale[i]
    return select(scale > 0.0, 2.0 / select(scale > 0.0, scale, 1.0), 1.0)

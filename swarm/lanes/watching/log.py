"""The log of impacts: each one that a kernel counts is a row, in arrays that another thread writes to a file.

A run without a log has None in its place, and compiles none of this code.
"""

from typing import Any, NamedTuple

import numpy as np

from ...contact.reflection import relative, wall_velocity
from ...kernel.arrays import index
from ...kernel.jit import Array, outlined
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, dot
from ..share import ThreadPlace
from ..table import LANES, LaneView, Rows

# What a kernel leaves that ends with a full log: particle, stop, draws, live lanes, passes.
GOING = 5

_named = Rows()


class BeforeContact(LaneView):
    """A lane before its contact: its flight, the wall, and the impulse that this has given it since."""

    r, v, remaining = _named.vector(), _named.vector(), _named.number()
    hits, wall, impulse = _named.number(), _named.number(), _named.number()


ROWS = _named.count


class Struck(Record):
    """An impact: where, with the velocities before and after, on which wall, and the impulse per mass."""

    r: Vec
    before: Vec
    after: Vec
    wall: float
    remaining: float  # of the frame [s]
    impulse: float


class Log(NamedTuple):
    """Arrays of one entry a row, `filled` so far, and what says which rows there are."""

    time: Array  # (rows,) [s]
    particle: Array  # (rows,) int32
    wall: Array  # (rows,) int32, its number in the scene
    position: Array  # (rows, 3) [m], in the cell where the scene repeats
    velocity_before: Array  # (rows, 3) [m/s]
    velocity_after: Array  # (rows, 3)
    impulse: Array  # (rows,) [N s], along the wall's normal
    slip: Any  # (rows, 3) [m/s] tangential velocity relative to the wall, before; None without friction
    image: Any  # (rows, 3) int32, how many cells away that is; None where the scene does not repeat
    partner: Any  # (rows,) int32, the particle that it meets, -1 at a wall; None where particles do not meet
    filled: Array  # (2,) int64, and how many rows had no room
    going: Array  # (GOING,) int64
    order: Array  # int64, the lanes of a pass that have a row
    chosen: Any  # (N,) bool, the particles that have rows; None: all
    begin: float  # of the frame [s]
    end: float
    room: int  # rows that one pass may have

    def keep_before(self, lanes, live):
        """Keep every lane as it is before its contact."""
        for i in range(index(live)):
            lane, before = lanes.lane(i), BeforeContact(lanes.before, i)
            before.r, before.v, before.remaining, before.hits = lane.r, lane.v, lane.remaining, lane.hits
            before.wall, before.impulse = lanes.wall[i], 0.0

    def note(self, lanes, i, impulse):
        """Note the impulse per mass that the wall of a lane gives."""
        BeforeContact(lanes.before, i).impulse += impulse

    @outlined
    def add_rows(self, method, walls, state, lanes, live):
        """A row for each lane with one more impact than before its contact."""
        order, n = self.order, index(0)
        for i in range(index(live)):
            order[n] = i
            n += index((lanes.lane(i).hits > BeforeContact(lanes.before, i).hits) & self.has(lanes.particle[i]))
        for k in range(n):
            i = index(order[k])
            before = BeforeContact(lanes.before, i)
            struck = Struck(before.r, before.v, lanes.lane(i).v, before.wall, before.remaining, before.impulse)
            self._add(state, lanes.particle[i], struck, self._slip_of(method, walls, struck))

    @outlined
    def add_row(self, method, walls, state, particle, struck):
        """A row for an impact of a particle."""
        if self.has(particle):
            self._add(state, particle, struck, self._slip_of(method, walls, struck))

    @outlined
    def add_escape(self, state, particle, struck):
        """A row, without an impulse or a slip, for a particle that passes an opening."""
        if self.has(particle):
            self._add(state, particle, struck, ZERO)

    def add_crossing(self, state, particle, there, number, images):
        """A row for a particle, a `Moment`, that crosses a counter: 2 counter + sense, so many cells away."""
        if not self.has(particle):
            return
        # The rest is for the impacts of this pass.
        if self.filled[0] + LANES >= self.time.size:
            self.filled[1] += 1
            return
        k = index(self.filled[0])
        self._add(state, particle, Struck(there.r, there.v, there.v, -1.0 - number, there.remaining, 0.0), ZERO)
        if self.image is not None:
            for axis, images_along in enumerate(images):
                self.image[k, axis] += np.int32(images_along)

    def has(self, particle):
        """Whether a particle has rows."""
        return True if self.chosen is None else self.chosen[index(particle)]

    def _slip_of(self, method, walls, struck):
        """The speed of a particle along the wall that it strikes, where the log has that."""
        if self.slip is None:
            return ZERO
        now = walls.at(struck.remaining)
        u = wall_velocity(method.laws.moving, now, struck.wall, struck.r)
        n, before = now.unit_normal(struck.wall, struck.r), relative(u, struck.before)
        return before - dot(before, n) * n

    def _add(self, state, particle, struck, slip):
        k, p = index(self.filled[0]), index(particle)
        self.filled[0] += 1
        self.time[k] = max(self.begin, self.end - struck.remaining)
        self.particle[k], self.wall[k] = np.int32(particle), np.int32(struck.wall)
        _put(self.position, k, struck.r)
        _put(self.velocity_before, k, struck.before)
        _put(self.velocity_after, k, struck.after)
        self.impulse[k] = struck.impulse * state.mass[p]
        if self.slip is not None:
            _put(self.slip, k, slip)
        if self.image is not None:
            for axis in range(3):
                self.image[k, axis] = np.int32(state.image[axis, p])


def _put(rows, k, vector):
    rows[k, 0], rows[k, 1], rows[k, 2] = vector.x, vector.y, vector.z


# --- A log that is full ----------------------------------------------------------------------------------


def is_full(log):
    """Whether a pass may have more rows than there is room for."""
    return False if log is None else log.filled[0] + log.room > log.time.size


def keep_going(log, place, live, passes):
    """Keep where a kernel is that ends since its log is full."""
    for k, number in enumerate((*place, live, passes)):
        log.going[k] = number


def gone_on(log):
    """The place where a kernel goes on: (`ThreadPlace`, live lanes, passes)."""
    if log is None:
        return ThreadPlace(0, 0, 0), 0, 0
    i, stop, drawn, live, passes = tuple(log.going[k] for k in range(GOING))
    for k in range(GOING):
        log.going[k] = 0
    return ThreadPlace(i, stop, drawn), live, passes

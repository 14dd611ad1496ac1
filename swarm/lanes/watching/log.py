"""The log of impacts: a row for each impact that a kernel counts, in arrays that another thread writes to a file.

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

# The state that a kernel leaves when it ends with a full log: particle, stop, draws, live lanes, passes.
GOING = 5

_named = Rows()


class BeforeContact(LaneView):
    """A lane before its contact: its flight, the wall, and the impulse of the wall since then."""

    r, v, remaining = _named.vector(), _named.vector(), _named.number()
    hits, wall, impulse = _named.number(), _named.number(), _named.number()


ROWS = _named.count


class Lasted(Record):
    """The record of a contact that takes time."""

    duration: float  # [s]
    largest_force: float  # along the normal [N]
    friction_loss: float  # by friction, and by the resistance to rolling [J]


class Struck(Record):
    """An impact of a particle on a wall or on another particle, or its passage through an opening."""

    particle: Any
    wall: Any  # -1 if it meets a particle, below -1 a counter
    time: float  # [s]
    r: Vec
    before: Vec  # velocity before
    after: Vec  # velocity after
    impulse: float  # along the normal [N s]
    slip: Vec = ZERO  # relative to the wall, before the impact
    partner: Any = -1
    lasted: Any = None  # `Lasted`, for a contact that takes time
    images: Vec = ZERO  # the cell, relative to that where the particle is booked


class Log(NamedTuple):
    """Arrays with an entry for each row, `filled` so far, and the choice of rows."""

    time: Array  # (rows,) [s]
    particle: Array  # (rows,) int32
    wall: Array  # (rows,) int32, its number in the scene
    position: Array  # (rows, 3) [m], in the periodic cell if there is one
    velocity_before: Array  # (rows, 3) [m/s]
    velocity_after: Array  # (rows, 3)
    impulse: Array  # (rows,) [N s], along the wall's normal
    slip: Any  # (rows, 3) [m/s] tangential velocity relative to the wall, before; None without friction
    image: Any  # (rows, 3) int32, the cell of the position; None if the scene is not periodic
    partner: Any  # (rows,) int32, the particle that is met, -1 at a wall; None if particles do not meet
    duration: Any  # (rows,) of the contacts of grains, as in `Lasted`; None for impacts
    largest_force: Any
    friction_loss: Any
    filled: Array  # (2,) int64, the number of rows, and of rows that had no room
    going: Array  # (GOING,) int64
    order: Array  # int64, the lanes of a pass that have a row
    chosen: Any  # (N,) bool, the particles that have rows; None: all
    begin: float  # of the frame [s]
    end: float
    room: int  # rows that one pass may have

    def keep_before(self, lanes, live):
        """Keep the state of every lane before its contact."""
        for i in range(index(live)):
            lane, before = lanes.lane(i), BeforeContact(lanes.before, i)
            before.r, before.v, before.remaining, before.hits = lane.r, lane.v, lane.remaining, lane.hits
            before.wall, before.impulse = lanes.wall[i], 0.0

    def note(self, lanes, i, impulse):
        """Note the impulse per mass of the wall of a lane."""
        BeforeContact(lanes.before, i).impulse += impulse

    @outlined
    def add_rows(self, method, walls, state, lanes, live):
        """Add a row for each lane with one more impact than before its contact, unless contacts take time."""
        if method.laws_at_ends is not None:
            return
        order, n = self.order, index(0)
        for i in range(index(live)):
            order[n] = i
            n += index((lanes.lane(i).hits > BeforeContact(lanes.before, i).hits) & self.has(lanes.particle[i]))
        for k in range(n):
            i = index(order[k])
            before, p = BeforeContact(lanes.before, i), lanes.particle[i]
            impulse, time = before.impulse * state.mass[index(p)], self.end - before.remaining
            struck = Struck(p, before.wall, time, before.r, before.v, lanes.lane(i).v, impulse)
            self._add(state.image, self.with_slip(method.laws, walls.at(before.remaining), struck))

    @outlined
    def hit(self, image, struck):
        """Add a row for an impact, if one of its particles has rows."""
        if self.has(struck.particle) or (struck.partner >= 0 and self.has(struck.partner)):
            self._add(image, struck)

    @outlined
    def ended(self, image, struck, images):
        """Add a row for a contact that has ended in a step, as `hit`, shifted by `images` cells, if there is room."""
        if self.filled[0] >= self.time.size:
            self.filled[1] += 1
            return
        first = self.filled[0]
        self.hit(image, struck)
        self.shift(first, images)

    def add_crossing(self, state, particle, there, number, images):
        """Add a row for a particle that crosses a counter at the lane `there`; number = 2 counter + sense."""
        if not self.has(particle):
            return
        # The rest of the rows is for the impacts of this pass.
        if self.filled[0] + LANES >= self.time.size:
            self.filled[1] += 1
            return
        time = self.end - there.remaining
        crossing = Struck(particle, -1.0 - number, time, there.r, there.v, there.v, 0.0, images=images)
        self._add(state.image, crossing)

    def shift(self, first, images):
        """Shift the rows from `first` on by `images` cells."""
        if self.image is not None:
            for k in range(first, self.filled[0]):
                for axis, images_along in enumerate(images):
                    self.image[index(k), axis] += np.int32(images_along)

    def has(self, particle):
        """Whether a particle has rows."""
        return True if self.chosen is None else self.chosen[index(particle)]

    def with_slip(self, laws, now, struck, touch=None):
        """Return a `Struck` with the velocity along the wall, if the log has it; `now` are the walls at that time.

        A ball is in contact with the wall at `touch`, by default at its place.
        """
        if self.slip is None:
            return struck
        place = struck.r if touch is None else touch
        n, u = now.unit_normal(struck.wall, struck.r), wall_velocity(laws.moving, now, struck.wall, place)
        before = relative(u, struck.before)
        return struck._replace(slip=before - dot(before, n) * n)

    def _add(self, image, struck):
        k, p = index(self.filled[0]), index(struck.particle)
        self.filled[0] += 1
        self.time[k] = max(self.begin, struck.time)
        self.particle[k], self.wall[k] = np.int32(struck.particle), np.int32(struck.wall)
        _put(self.position, k, struck.r)
        _put(self.velocity_before, k, struck.before)
        _put(self.velocity_after, k, struck.after)
        self.impulse[k] = struck.impulse
        if self.slip is not None:
            _put(self.slip, k, struck.slip)
        if self.image is not None:
            for axis, images_along in enumerate(struck.images):
                self.image[k, axis] = np.int32(image[axis, p] + images_along)
        if self.partner is not None:
            self.partner[k] = np.int32(struck.partner)
        if self.duration is not None:
            self.duration[k] = self.largest_force[k] = self.friction_loss[k] = 0.0
            if struck.lasted is not None:
                self.duration[k], self.largest_force[k] = struck.lasted.duration, struck.lasted.largest_force
                self.friction_loss[k] = struck.lasted.friction_loss


def _put(rows, k, vector):
    rows[k, 0], rows[k, 1], rows[k, 2] = vector.x, vector.y, vector.z


# --- A log that is full ----------------------------------------------------------------------------------


def is_full(log):
    """Whether a pass may need more rows than there is room for."""
    return False if log is None else log.filled[0] + log.room > log.time.size


def keep_going(log, place, live, passes):
    """Keep the state of a kernel that ends because its log is full."""
    for k, number in enumerate((*place, live, passes)):
        log.going[k] = number


def gone_on(log):
    """Return the state from which a kernel continues: (`ThreadPlace`, live lanes, passes)."""
    if log is None:
        return ThreadPlace(0, 0, 0), 0, 0
    i, stop, drawn, live, passes = tuple(log.going[k] for k in range(GOING))
    for k in range(GOING):
        log.going[k] = 0
    return ThreadPlace(i, stop, drawn), live, passes

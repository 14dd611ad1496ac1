"""The particles that slide, one in each lane: their rows, and the accounts of impulses and works at their walls."""

from typing import Any

import numpy as np

from ..contact import hold
from ..contact import sliding as slides
from ..contact.events import EDGE, HELD
from ..kernel.jit import Array, outlined
from ..kernel.record import Record
from .table import STRIDE, Advanced, Rows, copy_lane, table
from .watching.counted_lanes import BEGAN

# The events that end a step.
LIFTED, MET, FAILED, STOPPED, STUCK, LEAVES, OPENS, ENDS = 1, 2, 4, 8, 16, 32, 64, 128
# A lane goes on to stay.
AGAIN = -1

_named = Rows()


class Sliding(Advanced):
    """A particle that slides, in its lane. Without a second wall the numbers of that wall are 0."""

    r, v, a = _named.vector(), _named.vector(), _named.vector()
    # The numbers of its walls, -1 for none, and their forces on it.
    first, second, press, press_second = _named.number(), _named.number(), _named.number(), _named.number()
    # The time left, the next step, the time at which a step is cut, and how often the step has been cut.
    remaining, step, cut, trials = _named.number(), _named.number(), _named.number(), _named.number()
    # The speed that it keeps across the walls, twice its energy, the square of its speed scale.
    keep, twice, scale2 = _named.number(), _named.number(), _named.number()
    # The particle and the time left at the last look.
    looked_particle, looked_left = _named.number(), _named.number()
    # The rows of a particle; the following rows are of the step in a pass.
    ROWS = _named.count

    # Its length, the state of the composition so far, and the forces of the walls at its end.
    h, r1, v1 = _named.number(), _named.vector(), _named.vector()
    press1, press1_second = _named.number(), _named.number()
    # Its impulses, the work of friction, and twice the work of the second wall, for moving walls.
    impulse, impulse_second = _named.number(), _named.number()
    work, given_by_second = _named.number(), _named.number()
    # The allowed error, and the most by which the last sweep but one may move r1.
    allowed, still = _named.number(), _named.number()
    # For the current part of the composition: w0, the last guess of its end, the direction in which it slides.
    w, end, toward = _named.vector(), _named.vector(), _named.vector()
    # The changes of velocity that the accelerations of the last two parts would make in the whole step.
    change, before = _named.vector(), _named.vector()
    ALL = _named.count


class SlidingLanes(Record):
    """Arrays with a column for each lane."""

    rows: Array  # (Sliding.ALL, stride)
    particle: Array  # int64
    unsolved: Array  # bool, whether the sweeps of a step go on; at its end, whether the step is taken
    event: Array  # int64, the events of the step in this pass
    gained: Array  # twice the work of moving walls per mass, in the step of this pass
    after: Array  # twice the energy per mass at its end
    period: Any  # the periodic cell
    openings: Any  # of the walls, or None
    began: Any = None  # the state of a lane before its step, where there are counters

    def lane(self, i):
        """The rows of a lane."""
        return Sliding(self.rows, i)

    def move(self, source, target):
        """Move the last live lane to the free slot."""
        copy_lane(self.rows, source, self.rows, target, Sliding.ROWS)
        if self.began is not None:
            copy_lane(self.began, source, self.began, target, BEGAN)
        self.particle[target] = self.particle[source]


def empty_sliding(state: Any) -> SlidingLanes:
    """Allocate lanes for one block of a state."""
    particle, unsolved, event = np.zeros(STRIDE, np.int64), np.zeros(STRIDE, np.bool_), np.zeros(STRIDE, np.int64)
    began = None if state.crossed is None else table(BEGAN)
    return SlidingLanes(table(Sliding.ALL), particle, unsolved, event, *table(2), state.period, state.openings, began)


class Slide(Record):
    """A call of the kernel of sliding particles: the kind (one wall or two), the method, and the lanes."""

    kind: Any
    method: Any
    walls: Any
    gravity: Any
    state: Any
    lanes: SlidingLanes
    counts: Any = None  # `Share.counts`

    def phase(self):
        """The phase of particles held by one wall, or by two."""
        return EDGE if isinstance(self.kind, hold.Two) else HELD

    def moving(self):
        """The numbers of the walls if some move, else None."""
        return self.method.laws.moving

    def moves(self):
        """Whether walls move: a constant for the compiler."""
        return self.moving() is not None

    def active(self, lane):
        """Return the walls that hold a lane."""
        return self.kind.of_lane(lane.first, lane.second)

    def force(self, lane, now, r, v):
        """Return the force on a lane at a place, from the walls of this instant."""
        return slides.force(self.method.laws, self.active(lane), now, self.gravity, r, v)

    @outlined
    def with_kept(self, now, lane):
        """Return the velocity of a lane with the speed that it keeps across its walls."""
        v, keep = lane.v, lane.keep
        if not keep > 0.0:
            return v
        active = self.active(lane)
        taken = active.split_at(now, None, lane.r, v)
        return v + keep * active.inward(taken.n, taken.m)

    # --- Accounts

    def account(self, i):
        """Book a step that has been taken."""
        lanes, lane = self.lanes, self.lanes.lane(i)
        if not lanes.unsolved[i]:
            return
        self.stay(i, lane.h)
        self.push(i, lane.impulse, lane.impulse_second)
        lane.trials = 0.0
        if self.method.laws.friction is not None:
            self.lose(i, lane.work)
        if self.moves():
            self.work(i, lanes.gained[i], lane.given_by_second)

    def stay(self, i, time):
        """Book a time on the walls that hold a lane [s]."""
        self.state.contacts.sliding[self.lanes.particle[i]] += time
        if self.counts is not None:
            self.counts.stay(self.lanes.lane(i).first, time)

    def push(self, i, first, second):
        """Book impulses per mass on the walls that hold a lane."""
        state, lane, p = self.state, self.lanes.lane(i), self.lanes.particle[i]
        state.impulse[self.walls.row(lane.first), p] += first * state.mass[p]
        if lane.second >= 0.0:
            state.impulse[self.walls.row(lane.second), p] += second * state.mass[p]

    def work(self, i, twice, second):
        """Book twice the work per mass of moving walls; `second` of it is of the second wall."""
        state, lane, p = self.state, self.lanes.lane(i), self.lanes.particle[i]
        behind = state.impulse.shape[0] // 2
        state.energy[p] = 0.5 * lane.twice
        state.impulse[behind + self.walls.row(lane.first), p] += 0.5 * (twice - second) * state.mass[p]
        if lane.second >= 0.0:
            state.impulse[behind + self.walls.row(lane.second), p] += 0.5 * second * state.mass[p]

    def cross(self, i, twice):
        """Book the work of the walls when the speed that a lane keeps across them joins its velocity, or leaves it."""
        lane = self.lanes.lane(i)
        lane.twice += twice
        self.work(i, twice, 0.0)

    def lose(self, i, twice):
        """Book a loss of twice the energy per mass of a lane, which its row has already."""
        state, p = self.state, self.lanes.particle[i]
        state.energy[p] = 0.5 * self.lanes.lane(i).twice
        state.dissipated[p] += 0.5 * twice * state.mass[p]

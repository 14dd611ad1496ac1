"""The rows of a ball between two events: two lines of the cache, and its node of the queue.

One line is the flight: position and velocity at a time, that of the last impact. The other line is the next events.
Both lines also hold whole numbers, as a view of the same memory.
"""

import math
from typing import Any, NamedTuple

from ...kernel.arrays import index
from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import Array, select
from ...kernel.vector import ZERO, Vec, either
from ...state import BELOW, ROUND

# Numbers of a row, and whole numbers in the same memory.
FLOATS, WHOLES = 8, 16
# Floats of a flight: position [m], velocity [m/s], their time [s of the epoch].
_X, _V, TIME = 0, 3, 6
# Whole numbers of a flight: the ball after it in its cell; and the face by which it leaves the cell, plus `BELOW`
# times the number of times that `MET` has begun anew.
AFTER, FACE = 14, 15
# Floats of the next events, their times [s of the epoch]: a collision, the end of the cell, a wall. Then twice the
# energy per mass with which the ball left a wall, for the next one, as squares of velocities alone have a bias; NaN if
# its last impact was not on a wall.
MEETS, LEAVES, DUE, _TWICE = 0, 1, 2, 3
# Whole numbers of the next events: the partner of the collision, and how often the velocity of the partner had changed
# when the collision was found; how often the velocity of the ball has changed, and how often it has collided; its cell;
# the wall.
PARTNER, SEEN, STAMP, MET, CELL, WALL = 8, 9, 10, 11, 12, 15
# The first number stands for no ball, the second one for a number of changes that no ball has.
NO_PARTNER, NEVER = -1, -1


class Flock(NamedTuple):
    """The balls of a run."""

    flight: Array  # (8 N) numbers of flights
    event: Array  # (8 N) numbers of next events
    link: Array  # (16 N) int32, the memory of flights
    tag: Array  # (16 N) int32, the memory of next events
    node: Array  # (N) int32, the place of each ball in the queue
    key: Array  # the time of the next event at each node of the queue
    item: Array  # int32, the ball of each node
    head: Array  # int32, the first ball in each cell, or `NO_PARTNER`
    last: Any = None  # (N) the time of the last collision [s of the epoch]; None where no energy is lost
    freedoms: Any = None  # the `Freedoms` of walls with a mass, or None
    followed: Any = None  # (N) until when the flight of each ball is counted [s of the epoch]; None without counters
    holds: Any = None  # 1.0 where walls may hold balls, or None; the flight of a held ball begins later than now

    def number(self):
        """The number of balls."""
        return self.node.size

    def time(self, i):
        """The time of the last impact of a ball."""
        return self.flight[index(FLOATS * i + TIME)]

    def stamp(self, i):
        """How often the velocity of a ball has changed."""
        return self.tag[index(WHOLES * i + STAMP)]

    def place(self, i):
        """The position of a ball at its last impact."""
        return self._vector(i, _X)

    def velocity(self, i):
        """The velocity of a ball after its last impact."""
        return self._vector(i, _V)

    def _vector(self, i, k):
        row = FLOATS * i + k
        return Vec(self.flight[index(row)], self.flight[index(row + 1)], self.flight[index(row + 2)])

    def is_held(self, i, now):
        """Whether a wall holds a ball at a time."""
        return False if self.holds is None else self.time(i) > now

    def at(self, pull, i, now):
        """The position and the velocity of a ball at a time, in flight or held."""
        way, v = now - self.time(i), self.velocity(i)
        if self.holds is not None:
            way, v = select(way < 0.0, 0.0, way), either(way < 0.0, ZERO, v)
        return self.place(i) + displacement(pull, v, way), accelerated(pull, v, way)

    def put(self, i, now, r, v):
        """Store the flight of a ball from a time on, with another velocity."""
        row = FLOATS * i
        for k, value in enumerate((*r, *v, now)):
            self.flight[index(row + k)] = value
        self.tag[index(WHOLES * i + STAMP)] += 1
        self.keep(i, math.nan)

    def kept(self, i, otherwise):
        """Twice the energy per mass with which a ball left a wall; `otherwise` if its last impact was not on a wall."""
        twice = self.event[index(FLOATS * i + _TWICE)]
        return select(math.isnan(twice), otherwise, twice)

    def keep(self, i, twice):
        """Store twice the energy per mass with which a ball leaves a wall, or NaN for none."""
        self.event[index(FLOATS * i + _TWICE)] = twice

    def wall(self, i):
        """The number of the next wall of a ball, or one of the numbers of window.py."""
        return float(self.tag[index(WHOLES * i + WALL)])

    def aim_at(self, i, wall):
        """Store the number of the next wall of a ball."""
        self.tag[index(WHOLES * i + WALL)] = int(wall)

    def face(self, i):
        """The face by which a ball leaves its cell, or has come into it."""
        return self.link[index(WHOLES * i + FACE)] & (BELOW - 1)

    def leave_by(self, i, face):
        """Store the face by which a ball leaves its cell."""
        self.link[index(WHOLES * i + FACE)] += face - self.face(i)

    def begin_counts_anew(self, i):
        """Begin the counts of a ball anew; its partner's flight gets the number 0, or `NEVER` if it is out of date."""
        row = WHOLES * i
        if self.tag[index(row + MET)] >= ROUND:
            self.tag[index(row + MET)] -= ROUND
            self.link[index(row + FACE)] += BELOW
        mate = self.tag[index(row + PARTNER)]
        if mate >= 0:
            is_same = self.tag[index(row + SEEN)] == self.stamp(mate)
            self.tag[index(row + SEEN)] = select(is_same, 0, NEVER)

    def after(self, i):
        """The next ball in the cell of a ball, or `NO_PARTNER`."""
        return self.link[index(WHOLES * i + AFTER)]

    def cell(self, i):
        """The numbers of the cell of a ball along the axes."""
        row = WHOLES * i + CELL
        return self.tag[index(row)], self.tag[index(row + 1)], self.tag[index(row + 2)]

    def next_of(self, i):
        """The time of the next event of a ball."""
        row = FLOATS * i
        soonest = min(self.event[index(row + MEETS)], self.event[index(row + LEAVES)])
        return min(soonest, self.event[index(row + DUE)])

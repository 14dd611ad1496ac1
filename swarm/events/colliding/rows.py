"""What a run knows of each ball between two events: two lines of the cache, and its node of the queue.

One line is the flight: position and velocity at a time, which is that of the last impact. The other one is what is
next. Both hold whole numbers too, as a view of the same memory.
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
# Of a flight: position [m], velocity [m/s], their time [s since the epoch].
_X, _V, TIME = 0, 3, 6
# Whole numbers of a flight: the ball after it in its cell; and the face by which it leaves the cell, below `BELOW`,
# plus so many times how often `MET` has begun anew.
AFTER, FACE = 14, 15
# Of what is next [s since the epoch]: a collision, the end of the cell, a wall. And twice the energy per mass with
# which it left a wall, for the next one: squares of velocities alone have a bias. NaN: its last impact was no wall's.
MEETS, LEAVES, DUE, _TWICE = 0, 1, 2, 3
# Whole numbers of what is next: the ball that it collides with, and how often the velocity of that ball had changed
# when this was found; how often its own has changed, and how often it has collided; its cell; the wall.
PARTNER, SEEN, STAMP, MET, CELL, WALL = 8, 9, 10, 11, 12, 15
# Of no ball, and the number of changes that no ball has.
NO_PARTNER, NEVER = -1, -1


class Flock(NamedTuple):
    """The balls of a run."""

    flight: Array  # (8 N) numbers of flights
    event: Array  # (8 N) numbers of what is next
    link: Array  # (16 N) int32, the memory of flights
    tag: Array  # (16 N) int32, the memory of what is next
    node: Array  # (N) int32, its place in the queue
    key: Array  # of the nodes of the queue: the time of what is next
    item: Array  # int32, the ball of each node
    head: Array  # int32 of each cell: the first ball in it, or `NO_PARTNER`
    last: Any = None  # (N) when each met another ball last [s since the epoch]; None where nothing loses any
    freedoms: Any = None  # of walls with a mass, or None
    followed: Any = None  # (N) until when counters know the flight of each [s since the epoch]; None without counters
    holds: Any = None  # 1.0 where walls may hold balls: the flight of one that is held begins later than now; or None

    def number(self):
        """The number of balls."""
        return self.node.size

    def time(self, i):
        """The time of its last impact."""
        return self.flight[index(FLOATS * i + TIME)]

    def stamp(self, i):
        """How often its velocity has changed."""
        return self.tag[index(WHOLES * i + STAMP)]

    def place(self, i):
        """Its position then."""
        return self._vector(i, _X)

    def velocity(self, i):
        """Its velocity then."""
        return self._vector(i, _V)

    def _vector(self, i, k):
        row = FLOATS * i + k
        return Vec(self.flight[index(row)], self.flight[index(row + 1)], self.flight[index(row + 2)])

    def is_held(self, i, now):
        """Whether a wall holds it at a time."""
        return False if self.holds is None else self.time(i) > now

    def at(self, pull, i, now):
        """Its position and its velocity at a time, in flight or held."""
        way, v = now - self.time(i), self.velocity(i)
        if self.holds is not None:
            way, v = select(way < 0.0, 0.0, way), either(way < 0.0, ZERO, v)
        return self.place(i) + displacement(pull, v, way), accelerated(pull, v, way)

    def put(self, i, now, r, v):
        """Store its flight from a time on, with another velocity."""
        row = FLOATS * i
        for k, value in enumerate((*r, *v, now)):
            self.flight[index(row + k)] = value
        self.tag[index(WHOLES * i + STAMP)] += 1
        self.keep(i, math.nan)

    def kept(self, i, otherwise):
        """Twice the energy per mass with which it left a wall, if that was its last impact."""
        twice = self.event[index(FLOATS * i + _TWICE)]
        return select(math.isnan(twice), otherwise, twice)

    def keep(self, i, twice):
        """Store twice the energy per mass with which it leaves a wall; NaN: forget it."""
        self.event[index(FLOATS * i + _TWICE)] = twice

    def wall(self, i):
        """The number of its next wall, or one of those of window.py."""
        return float(self.tag[index(WHOLES * i + WALL)])

    def aim_at(self, i, wall):
        """Store the number of its next wall."""
        self.tag[index(WHOLES * i + WALL)] = int(wall)

    def face(self, i):
        """The face by which it leaves its cell, or has come into it."""
        return self.link[index(WHOLES * i + FACE)] & (BELOW - 1)

    def leave_by(self, i, face):
        """Store the face by which it leaves its cell."""
        self.link[index(WHOLES * i + FACE)] += face - self.face(i)

    def begin_counts_anew(self, i):
        """Let its counts be far from their last numbers; 0 is the number of its flight for all that have seen it."""
        row = WHOLES * i
        if self.tag[index(row + MET)] >= ROUND:
            self.tag[index(row + MET)] -= ROUND
            self.link[index(row + FACE)] += BELOW
        mate = self.tag[index(row + PARTNER)]
        if mate >= 0:
            is_same = self.tag[index(row + SEEN)] == self.stamp(mate)
            self.tag[index(row + SEEN)] = select(is_same, 0, NEVER)

    def after(self, i):
        """The ball after it in its cell, or `NO_PARTNER`."""
        return self.link[index(WHOLES * i + AFTER)]

    def cell(self, i):
        """The numbers of its cell along the axes."""
        row = WHOLES * i + CELL
        return self.tag[index(row)], self.tag[index(row + 1)], self.tag[index(row + 2)]

    def next_of(self, i):
        """When the first of what is next comes."""
        row = FLOATS * i
        soonest = min(self.event[index(row + MEETS)], self.event[index(row + LEAVES)])
        return min(soonest, self.event[index(row + DUE)])

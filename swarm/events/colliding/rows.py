"""What a run knows of each ball between two events: two lines of the cache, and its node of the queue.

One line is the flight: position and velocity at a time, which is that of the last impact. The other one is what is
next; it holds whole numbers too, as a view of the same memory.
"""

from typing import Any, NamedTuple

from ...kernel.arrays import index
from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import Array, select
from ...kernel.vector import ZERO, Vec, either

# Numbers of a row, and whole numbers in the same memory.
FLOATS, WHOLES = 8, 16
# Of a flight: position [m], velocity [m/s], their time [s since the epoch], the radius [m].
_X, _V, TIME, RADIUS = 0, 3, 6, 7
# Of what is next [s since the epoch]: a collision, the end of the cell, a wall; and which wall.
MEETS, LEAVES, DUE, WALL = 0, 1, 2, 3
# Whole numbers of what is next: the ball that it collides with, and how often the velocity of that ball had changed
# when this was found; how often its own has changed, and how often it has collided; its cell; the face by which it
# leaves the cell.
PARTNER, SEEN, STAMP, MET, CELL, FACE = 8, 9, 10, 11, 12, 15
# Of no ball.
NO_PARTNER = -1


class Kept(NamedTuple):
    """The energy with which balls left a wall, for the next one: squares of velocities alone have a bias."""

    twice: Array  # (N) twice that per mass
    stamp: Array  # (N) int32, of the flight that has it

    def at(self, i, stamp, otherwise):
        """That of a ball, if its flight is still that one."""
        return select(self.stamp[index(i)] == stamp, self.twice[index(i)], otherwise)

    def keep(self, i, stamp, twice):
        """Store it."""
        self.twice[index(i)], self.stamp[index(i)] = twice, stamp


class Flock(NamedTuple):
    """The balls of a run."""

    flight: Array  # (8 N) numbers of flights
    event: Array  # (8 N) numbers of what is next
    tag: Array  # (16 N) int32, the same memory
    node: Array  # (N) int32, its place in the queue
    key: Array  # of the nodes of the queue: the time of what is next
    item: Array  # int32, the ball of each node
    room: Array  # int32 of each cell: how many balls are in it, and these
    last: Any = None  # (N) when each met another ball last [s since the epoch]; None where nothing loses any
    kept: Any = None  # `Kept`, None where there are no walls
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

    def cell(self, i):
        """The numbers of its cell along the axes."""
        row = WHOLES * i + CELL
        return self.tag[index(row)], self.tag[index(row + 1)], self.tag[index(row + 2)]

    def next_of(self, i):
        """When the first of what is next comes."""
        row = FLOATS * i
        soonest = min(self.event[index(row + MEETS)], self.event[index(row + LEAVES)])
        return min(soonest, self.event[index(row + DUE)])

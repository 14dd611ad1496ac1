"""The arrays of soft balls: of each ball a row or two, of each contact of a step one, in the order of the balls' cells.

A row is one line of the cache. Balls that are beside one another are so in memory, so that most contacts find theirs
there.
"""

from typing import Any, NamedTuple

import numpy as np

from ..kernel.arrays import aligned, aligned_copy, index, spaced
from ..kernel.jit import Array
from ..kernel.lines import LANES
from ..kernel.record import Record
from ..kernel.vector import Vec, column, put

# Columns of `Grains.place`: the centre, what round-off has taken of it, the radius, 1/mass.
X, LOST, RADIUS, LIGHTNESS = 0, 3, 6, 7
# Columns of `Grains.speed`: at the start of a step, and at its end. Of `Grains.spin` also the radius again, and what
# turns the ball, m R/I: what friction reads of a ball is then in two lines.
BEFORE, AFTER, ARM, LEVER = 0, 3, 6, 7
# Columns of `Grains.change`: that of the velocity in the last step, with which the next one begins to solve, and that
# by the impulses of pairs in this one.
LAST, GIVEN = 0, 4
# All of these are of a line of the cache.
COLUMNS_OF_BALLS = 8
# Columns of a contact: s0, from one centre to the other at the start of a step, or the centre; |s0|, or the inner
# function of the wall; the gap; the size of the impulse, and the impulse; h/2 times the velocity at the start; the
# damping; the gain of a Newton step; what makes its changes relative ones; and of both balls of a pair 1/m. A sweep
# without friction reads no more.
START, SIZE, GAP, PUSH, IMPULSE, COAST, DAMPING, GAIN, SCALE, EASES = 0, 3, 4, 5, 6, 9, 12, 13, 14, 15
COLUMNS_SWEPT = 17
# The inverse of the mass that moves, the impulse of friction, and of a pair 1/(R_i + R_j) and what turns both balls.
EASE, DRAG, NEARNESS, LEVERS, COLUMNS_RUBBED = 17, 18, 21, 22, 24
# Of a wall the place in the lists, the angular impulse of the resistance to rolling, and what both take.
LISTED, ROLL, RUBBED, COLUMNS = 24, 25, 28, 29
# Columns of `Touches.found`, and rows of a group in `Tile.ends`: both balls, and the place in the lists.
ONE, OTHER, PLACE, FOUND, ENDS = 0, 1, 2, 3, 3
# Columns of `Touches.course`: the centre at the start of a step, the radius, the move in the step, and 1/mass: what is
# asked of every pair that is listed is then in one line.
FROM, EXTENT, MOVE, YIELDING = 0, 3, 4, 7
# Columns of `Neighbours.drag`: where the angular impulse of the resistance to rolling is kept; and in a run with a log
# of contacts when each has begun, the sum of its normal impulses, the largest force, what friction has taken, and the
# velocity, of a pair that of the particle with the smaller number, and the slip at its start.
KEPT_ROLL = 3
BEGAN, PRESSED, FORCE, TAKEN_OFF, ARRIVED, SLIP, KEPT = 6, 7, 8, 9, 10, 13, 16
# Columns of `Neighbours.spans`: where those of a field begin in `listed` and end, and of which face they are.
BEGIN, END, FACE = 0, 1, 2
# Of a clock: the steps of the frame that are done, those since pairs were listed, and those since the run was halted
# last; the skin of the lists [m].
DONE, SINCE, TAKEN, SKIN, CLOCK = 0, 1, 2, 3, 4


# 1/(2/5), of the moment of inertia of a ball.
ROUNDNESS = 2.5


class Grains(NamedTuple):
    """Each ball, in the order of cells."""

    number: Array  # (N,) that of its particle
    place: Array  # (N, 8)
    speed: Array  # (N, 8)
    listed: Array  # (N, 4) where it was when pairs were listed
    change: Array  # (N, 8) of its velocity
    spin: Any  # (N, 8) angular velocities, as `speed`; None where there is no friction


class Neighbours(NamedTuple):
    """What is near: of each ball those after it, of each wall the balls."""

    first: Array  # (N + 1,) where the pairs of each ball begin
    mate: Array  # (room,) int32, the other ball of each pair
    is_on: Array  # (room,) bool, whether it is among the contacts of this step
    wall_first: Array  # (walls + 1,)
    slot: Array  # (room of walls,) int32
    wall_is_on: Array
    drag: (
        Any  # (room, 3) the impulse of friction of each pair in the last step, with that of rolling (room, 6), or None
    )
    wall_drag: Any
    # Of a scene with fields, else None
    spans: Any = None  # (room of walls, 3) int32, what of a field is near
    listed: Any = None  # (room of members,) int32, its members
    used: Any = None  # (1,) how many of these there are, listed or not
    # Of a scene with openings, else None
    wall_is_open: Any = None  # (room of walls,) bool, whether the wall is open to the ball


class Tile(NamedTuple):
    """The contacts of pairs in groups, a row of each group for each column."""

    rows: Array  # (groups * COLUMNS, LANES)
    ends: Array  # (groups * ENDS, LANES) int32


with_lanes = spaced(LANES)


class Touches(NamedTuple):
    """The contacts of a step: of pairs, and of walls."""

    tile: Tile  # those of pairs
    lanes: Array  # (groups,) int64, how many contacts each group has
    splits: Array  # (groups,) int64, the lanes, as bits, where a part begins: no ball is twice in a part of a group
    marks: Array  # (N,) int64, of each ball the last part that it is in
    course: Array  # (N, 8)
    stirred: Array  # (N,) int32, of each ball the last sweep for friction in which one of its contacts was not solved
    used: Array  # (2,) how many contacts of pairs there are, and how many groups
    found: Array  # (room + 1, FOUND) int32, the contacts of pairs as they were found
    missed: Array  # (room + 1, FOUND) int32, the pairs that have missed one another by no more than the margin
    passed: Array  # (1,) how many of these there are
    margin: Array  # (1,) [m]
    wall_rows: Array  # (room of walls, COLUMNS)
    wall_ends: Array  # (room of walls,) int32, the ball
    wall_spans: Array  # (2, walls) where those of each wall begin in `wall_rows`, and how many there are
    spans: Any = None  # (room of walls, 3) int32, of fields, as in `Neighbours`; and the same members
    listed: Any = None


class OfWall(Record):
    """A contact with a wall."""

    rows: Any
    c: Any

    def listed(self):
        """The place in the lists."""
        return index(int(self.rows[self.c, LISTED]))

    def number(self, k):
        """What is in a column."""
        return self.rows[self.c, k]

    def vector(self, k):
        """The vector in three columns."""
        return vector_at(self.rows, self.c, k)

    def set_vector(self, k, a):
        """Store a vector into three columns."""
        set_vector(self.rows, self.c, k, a)


class OfPair(Record):
    """A contact of a pair: the first rows of its group, of its numbers and of the balls, and its lane."""

    rows: Any
    q: Any
    ends: Any
    e: Any
    lane: Any

    def listed(self):
        """The place in the lists."""
        return index(self.ends[self.e + PLACE, self.lane])

    def number(self, k):
        """What is in a column."""
        return self.rows[self.q + k, self.lane]

    def vector(self, k):
        """The vector in three columns."""
        return column(self.rows, self.q + k, self.lane)

    def set_vector(self, k, a):
        """Store a vector into three columns."""
        put(self.rows, self.q + k, self.lane, a)


def vector_at(rows: Any, c: Any, k: Any) -> Vec:
    """The vector in three columns of a row."""
    return Vec(rows[c, k], rows[c, k + 1], rows[c, k + 2])


def set_vector(rows: Any, c: Any, k: Any, a: Vec) -> None:
    """Store a vector into three columns of a row."""
    rows[c, k], rows[c, k + 1], rows[c, k + 2] = a.x, a.y, a.z


def grains_of(position: Any, velocity: Any, radius: Any, mass: Any, spin: Any = None) -> Grains:
    """The rows of balls, in the order of their numbers."""
    n = len(mass)
    place, speed = _lines(n), _lines(n)
    place[:, X : X + 3], speed[:, BEFORE : BEFORE + 3] = position.T, velocity.T
    place[:, RADIUS], place[:, LIGHTNESS] = radius, 1.0 / mass
    turning = None if spin is None else _lines(n)
    if turning is not None:
        turning[:, BEFORE : BEFORE + 3] = spin.T
        turning[:, ARM], turning[:, LEVER] = radius, ROUNDNESS / radius
    return Grains(np.arange(n), place, speed, np.zeros((n, 4)), _lines(n), turning)


def _lines(n: int) -> Array:
    """Rows of so many balls, each a line of the cache."""
    return aligned(COLUMNS_OF_BALLS * n).reshape(n, COLUMNS_OF_BALLS)


def beside(grains: Grains, more: Grains) -> Grains:
    """The rows of balls, and behind them those of more."""
    pairs = zip(grains, more, strict=True)
    rows: Any = (None if old is None else aligned_copy(np.concatenate([old, new])) for old, new in pairs)
    return Grains(*rows)


def near_of(
    n: int, walls: int, pairs: int, touching: int, kept: int = 0, members: int | None = None, opens: bool = False,
) -> Neighbours:  # fmt: skip
    """Room for so many pairs, for so many balls at walls, and so many members of fields, where there are any.

    Of each contact so many numbers are kept from step to step.
    """
    drags = (np.zeros((pairs, kept)), np.zeros((touching, kept))) if kept else (None, None)
    made = Neighbours(
        np.zeros(n + 1, np.int64), np.zeros(pairs, np.int32), np.zeros(pairs, np.bool_),
        np.zeros(walls + 1, np.int64), np.zeros(touching, np.int32), np.zeros(touching, np.bool_), *drags,
    )  # fmt: skip
    if opens:
        made = made._replace(wall_is_open=np.zeros(touching, np.bool_))
    if members is None:
        return made
    spans, listed = np.zeros((touching, 3), np.int32), np.zeros(members, np.int32)
    return made._replace(spans=spans, listed=listed, used=np.zeros(1, np.int64))


def touches_of(n: int, walls: int, pairs: int, touching: int, listed: Any = None) -> Touches:
    """Room for the contacts of so many pairs and of so many balls at walls; `Neighbours` has the members of fields."""
    # One more for those that are found by a step that has been solved without them, and one to ask for beside the last.
    groups = -(-pairs // LANES) + 2
    tile = Tile(
        aligned(groups * COLUMNS * LANES).reshape(-1, LANES), np.zeros((groups * ENDS, LANES), np.int32)
    )  # fmt: skip
    return Touches(
        tile, np.zeros(groups, np.int64), np.zeros(groups, np.int64), np.zeros(n, np.int64),
        _lines(n), np.zeros(n, np.int32),
        np.zeros(2, np.int64), np.zeros((pairs + 1, FOUND), np.int32), np.zeros((pairs + 1, FOUND), np.int32),
        np.zeros(1, np.int64), np.zeros(1),
        np.zeros((touching, COLUMNS)), np.zeros(touching, np.int32), np.zeros((2, walls), np.int64),
        None if listed is None else np.zeros((touching, 3), np.int32), listed,
    )  # fmt: skip

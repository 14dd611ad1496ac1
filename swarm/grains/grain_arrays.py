"""The arrays of soft balls: rows of each ball, and a row of each contact of a step, in the order of the balls' cells.

A row is one line of the cache. Balls that are neighbours in space are neighbours in memory, so that most contacts
find their balls in the cache.
"""

from typing import Any, NamedTuple

import numpy as np

from ..kernel.arrays import aligned, aligned_copy, index, spaced
from ..kernel.jit import Array
from ..kernel.lines import LANES
from ..kernel.record import Record
from ..kernel.vector import column, put, set_vector, vector_at

# Columns of `Grains.place`: the centre, the round-off lost from it, the radius, 1/mass.
X, LOST, RADIUS, LIGHTNESS = 0, 3, 6, 7
# Columns of `Grains.speed`: the velocity at the start of a step, and at its end. `Grains.spin` also has the radius
# again, and the lever m R/I that turns the ball: friction then reads only two lines of a ball.
BEFORE, AFTER, ARM, LEVER = 0, 3, 6, 7
# Columns of `Grains.change`: the change of the velocity in the last step, with which the next step begins to solve,
# and its change by the impulses of pairs in this step.
LAST, GIVEN = 0, 4
# A row of each of these arrays fills a line of the cache.
COLUMNS_OF_BALLS = 8
# Columns of a contact: s0, from one centre to the other at the start of a step, at a wall the centre; |s0|, at a wall
# its inner function; the gap; the size of the impulse, and the impulse; h/2 times the velocity at the start; the
# damping; the gain of a Newton step; the factor that makes changes relative; 1/m of both balls of a pair. A sweep
# without friction reads no other columns.
START, SIZE, GAP, PUSH, IMPULSE, COAST, DAMPING, GAIN, SCALE, EASES = 0, 3, 4, 5, 6, 9, 12, 13, 14, 15
COLUMNS_SWEPT = 17
# The inverse of the mass that moves, the impulse of friction, and for a pair 1/(R_i + R_j) and the levers of both.
EASE, DRAG, NEARNESS, LEVERS, COLUMNS_RUBBED = 17, 18, 21, 22, 24
# The place in the lists, for a wall; the angular impulse of the resistance to rolling; the energy that friction and
# this resistance take.
LISTED, ROLL, RUBBED, COLUMNS = 24, 25, 28, 29
# Columns of `Touches.found`, and rows of a group in `Tile.ends`: both balls, and the place in the lists.
ONE, OTHER, PLACE, FOUND, ENDS = 0, 1, 2, 3, 3
# Columns of `Touches.course`: the centre at the start of a step, the radius, the move in the step, and 1/mass. The test
# of every listed pair then reads one line of a ball.
FROM, EXTENT, MOVE, YIELDING = 0, 3, 4, 7
# Columns of `Neighbours.drag` after the impulse of friction: the angular impulse of the resistance to rolling. In a run
# with a log of contacts also: the time at which the contact began, the sum of its normal impulses, the largest force,
# the energy that friction has taken, and the velocity (of the smaller number in a pair) and the slip at the start.
KEPT_ROLL = 3
BEGAN, PRESSED, FORCE, TAKEN_OFF, ARRIVED, SLIP, KEPT = 6, 7, 8, 9, 10, 13, 16
# Columns of `Neighbours.spans`: where the members of a field begin in `listed`, where they end, and their face.
BEGIN, END, FACE = 0, 1, 2
# Entries of a clock: the steps done of the frame, the steps since pairs were listed, the steps since the run was last
# halted, and the skin of the lists [m].
DONE, SINCE, TAKEN, SKIN, CLOCK = 0, 1, 2, 3, 4


# 1/(2/5), of the moment of inertia of a ball.
ROUNDNESS = 2.5


class Grains(NamedTuple):
    """The rows of the balls, in the order of cells."""

    number: Array  # (N,) the number of the particle
    place: Array  # (N, 8)
    speed: Array  # (N, 8)
    listed: Array  # (N, 4) the centre when pairs were listed
    change: Array  # (N, 8) changes of the velocity
    spin: Any  # (N, 8) angular velocities, with the columns of `speed`; None where there is no friction


class Neighbours(NamedTuple):
    """The lists of neighbours: for each ball the balls after it, for each wall the balls near it."""

    first: Array  # (N + 1,) where the pairs of each ball begin
    mate: Array  # (room,) int32, the other ball of each pair
    is_on: Array  # (room,) bool, whether the pair is among the contacts of this step
    wall_first: Array  # (walls + 1,)
    slot: Array  # (room of walls,) int32
    wall_is_on: Array
    drag: (
        Any  # (room, 3) the impulse of friction of each pair in the last step, or None; (room, 6) with that of rolling
    )
    wall_drag: Any
    # In a scene with fields, else None
    spans: Any = None  # (room of walls, 3) int32, which entries of `listed` are near the ball
    listed: Any = None  # (room of members,) int32, the numbers of members
    used: Any = None  # (1,) the number of members near balls, also beyond the room
    # In a scene with openings, else None
    wall_is_open: Any = None  # (room of walls,) bool, whether the wall is open to the ball


class Tile(NamedTuple):
    """The contacts of pairs in groups; each group has a row for each column of a contact."""

    rows: Array  # (groups * COLUMNS, LANES)
    ends: Array  # (groups * ENDS, LANES) int32


with_lanes = spaced(LANES)


class Touches(NamedTuple):
    """The contacts of a step, of pairs and at walls."""

    tile: Tile  # the contacts of pairs
    lanes: Array  # (groups,) int64, how many contacts each group has
    splits: Array  # (groups,) int64, the lanes, as bits, where a part begins: no ball is twice in a part of a group
    marks: Array  # (N,) int64, the last part that each ball is in
    course: Array  # (N, 8)
    stirred: Array  # (N,) int32, the last sweep for friction in which a contact of each ball was not solved
    used: Array  # (2,) the numbers of contacts of pairs, and of groups
    found: Array  # (room + 1, FOUND) int32, the contacts of pairs as they were found
    missed: Array  # (room + 1, FOUND) int32, the pairs that have missed one another by no more than the margin
    passed: Array  # (1,) the number of these pairs
    margin: Array  # (1,) [m]
    wall_rows: Array  # (room of walls, COLUMNS)
    wall_ends: Array  # (room of walls,) int32, the ball
    wall_spans: Array  # (2, walls) where the contacts of each wall begin in `wall_rows`, and their number
    spans: Any = None  # (room of walls, 3) int32, in a scene with fields: as in `Neighbours`
    listed: Any = None  # the array of `Neighbours`


class OfWall(Record):
    """A contact with a wall."""

    rows: Any
    c: Any

    def listed(self):
        """The place in the lists."""
        return index(int(self.rows[self.c, LISTED]))

    def number(self, k):
        """The number in a column."""
        return self.rows[self.c, k]

    def vector(self, k):
        """The vector in three columns."""
        return vector_at(self.rows, self.c, k)

    def set_vector(self, k, a):
        """Store a vector into three columns."""
        set_vector(self.rows, self.c, k, a)


class OfPair(Record):
    """A contact of a pair: the first rows of its group, that of its numbers and that of its balls, and its lane."""

    rows: Any
    q: Any
    ends: Any
    e: Any
    lane: Any

    def listed(self):
        """The place in the lists."""
        return index(self.ends[self.e + PLACE, self.lane])

    def number(self, k):
        """The number in a column."""
        return self.rows[self.q + k, self.lane]

    def vector(self, k):
        """The vector in three columns."""
        return column(self.rows, self.q + k, self.lane)

    def set_vector(self, k, a):
        """Store a vector into three columns."""
        put(self.rows, self.q + k, self.lane, a)


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
    """Return rows for n balls, each a line of the cache."""
    return aligned(COLUMNS_OF_BALLS * n).reshape(n, COLUMNS_OF_BALLS)


def beside(grains: Grains, more: Grains) -> Grains:
    """Return the rows of balls followed by the rows of more balls."""
    pairs = zip(grains, more, strict=True)
    rows: Any = (None if old is None else aligned_copy(np.concatenate([old, new])) for old, new in pairs)
    return Grains(*rows)


def near_of(
    n: int, walls: int, pairs: int, touching: int, kept: int = 0, members: int | None = None, opens: bool = False,
) -> Neighbours:  # fmt: skip
    """Return empty lists for n balls, with room for `pairs`, for `touching` balls at walls and `members` of fields.

    `kept` numbers of each contact are kept from step to step.
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
    """Return room for the contacts of `pairs` and of `touching` balls at walls; `listed` is that of `Neighbours`."""
    # One more group for contacts that are found after a step has been solved, and one to fetch behind the last.
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

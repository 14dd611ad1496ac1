"""Tables of lanes: a row holds one number of every lane, and the view of a lane reads and writes its rows by name."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import index, spaced
from ..kernel.jit import Array
from ..kernel.record import Record
from ..kernel.vector import column, put

# Lanes of a block: 256 x 16 rows of 8 bytes fit in the L1 cache.
LANES = 256
# The row stride is not a power of two, so that the rows of a lane do not share a cache set.
STRIDE = 264
# Bytes of a cache line, and of a number of eight flags.
_LINE, EIGHT = 64, 8
# The passes between two looks at all lanes. A particle that has advanced since the last look by less than the fraction
# MOVED of the time left would need 1e9 passes, and is given up if it made no progress.
LOOK, MOVED = 1024, 1e-6

with_distances = spaced(STRIDE)


class Number:
    """A row, as an attribute of the view (rows, i) of a lane; as an attribute of the class it is the row itself."""

    def __init__(self, row: int) -> None:
        self.row = row

    def __get__(self, lane: Any, owner: Any) -> Any:
        return self if lane is None else lane.rows[self.row, lane.i]

    def __set__(self, lane: Any, value: Any) -> None:
        lane.rows[self.row, lane.i] = value


class Vector(Number):
    """Three rows, as a vector."""

    def __get__(self, lane: Any, owner: Any) -> Any:
        return self if lane is None else column(lane.rows, self.row, lane.i)

    def __set__(self, lane: Any, value: Any) -> None:
        put(lane.rows, self.row, lane.i, value)


class Rows:
    """Name the rows of a table one after another; `count` of them have a name so far."""

    def __init__(self) -> None:
        self.count = 0

    def take(self, count: int) -> int:
        """Take `count` rows; return the first of them."""
        self.count += count
        return self.count - count

    def number(self) -> Any:
        """Take the next row."""
        return Number(self.take(1))

    def vector(self) -> Any:
        """Take the next three rows."""
        return Vector(self.take(3))


class LaneView(Record):
    """The view of a lane; a table names its rows in a class of its own."""

    rows: Array
    i: int


class Advanced(LaneView):
    """The lane of a particle on its way, with its state at the last look in rows."""

    def stands(self, method, p):
        """Whether particle p of this lane has advanced less than it must since the last look."""
        least = min(method.instant(self.v), MOVED * self.remaining)
        return self.looked_particle == p and least >= self.looked_left - self.remaining

    def look(self, p):
        """Keep the state for the next look."""
        self.looked_particle, self.looked_left = p, self.remaining


def table(rows: int) -> NDArray[np.float64]:
    """Return rows of numbers that begin with a cache line, so that no vector reaches into two lines."""
    size = 8 * rows * STRIDE
    memory = np.zeros(size + _LINE, np.uint8)
    first = -memory.__array_interface__["data"][0] % _LINE
    return memory[first : first + size].view(np.float64).reshape(rows, STRIDE)


def copy_lane(source, i, target, k, count):
    """Copy the first `count` rows of lane i of a table to lane k of another."""
    for row in range(count):
        target[row, k] = source[row, i]


def whole_eights(n):
    """Return the least number of lanes, in whole vectors, that n lanes fit in."""
    return index((index(n) + index(EIGHT - 1)) // EIGHT * EIGHT)


def marked_lanes(lanes, live):
    """Count the marked lanes, and write their numbers to `order`.

    Without a branch: no processor foresees which lanes arrive, and each wrong guess costs about 6 ns. All lanes one by
    one were an eighth of the time of a frame with 75 impacts.
    """
    marked, order, some, count = lanes.marked, lanes.order, lanes.some, index(0)
    eights = 0
    for k in range((live + EIGHT - 1) // EIGHT):
        some[eights] = k
        eights += lanes.eights[k] != 0
    for k in range(eights):
        first = EIGHT * some[k]
        for lane in range(first, min(first + EIGHT, live)):
            order[count] = lane
            count += index(marked[lane])
    return int(count)

"""Counters in lanes: the state of a lane before its flight, and the crossings of all lanes, without branches."""

from typing import Any

from ...kernel.arrays import index
from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import select
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, either, square
from ...state import CROSSED
from ...surfaces.counted import slowness
from ..table import LaneView, Rows, marked_lanes

# Lanes are counted one by one if fewer than one in this number crosses a counter.
_FEW = 8

_named = Rows()


class Began(LaneView):
    """A lane before its flight, and its mass."""

    r, v, remaining, mass = _named.vector(), _named.vector(), _named.number(), _named.number()


BEGAN = _named.count
# Then follow the rows of each counter: the side of the lane, 1 or -1, and its crossings in both senses.
_SENSE = 1 + CROSSED
ROWS_OF_COUNTER = 1 + 2 * _SENSE


def velocity_before(gravity, lane, began):
    """The velocity of a lane before its flight."""
    return lane.v if gravity is None else began.v


def row_of_counter(c):
    """The first row of a counter: the side."""
    return BEGAN + ROWS_OF_COUNTER * c


def row_of_sense(c, s):
    """The first row of the crossings of a counter in a sense: their number, then the sums."""
    return row_of_counter(c) + 1 + _SENSE * s


def count_in_lanes(one, c, gravity, lanes, live):
    """Count the crossings of a counter by the flights of all lanes, with the result of a count of each by itself."""
    rounds = (True, False)[2 - one.most(gravity) :]
    if len(rounds) == 1 or gravity is not None:
        for i in range(index(live)):
            _count_in_lane(one, c, gravity, lanes, i, rounds)
        return
    # Two rounds take three times as long as a test for a crossing. If few lanes cross, they are counted one by one.
    for i in range(index(live)):
        lane, began = lanes.lane(i), Began(lanes.began, i)
        time = one.crossing(lanes.began[row_of_counter(c), i], gravity, began.r, lane.v).time
        lanes.marked[i] = time < began.remaining - lane.remaining
    some = marked_lanes(lanes, live)
    if _FEW * some < live:
        for k in range(some):
            _count_in_lane(one, c, gravity, lanes, index(lanes.order[k]), rounds)
    else:
        for i in range(index(live)):
            _count_in_lane(one, c, gravity, lanes, i, rounds)


def _count_in_lane(one, c, gravity, lanes, i, rounds):
    rows, lane, began = lanes.began, lanes.lane(i), Began(lanes.began, i)
    v, m = velocity_before(gravity, lane, began), began.mass
    r, left, sign = began.r, began.remaining - lane.remaining, rows[row_of_counter(c), i]
    ends_near = one.is_near(lane.r)
    out = back = _NOT_CROSSED
    for goes_on in rounds:
        time = one.crossing(sign, gravity, r, v).time
        there, after, w = r + displacement(gravity, v, time), left - time, accelerated(gravity, v, time)
        stays_near = one.is_near(there + displacement(gravity, w, 0.5 * after)) if len(rounds) > 1 else True
        crosses = (time < left) & (not (ends_near & stays_near))
        counts, across = (
            crosses if one.volumes is None else crosses & one.has(there),
            one.speed(sign, 0.0, there, w),
        )
        # Of two crossings one is out, and the other back.
        out = _first_of(counts & (sign > 0.0), w, across, out)
        back = _first_of(counts & (sign < 0.0), w, across, back)
        if goes_on:
            r, v, left = either(crosses, there, r), either(crosses, w, v), select(crosses, after, left)
        sign = select(crosses, -sign, sign)
    for s, crossed in enumerate((out, back)):
        w = crossed.v if gravity is not None else v
        parts = 1.0, m * w.x, m * w.y, m * w.z, 0.5 * m * square(w), slowness(crossed.across, w)
        for k, part in enumerate(parts):
            rows[row_of_sense(c, s) + k, i] += select(crossed.counts, part, 0.0)
    rows[row_of_counter(c), i] = sign


class Passed(Record):
    """The crossing of a lane in one sense: whether it counts, its velocity, and the speed across."""

    counts: Any
    v: Vec
    across: Any


_NOT_CROSSED = Passed(False, ZERO, 1.0)


def _first_of(counts, v, across, before):
    return Passed(counts | before.counts, either(counts, v, before.v), select(counts, across, before.across))

"""Counters: flights in lanes, and steps of what slides, are looked at after they are done; they change no bit of these.

Each particle has its side of each counter. A flight is looked at from that side, crosses where it leaves it, and is
looked at from the other side from there on: so crossings out less those back are the change of the number outside,
exactly. What ends a flight on a counter, within round-off, crosses it in the next one, or not at all if it is turned
round there: a counter at the place of a wall counts nobody, and one at a face of a cell that repeats everyone once.
"""

import math
from typing import Any

import numpy as np

from ..kernel.arrays import index
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, absolute, either, norm, square, total
from ..particles import CROSSED
from ..surfaces.axes import length_of, pulls, time_out
from ..surfaces.counted import Turned, slowness
from ..surfaces.period import has_left, into
from .table import Lane, Rows, copy_lane, marked_lanes

# The most crossings of one counter, and ends of what is surely free, in one flight through one cell; a guard alone.
_MOST = 100_000
# A place ahead, in distances that are round-off, that tells on which side of a counter a particle on it goes.
_AHEAD = 1e3

_named = Rows()


class Began(Lane):
    """A lane before its flight, and its mass."""

    r, v, remaining, mass = _named.vector(), _named.vector(), _named.number(), _named.number()


BEGAN = _named.count
# Behind these rows are those of each counter: the side of the lane, 1 or -1, and what it has crossed in both senses.
_SENSE = 1 + CROSSED
_ROWS = 1 + 2 * _SENSE


class Flown(Record):
    """A flight within one cell: its start, how long it is, what is left of the frame at its start, and its end."""

    r: Vec
    v: Vec
    time: Any
    remaining: Any
    end: Vec
    images: Vec  # of the cell, from that where the particle is booked


class Moment(Record):
    """A particle at a moment, with so much of the frame left."""

    r: Vec
    v: Vec
    remaining: Any


class Counters(Record):
    """The counters of a run."""

    each: Any  # `Counted` of each
    gravity: Any  # None where flights are straight
    quiet: Any  # whether they stay within one cell, and no crossing is logged; else None

    def rows(self):
        """The number of rows of a lane."""
        return BEGAN + _ROWS * len(self.each)

    def is_in_lanes(self, one):
        """Whether crossings of a counter are counted in lanes, without branches: a constant for the compiler."""
        return self.quiet is not None and isinstance(one, Turned) and one.most(self.gravity) is not None

    # --- Flights in lanes ---

    def load(self, state, lanes, i, k):
        """What is known of particle i into lane k."""
        Began(lanes.began, k).mass = state.mass[i]
        for c, one in enumerate(self.each):
            lanes.began[_row(c), k] = _sign(state, c, i)
            for s in range(2 if self.is_in_lanes(one) else 0):
                first = _row_of_sense(c, s)
                lanes.began[first, k] = float(state.crossed.number[2 * c + s, i])
                for j in range(CROSSED):
                    lanes.began[first + 1 + j, k] = state.crossed.sums[CROSSED * (2 * c + s) + j, i]

    def retire(self, state, lanes, i, k):
        """What lane k has crossed back into particle i."""
        for c, one in enumerate(self.each):
            if self.is_in_lanes(one):
                state.crossed.side[c, i] = 0 if lanes.began[_row(c), k] > 0.0 else 1
                for s in range(2):
                    first = _row_of_sense(c, s)
                    state.crossed.number[2 * c + s, i] = np.int64(lanes.began[first, k])
                    for j in range(CROSSED):
                        state.crossed.sums[CROSSED * (2 * c + s) + j, i] = lanes.began[first + 1 + j, k]

    def move(self, lanes, source, target):
        """A lane into another."""
        copy_lane(lanes.began, source, lanes.began, target, self.rows())

    def keep_before(self, gravity, lanes, live):
        """Keep every lane as it is before its flight."""
        for i in range(index(live)):
            lane, began = lanes.lane(i), Began(lanes.began, i)
            began.r, began.remaining = lane.r, lane.remaining
            if gravity is not None:
                began.v = lane.v

    def count_flights(self, gravity, share, lanes, live):
        """Count what the flights of all lanes have crossed."""
        marks = False
        for c, one in enumerate(self.each):
            if self.is_in_lanes(one):
                _count_in_lanes(one, c, gravity, lanes, live)
            else:
                marks = True
        if marks:
            self._look_at_lanes(gravity, share, lanes, live)

    def _look_at_lanes(self, gravity, share, lanes, live):
        """The lanes that may cross a counter, one by one."""
        # A fall may leave a cell and come back into it.
        all_of_them = lanes.period is not None and gravity is not None
        for i in range(index(live)):
            lane, began = lanes.lane(i), Began(lanes.began, i)
            time = began.remaining - lane.remaining
            found = (time > 0.0) if all_of_them else has_left(lanes.period, lane.r)
            for c, one in enumerate(self.each):
                if not self.is_in_lanes(one):
                    found = (
                        one.may_cross(lanes.began[_row(c), i], gravity, began.r, _before(gravity, lane, began), time)
                        | found
                    )
            lanes.marked[i] = found
        for k in range(marked_lanes(lanes, live)):
            self._look_at_lane(gravity, share, lanes, index(lanes.order[k]))

    @outlined
    def _look_at_lane(self, gravity, share, lanes, i):
        lane, began, p = lanes.lane(i), Began(lanes.began, i), index(lanes.particle[i])
        flown = Flown(
            began.r, _before(gravity, lane, began), began.remaining - lane.remaining, began.remaining, lane.r, ZERO
        )
        if lanes.period is None:
            self._look_at(gravity, share, p, flown)
        else:
            self._look_at_cells(lanes.period, gravity, share, p, flown)
        for c, one in enumerate(self.each):
            if not self.is_in_lanes(one):
                lanes.began[_row(c), i] = _sign(share.state, c, p)

    def _look_at(self, gravity, share, p, flown):
        for c, one in enumerate(self.each):
            if not self.is_in_lanes(one):
                _look_at_one(one, c, gravity, share, p, flown)

    def _look_at_cells(self, period, gravity, share, p, flown):
        """The same of a flight over faces, cell by cell: walls and counters are known in one."""
        back, (gx, gy, gz) = into(period, flown.end), pulls(gravity)
        r, v, left, remaining, images = flown.r, flown.v, flown.time, flown.remaining, ZERO
        while True:
            x = _time_of_face(gx, period.x, r.x, v.x)
            y = _time_of_face(gy, period.y, r.y, v.y)
            z = _time_of_face(gz, period.z, r.z, v.z)
            time = min(x, y, z)
            ends = not time < left
            if ends:
                time = left
            after = accelerated(gravity, v, time)
            end = r + displacement(gravity, v, time)
            if ends and _is_same(images, back.images):
                end = back.r
            self._look_at(gravity, share, p, Flown(r, v, time, remaining, end, images))
            step = ZERO
            if not ends:
                step = Vec(
                    _step_over(x <= time, after.x), _step_over(y <= time, after.y), _step_over(z <= time, after.z)
                )
            elif not _is_same(images, back.images):
                # By round-off the flight has ended before a face, or after it.
                step = back.images - images
            else:
                return
            self._settle_all(gravity, share, p, Moment(end, after, remaining - time), images)
            images = images + step
            r = Vec(
                _beyond_face(period.x, end.x, step.x),
                _beyond_face(period.y, end.y, step.y),
                _beyond_face(period.z, end.z, step.z),
            )
            v, left, remaining = after, left - time, remaining - time
            for c, one in enumerate(self.each):
                _come_into_cell(one, c, share.state, p, r, v)
            if ends:
                return

    # --- Steps, and ends ---

    @outlined
    def count_step(self, share, p, before, after):
        """Count what a step of particle p has crossed, from one `Moment` to another, by its ends."""
        state = share.state
        for c, one in enumerate(self.each):
            d0, d1, sign = one.distance(before.r), one.distance(after.r), _sign(state, c, p)
            if sign * d1 > one.near:
                part = d0 / (d0 - d1) if (d0 - d1) * d0 > 0.0 else 0.0
                part = min(part, 1.0)
                there = Moment(
                    before.r + part * (after.r - before.r),
                    before.v + part * (after.v - before.v),
                    before.remaining + part * (after.remaining - before.remaining),
                )
                time = before.remaining - after.remaining
                across = abs(d1 - d0) / time if time > 0.0 else 0.0
                _cross(one, c, share, p, there, across, ZERO)

    @outlined
    def come_back(self, share, p, before, end, after):
        """The sides of particle p, whose step has left the cell at `end`, and which is back in it `after`."""
        state = share.state
        start = before._replace(r=before.r + (after.r - end))
        for c, one in enumerate(self.each):
            d = one.distance(start.r)
            if abs(d) > one.near:
                state.crossed.side[c, p] = 0 if d < 0.0 else 1
        self.count_step(share, p, start, after)

    @outlined
    def settle(self, share, p, there):
        """Count particle p, a `Moment`, that has come to a counter and goes on where nothing more is known of it."""
        self._settle_all(None, share, p, there, ZERO)

    def _settle_all(self, gravity, share, p, there, images):
        for c, one in enumerate(self.each):
            sign = _sign(share.state, c, p)
            d, ahead = _ahead(one, there.r, there.v)
            if abs(d) <= one.near and sign * (ahead - d) > 0.0:
                speed = norm(there.v)
                across = abs(ahead - d) * speed / (_AHEAD * one.near) if speed > 0.0 else 0.0
                _cross(one, c, share, p, there, across, images)


def _before(gravity, lane, began):
    """The velocity of a lane before its flight."""
    return lane.v if gravity is None else began.v


def _row(c):
    """The first row of a counter: the side."""
    return BEGAN + _ROWS * c


def _row_of_sense(c, s):
    """The first row of what has crossed it in a sense: how many, then the sums."""
    return _row(c) + 1 + _SENSE * s


def _count_in_lanes(one, c, gravity, lanes, live):
    """Count the crossings of a counter by the flights of all lanes: the same as of each by itself."""
    rows, rounds = lanes.began, (True, False)[2 - one.most(gravity) :]
    for i in range(index(live)):
        lane, began = lanes.lane(i), Began(lanes.began, i)
        v, m = _before(gravity, lane, began), began.mass
        r, left, sign = began.r, began.remaining - lane.remaining, rows[_row(c), i]
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
            # One of two crossings is out, and the other back.
            out = _first_of(counts & (sign > 0.0), w, across, out)
            back = _first_of(counts & (sign < 0.0), w, across, back)
            if goes_on:
                r, v, left = either(crosses, there, r), either(crosses, w, v), select(crosses, after, left)
            sign = select(crosses, -sign, sign)
        for s, crossed in enumerate((out, back)):
            w = crossed.v if gravity is not None else v
            parts = 1.0, m * w.x, m * w.y, m * w.z, 0.5 * m * square(w), slowness(crossed.across, w)
            for k, part in enumerate(parts):
                rows[_row_of_sense(c, s) + k, i] += select(crossed.counts, part, 0.0)
        rows[_row(c), i] = sign


class Passed(Record):
    """The crossing of a lane in one sense: whether it counts, its velocity, and the speed across."""

    counts: Any
    v: Vec
    across: Any


_NOT_CROSSED = Passed(False, ZERO, 1.0)


def _first_of(counts, v, across, before):
    return Passed(counts | before.counts, either(counts, v, before.v), select(counts, across, before.across))


@outlined
def _look_at_one(one, c, gravity, share, p, flown):
    """Count the crossings of a counter by a flight within one cell."""
    r, v, left, remaining = flown.r, flown.v, flown.time, flown.remaining
    ends_near = one.is_near(flown.end)
    for _k in range(_MOST):
        sign = _sign(share.state, c, p)
        found = one.crossing(sign, gravity, r, v)
        if not found.time < left:
            return
        left, remaining = left - found.time, remaining - found.time
        r, v = r + displacement(gravity, v, found.time), accelerated(gravity, v, found.time)
        if found.wall < 0.0:
            continue
        if ends_near and one.is_near(r + displacement(gravity, v, 0.5 * left)):
            return
        _cross(one, c, share, p, Moment(r, v, remaining), one.speed(sign, found.wall, r, v), flown.images)
        if not one.may_cross_again(-sign, gravity, r, v, left):
            return


@outlined
def _cross(one, c, share, p, there, across, images):
    """Particle p, a `Moment`, crosses counter c with a speed across it."""
    crossed, m = share.state.crossed, share.state.mass[p]
    sense = int(crossed.side[c, p])
    crossed.side[c, p] = 1 - sense
    if not one.has(there.r):
        return
    v = there.v
    row = index(2 * c + sense)
    first = index(CROSSED * (2 * c + sense))
    crossed.number[row, p] += 1
    crossed.sums[first, p] += m * v.x
    crossed.sums[first + 1, p] += m * v.y
    crossed.sums[first + 2, p] += m * v.z
    crossed.sums[first + 3, p] += 0.5 * m * square(v)
    crossed.sums[first + 4, p] += slowness(across, v)
    if share.log is not None:
        share.log.add_crossing(share.state, p, there, 2 * c + sense, images)


def _sign(state, c, p):
    """1.0 of a particle that is on the admissible side of a counter, -1.0 of one on the other."""
    return 1.0 - 2.0 * state.crossed.side[c, p]


def _ahead(one, r, v):
    """The distances out of a counter here and a little ahead."""
    speed = norm(v)
    step = _AHEAD * one.near / speed if speed > 0.0 else 0.0
    return one.distance(r), one.distance(r + step * v)


def _come_into_cell(one, c, state, p, r, v):
    """The side of a particle that comes into a cell: at a counter at its face that from which it comes."""
    d, ahead = _ahead(one, r, v)
    if abs(d) > one.near:
        state.crossed.side[c, p] = 0 if d < 0.0 else 1
    else:
        state.crossed.side[c, p] = 0 if ahead > d else 1


# --- Faces -----------------------------------------------------------------------------------------------


def _time_of_face(pull, length, x, v):
    """When a coordinate leaves [0, length]."""
    return math.inf if length is None else max(time_out(pull, (0.0, length_of(length)), x, v), 0.0)


def _step_over(leaves, v):
    return select(leaves, select(v > 0.0, 1.0, -1.0), 0.0)


def _beyond_face(length, x, step):
    """A coordinate in the next cell, at its face."""
    if step == 0.0:
        return x
    return 0.0 if step > 0.0 else length_of(length)


def _is_same(one, other):
    return total(absolute(one - other)) == 0.0

"""Counters look at flights in lanes, and at steps of sliding particles, after they are done, and change no bit of them.

Each particle has a side of each counter. A flight is followed from this side, crosses where it leaves the side, and
is then followed from the other side: so crossings out minus crossings back are the change of the number outside,
exactly. A particle that ends a flight on a counter, within round-off, crosses it in the next flight, or not at all if
it is turned round there. So a counter at the place of a wall counts no particle, and a counter at a face of a periodic
cell counts each particle once.
"""

from typing import Any

import numpy as np

from ...kernel.arrays import index
from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import outlined
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, norm
from ...state import CROSSED
from ...surfaces.counted import ReversedCounter
from ...surfaces.periodic.axes import pulls
from ...surfaces.periodic.period import has_left, into
from ..table import copy_lane, marked_lanes
from .counted_lanes import (
    BEGAN,
    ROWS_OF_COUNTER,
    Began,
    count_in_lanes,
    row_of_counter,
    row_of_sense,
    velocity_before,
)
from .crossings import (
    AHEAD,
    Flown,
    ParticleMoment,
    beyond_face,
    book_crossing,
    come_into_cell,
    distances_ahead,
    is_same,
    look_at_one,
    sign_of_side,
    step_over,
    time_of_face,
)


class Counters(Record):
    """The counters of a run."""

    each: Any  # `Counted` of each
    gravity: Any  # None where flights are straight
    quiet: Any  # whether particles stay within one cell, and no crossing is logged; else None

    def rows(self):
        """The number of rows of a lane."""
        return BEGAN + ROWS_OF_COUNTER * len(self.each)

    def is_in_lanes(self, one):
        """Whether crossings of a counter are counted in lanes, without branches: a constant for the compiler."""
        return self.quiet is not None and isinstance(one, ReversedCounter) and one.most(self.gravity) is not None

    # --- Flights in lanes ---

    def load(self, state, lanes, i, k):
        """Load the state of particle i into lane k."""
        Began(lanes.began, k).mass = state.mass[i]
        for c, one in enumerate(self.each):
            lanes.began[row_of_counter(c), k] = sign_of_side(state, c, i)
            for s in range(2 if self.is_in_lanes(one) else 0):
                first = row_of_sense(c, s)
                lanes.began[first, k] = float(state.crossed.number[2 * c + s, i])
                for j in range(CROSSED):
                    lanes.began[first + 1 + j, k] = state.crossed.sums[CROSSED * (2 * c + s) + j, i]

    def retire(self, state, lanes, i, k):
        """Write the crossings of lane k back to particle i."""
        for c, one in enumerate(self.each):
            if self.is_in_lanes(one):
                state.crossed.side[c, i] = 0 if lanes.began[row_of_counter(c), k] > 0.0 else 1
                for s in range(2):
                    first = row_of_sense(c, s)
                    state.crossed.number[2 * c + s, i] = np.int64(lanes.began[first, k])
                    for j in range(CROSSED):
                        state.crossed.sums[CROSSED * (2 * c + s) + j, i] = lanes.began[first + 1 + j, k]

    def move(self, lanes, source, target):
        """Move a lane to another."""
        copy_lane(lanes.began, source, lanes.began, target, self.rows())

    def keep_before(self, method, gravity, lanes, live):
        """Keep the state of every lane before its flight, or its contact."""
        for i in range(index(live)):
            lane, began = lanes.lane(i), Began(lanes.began, i)
            began.r, began.remaining = lane.r, method.seconds(lane.remaining)
            if gravity is not None or method.contacts_take_time:
                began.v = lane.v

    def count_flights(self, method, gravity, share, lanes, live):
        """Count the crossings in the flights of all lanes."""
        marks = False
        for c, one in enumerate(self.each):
            if self.is_in_lanes(one):
                count_in_lanes(one, c, gravity, lanes, live)
            else:
                marks = True
        if marks:
            self._look_at_lanes(method, gravity, share, lanes, live)

    def _look_at_lanes(self, method, gravity, share, lanes, live):
        """Look at the lanes that may cross a counter, one by one."""
        # A fall may leave a cell and come back into it.
        all_of_them = lanes.period is not None and gravity is not None
        for i in range(index(live)):
            lane, began = lanes.lane(i), Began(lanes.began, i)
            v = velocity_before(gravity, lane, began)
            time = began.remaining - method.seconds(lane.remaining)
            found = (time > 0.0) if all_of_them else has_left(lanes.period, lane.r)
            for c, one in enumerate(self.each):
                if not self.is_in_lanes(one):
                    found = one.may_cross(lanes.began[row_of_counter(c), i], gravity, began.r, v, time) | found
            lanes.marked[i] = found
        for k in range(marked_lanes(lanes, live)):
            self._look_at_lane(method, gravity, share, lanes, index(lanes.order[k]))

    @outlined
    def _look_at_lane(self, method, gravity, share, lanes, i):
        lane, began, p = lanes.lane(i), Began(lanes.began, i), index(lanes.particle[i])
        v = velocity_before(gravity, lane, began)
        time = began.remaining - method.seconds(lane.remaining)
        flown = Flown(began.r, v, time, began.remaining, lane.r, ZERO)
        if lanes.period is None:
            self.look_at(gravity, share, p, flown)
        else:
            self.look_at_cells(lanes.period, gravity, share, p, flown)
        for c, one in enumerate(self.each):
            if not self.is_in_lanes(one):
                lanes.began[row_of_counter(c), i] = sign_of_side(share.state, c, p)

    def look_at(self, gravity, share, p, flown):
        """Count the crossings in a flight within one cell, of the counters that are not counted in lanes."""
        for c, one in enumerate(self.each):
            if not self.is_in_lanes(one):
                look_at_one(one, c, gravity, share, p, flown)

    def look_at_cells(self, period, gravity, share, p, flown):
        """Count the crossings in a flight over faces, cell by cell: walls and counters are known in one cell."""
        back, (gx, gy, gz) = into(period, flown.end), pulls(gravity)
        r, v, left, remaining, images = flown.r, flown.v, flown.time, flown.remaining, ZERO
        while True:
            x = time_of_face(gx, period.x, r.x, v.x)
            y = time_of_face(gy, period.y, r.y, v.y)
            z = time_of_face(gz, period.z, r.z, v.z)
            time = min(x, y, z)
            ends = not time < left
            if ends:
                time = left
            after = accelerated(gravity, v, time)
            end = r + displacement(gravity, v, time)
            if ends and is_same(images, back.images):
                end = back.r
            self.look_at(gravity, share, p, Flown(r, v, time, remaining, end, images))
            step = ZERO
            if not ends:
                step = Vec(step_over(x <= time, after.x), step_over(y <= time, after.y), step_over(z <= time, after.z))
            elif not is_same(images, back.images):
                # Round-off has ended the flight before a face, or after it.
                step = back.images - images
            else:
                return
            self._settle_all(share, p, ParticleMoment(end, after, remaining - time), images)
            images = images + step
            r = Vec(
                beyond_face(period.x, end.x, step.x),
                beyond_face(period.y, end.y, step.y),
                beyond_face(period.z, end.z, step.z),
            )
            v, left, remaining = after, left - time, remaining - time
            for c, one in enumerate(self.each):
                come_into_cell(one, c, share.state, p, r, v)
            if ends:
                return

    # --- Steps, and ends ---

    def count_contact(self, method, share, lanes, i):
        """Count the crossings of lane i in a contact that takes time, since `keep_before`."""
        lane, began, p = lanes.lane(i), Began(lanes.began, i), index(lanes.particle[i])
        found = False
        for c, one in enumerate(self.each):
            found = found | (lanes.began[row_of_counter(c), i] * one.distance(lane.r) > one.near)
        if found:
            before = ParticleMoment(began.r, began.v, began.remaining)
            self.count_step(share, p, before, ParticleMoment(lane.r, lane.v, method.seconds(lane.remaining)))
            for c in range(len(self.each)):
                lanes.began[row_of_counter(c), i] = sign_of_side(share.state, c, p)

    @outlined
    def count_step(self, share, p, before, after):
        """Count the crossings in a step of particle p between two `ParticleMoment`s, from its ends."""
        state = share.state
        for c, one in enumerate(self.each):
            d0, d1, sign = one.distance(before.r), one.distance(after.r), sign_of_side(state, c, p)
            if sign * d1 > one.near:
                part = d0 / (d0 - d1) if (d0 - d1) * d0 > 0.0 else 0.0
                part = min(part, 1.0)
                there = ParticleMoment(
                    before.r + part * (after.r - before.r),
                    before.v + part * (after.v - before.v),
                    before.remaining + part * (after.remaining - before.remaining),
                )
                time = before.remaining - after.remaining
                across = abs(d1 - d0) / time if time > 0.0 else 0.0
                book_crossing(one, c, share, p, there, across, ZERO)

    def come_back_lane(self, method, share, lanes, i, end):
        """Call `come_back` for lane i, of which a contact since `keep_before` has left the cell at `end`."""
        lane, began, p = lanes.lane(i), Began(lanes.began, i), index(lanes.particle[i])
        before = ParticleMoment(began.r, began.v, began.remaining)
        self.come_back(share, p, before, end, ParticleMoment(lane.r, lane.v, method.seconds(lane.remaining)))
        for c in range(len(self.each)):
            lanes.began[row_of_counter(c), i] = sign_of_side(share.state, c, p)

    @outlined
    def come_back(self, share, p, before, end, after):
        """Set the sides of particle p when its step has left the cell at `end` and it is back in the cell `after`."""
        state = share.state
        start = before._replace(r=before.r + (after.r - end))
        for c, one in enumerate(self.each):
            d = one.distance(start.r)
            if abs(d) > one.near:
                state.crossed.side[c, p] = 0 if d < 0.0 else 1
        self.count_step(share, p, start, after)

    @outlined
    def settle(self, share, p, there):
        """Count a crossing of particle p, a `ParticleMoment` at a counter, if it goes on without another look."""
        self._settle_all(share, p, there, ZERO)

    def _settle_all(self, share, p, there, images):
        for c, one in enumerate(self.each):
            sign = sign_of_side(share.state, c, p)
            d, ahead = distances_ahead(one, there.r, there.v)
            if abs(d) <= one.near and sign * (ahead - d) > 0.0:
                speed = norm(there.v)
                across = abs(ahead - d) * speed / (AHEAD * one.near) if speed > 0.0 else 0.0
                book_crossing(one, c, share, p, there, across, images)

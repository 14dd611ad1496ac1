"""The crossings of one particle and one counter, in a flight and at a face of a periodic cell."""

import math
from typing import Any

from ...contact.touching import ParticleMoment as ParticleMoment
from ...kernel.arrays import index
from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import outlined, select
from ...kernel.record import Record
from ...kernel.vector import Vec, absolute, norm, square, total
from ...state import CROSSED
from ...surfaces.counted import slowness
from ...surfaces.periodic.axes import length_of, time_out

# The most crossings of one counter, and ends of free parts, in one flight through one cell: only a guard.
_MOST = 100_000
# The distance to a place ahead, in multiples of round-off, that decides on which side a particle on a counter goes.
AHEAD = 1e3


class Flown(Record):
    """A flight within one cell: its start, its duration, the time left of the frame at its start, and its end."""

    r: Vec
    v: Vec
    time: Any
    remaining: Any
    end: Vec
    images: Vec  # the cell, relative to that where the particle is booked


@outlined
def look_at_one(one, c, gravity, share, p, flown):
    """Count the crossings of a counter by a flight within one cell."""
    r, v, left, remaining = flown.r, flown.v, flown.time, flown.remaining
    ends_near = one.is_near(flown.end)
    for _k in range(_MOST):
        sign = sign_of_side(share.state, c, p)
        found = one.crossing(sign, gravity, r, v)
        if not found.time < left:
            return
        left, remaining = left - found.time, remaining - found.time
        r, v = r + displacement(gravity, v, found.time), accelerated(gravity, v, found.time)
        if found.wall < 0.0:
            continue
        if ends_near and one.is_near(r + displacement(gravity, v, 0.5 * left)):
            return
        book_crossing(
            one, c, share, p, ParticleMoment(r, v, remaining), one.speed(sign, found.wall, r, v), flown.images
        )
        if not one.may_cross_again(-sign, gravity, r, v, left):
            return


@outlined
def book_crossing(one, c, share, p, there, across, images):
    """Book that particle p, a `ParticleMoment`, crosses counter c with a speed across it."""
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


def sign_of_side(state, c, p):
    """1.0 for a particle on the admissible side of a counter, -1.0 for one on the other side."""
    return 1.0 - 2.0 * state.crossed.side[c, p]


def distances_ahead(one, r, v):
    """Return the distances to a counter, positive outside, here and a little ahead."""
    speed = norm(v)
    step = AHEAD * one.near / speed if speed > 0.0 else 0.0
    return one.distance(r), one.distance(r + step * v)


def come_into_cell(one, c, state, p, r, v):
    """Set the side of a particle that enters a cell; at a counter on the face, the side from which it comes."""
    d, ahead = distances_ahead(one, r, v)
    if abs(d) > one.near:
        state.crossed.side[c, p] = 0 if d < 0.0 else 1
    else:
        state.crossed.side[c, p] = 0 if ahead > d else 1


# --- Faces -----------------------------------------------------------------------------------------------


def time_of_face(pull, length, x, v):
    """Return the time at which a coordinate leaves [0, length]."""
    return math.inf if length is None else max(time_out(pull, (0.0, length_of(length)), x, v), 0.0)


def step_over(leaves, v):
    """Return the step to the next cell along an axis for a particle that leaves through a face, else 0."""
    return select(leaves, select(v > 0.0, 1.0, -1.0), 0.0)


def beyond_face(length, x, step):
    """Return a coordinate in the next cell, at its face."""
    if step == 0.0:
        return x
    return 0.0 if step > 0.0 else length_of(length)


def is_same(one, other):
    """Whether two cells are the same."""
    return total(absolute(one - other)) == 0.0

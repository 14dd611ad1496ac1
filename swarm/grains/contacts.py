"""The contacts of a step: their impulses, which depend on one another, one contact after the other to convergence.

With the vector s from one centre to the other at both ends of a step, the gap g = R_i + R_j - |s| and V of
contact/regularisation.py, the impulse on i is the composite discrete gradient of V with q = |s|^2,
    J = -h (V1 - V0)/(q1 - q0) (s0 + s1) = h V[g0, g1] (s0 + s1)/(|s0| + |s1|),
as q is quadratic; so J.(s1 - s0)/h = -(V1 - V0), and a wall is the same with its own q and discrete gradient.
A damper adds C (Phi1 - Phi0)/h to V[g0, g1], and the sum is no less than 0: what it takes is 0 or more, for Phi grows
with g. Where two balls meet alone the restitution then is the same at any speed, for any exponent: see `damping_of`.
"""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import absolute, dot, square, total
from .cell import nearest
from .grain_arrays import (
    AFTER,
    BEFORE,
    COAST,
    DAMPING,
    DRAG,
    EASE,
    GAIN,
    GAP,
    IMPULSE,
    KEPT_ROLL,
    LIGHTNESS,
    LISTED,
    LOST,
    PUSH,
    RADIUS,
    ROLL,
    SIZE,
    START,
    X,
    set_vector,
    vector_at,
)

_TINY = 1e-300
# Where a damper acts, a change of an impulse counts so much less: what it takes is booked by what it did.
_DAMPED = 1e-6


class Losses(Record):
    """What is lost at a contact."""

    damping: Any  # None, or what is multiplied with the root of the mass that moves
    friction: Any  # None, or Coulomb's coefficient; 0 where only rolling is resisted
    rolling: Any = None  # None, or the coefficient of rolling.py


class Matter(Record):
    """What is the same for all balls and all steps."""

    law: Any  # the regularisation
    pull: Any  # gravity, or None
    h: float  # the step [s]
    pairs: Any  # their `Losses`
    walls: Any  # of each wall the same
    period: Any  # `Lengths`, or None
    limits: Any  # `Limits` of overlaps.py
    openings: Any  # of all walls, or None
    counters: Any = None  # `counters.Counters`, or None
    holds: Any = None  # True where walls hold balls, else None

    @property
    def rubs(self):
        """Whether there is any friction: a constant for the compiler."""
        return any(one.friction is not None for one in (self.pairs, *self.walls))

    @property
    def damped(self):
        """Whether a damper acts at every contact: a constant for the compiler."""
        return all(one.damping is not None for one in (self.pairs, *self.walls))

    @property
    def rolls(self):
        """Whether any rolling is resisted: a constant for the compiler."""
        return any(one.rolling is not None for one in (self.pairs, *self.walls))


# --- The law of a contact --------------------------------------------------------------------------------


def pressed(matter, damping, gap, change):
    """The impulse at a contact with a gap that changes so in a step, 0 or more, and its derivative by the change.

    The damping is that over the step.
    """
    h = matter.h
    force, stiffness = matter.law.energy_slope(gap, gap + change)
    if damping is not None:
        slope, bend = matter.law.constraint_slope(gap, gap + change)
        force = force + damping * slope * change
        stiffness = stiffness + damping * (slope + bend * change)
    return select(force > 0.0, h * force, 0.0), h * stiffness


def damper(own, rows, c):
    """The damping in a row, or None for a law without damping."""
    return None if own is None else rows[c, DAMPING]


def weight_of(law):
    """How much a change of an impulse counts."""
    return 1.0 if law.damping is None else _DAMPED


def lasting(gap):
    """1 where a contact of this gap has been one in the step before, else 0: then what is kept of it is old."""
    return select(gap > 0.0, 1.0, 0.0)


def worse(off, worst):
    """The larger one of two errors, NaN where one is."""
    return select((off <= worst) | (worst != worst), worst, off)


def improved(push, wanted, gain):
    """A Newton step of the size of an impulse."""
    new = push + (wanted - push) * gain
    return select(new > 0.0, new, 0.0)


def begin_solve(rows, c, pressed_first, ease):
    """The first size of an impulse, and the gain of all Newton steps."""
    push, slope = pressed_first
    rows[c, PUSH] = push
    rows[c, GAIN] = 1.0 / (1.0 + select(slope > 0.0, ease * slope, 0.0))


def relative(matter, more, push, speeds, ease):
    """A change of an impulse, relative to what moves there, and to what weight does in a step."""
    fall = 0.0 if matter.pull is None else matter.h * size_of(matter.pull)
    return size_of(more) * ease / (push * ease + (speeds + fall) + _TINY)


def changed(old, new, share):
    """The change from an impulse to the new one, and that share of it, which is made."""
    more = new - old
    return more, share * more


def change_row(rows, c, k, new, share):
    """The same of an impulse in three columns of a row, which it changes."""
    old = vector_at(rows, c, k)
    more, part = changed(old, new, share)
    set_vector(rows, c, k, old + part)
    return more, part


def size_of(a):
    """The sum of the magnitudes of the components."""
    return total(absolute(a))


# --- Of pairs --------------------------------------------------------------------------------------------


class Closing(Record):
    """Two balls in a step: s0 + s1 over |s0| + |s1|, and the change of the gap."""

    along: Any
    change: float


def closing(s0, size, move):
    """The `Closing` of two balls at s0, of that size; their s changes by `move`."""
    both = s0 + s0 + move
    risen = dot(move, both)
    q1 = size * size + risen
    inverse = 1.0 / (size + math.sqrt(select(q1 > 0.0, q1, 0.0)))
    return Closing(inverse * both, -inverse * risen)


def apart(matter, place, i, j):
    """The vector from ball j to ball i, with what round-off has taken of their places."""
    s = nearest(matter.period, vector_at(place, i, X), vector_at(place, j, X))
    return s + (vector_at(place, i, LOST) - vector_at(place, j, LOST))


@outlined
def gather_pairs(matter, grains, near, touches):
    """Add the pairs that are in contact at an end of the step to its contacts; how many are new."""
    place, speed, half = grains.place, grains.speed, 0.5 * matter.h
    rows, count = touches.rows, touches.used[0]
    known = count
    for a in range(place.shape[0]):
        i = index(a)
        here, radius = vector_at(speed, i, BEFORE) + vector_at(speed, i, AFTER), place[i, RADIUS]
        for k in range(near.first[i], near.first[i + 1]):
            if near.is_on[index(k)]:
                continue
            b = near.mate[index(k)]
            j = index(b)
            s0 = apart(matter, place, i, j)
            move = half * (here - (vector_at(speed, j, BEFORE) + vector_at(speed, j, AFTER)))
            reach, q0 = radius + place[j, RADIUS], square(s0)
            is_in = min(q0, square(s0 + move)) < reach * reach
            if matter.holds is not None:
                is_in = is_in & (place[i, LIGHTNESS] + place[j, LIGHTNESS] > 0.0)
            if is_in:
                near.is_on[index(k)] = True
                c, size = index(count), math.sqrt(q0)
                touches.ends[c, 0], touches.ends[c, 1] = a, b
                set_vector(rows, c, START, s0)
                rows[c, SIZE], rows[c, GAP] = size, reach - size
                set_vector(rows, c, COAST, half * (vector_at(speed, i, BEFORE) - vector_at(speed, j, BEFORE)))
                ease = place[i, LIGHTNESS] + place[j, LIGHTNESS]
                rows[c, EASE] = ease
                if matter.pairs.damping is not None:
                    rows[c, DAMPING] = matter.pairs.damping / math.sqrt(ease) / matter.h
                way = closing(s0, size, move)
                first = pressed(matter, damper(matter.pairs.damping, rows, c), rows[c, GAP], way.change)
                begin_solve(rows, c, first, half * ease)
                set_vector(rows, c, IMPULSE, rows[c, PUSH] * way.along)
                if near.drag is not None:
                    rows[c, LISTED] = k
                if matter.pairs.friction is not None:
                    set_vector(rows, c, DRAG, vector_at(near.drag, index(k), 0) * lasting(rows[c, GAP]))
                if matter.pairs.rolling is not None:
                    set_vector(rows, c, ROLL, vector_at(near.drag, index(k), KEPT_ROLL) * lasting(rows[c, GAP]))
                count += 1
    touches.used[0] = count
    return count - known


@outlined
def push_pairs(matter, grains, touches):
    """Add the impulses of the pairs to the velocities at the end of the step."""
    rows, place, speed = touches.rows, grains.place, grains.speed
    for k in range(touches.used[0]):
        c = index(k)
        i, j, impulse = index(touches.ends[c, 0]), index(touches.ends[c, 1]), vector_at(rows, c, IMPULSE)
        if matter.pairs.friction is not None:
            impulse = impulse + vector_at(rows, c, DRAG)
        set_vector(speed, i, AFTER, vector_at(speed, i, AFTER) + impulse * place[i, LIGHTNESS])
        set_vector(speed, j, AFTER, vector_at(speed, j, AFTER) - impulse * place[j, LIGHTNESS])

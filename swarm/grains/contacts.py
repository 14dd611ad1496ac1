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
from . import grain_arrays as col
from .cell import nearest
from .grain_arrays import set_vector, vector_at

_TINY = 1e-300
# No less than this part of the velocities counts as what moves at a contact: round-off of them is then 1e-10 of it, and
# sweeps end that gain no more, `_NEARLY` of step.py.
_BELOW_ROUND_OFF = 2e-6
# Where a damper acts, a change of an impulse counts so much less: what it takes is booked by what it did.
_DAMPED = 1e-6
# The margin is so many times what the step before would have needed, and is relied on up to that part of it: round-off
# decides nothing. It is for speed alone.
_WIDER, _SURE = 8.0, 0.5


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
    slips: float = 0.0  # the tolerance of friction

    @property
    def rubs(self):
        """Whether there is any friction: a constant for the compiler."""
        return any(one.friction is not None for one in (self.pairs, *self.walls))

    @property
    def rubs_everywhere(self):
        """Whether there is friction at every contact: a constant for the compiler."""
        return all(one.friction is not None for one in (self.pairs, *self.walls))

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
    return None if own is None else rows[c, col.DAMPING]


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


def begin_solve(pressed_first, ease):
    """The first size of an impulse, and the gain of all Newton steps."""
    push, slope = pressed_first
    return push, 1.0 / (1.0 + select(slope > 0.0, ease * slope, 0.0))


def scale_of(matter, push, speeds, ease):
    """A factor: the magnitude of a change of an impulse times it is relative to what moves at the contact and falls.

    What moves is taken as the solution begins: the size of the impulse, and `speeds`, the relative speed and the sum of
    both speeds. The relative speed counts, so that balls that are carried along are solved as at rest, but no less than
    the round-off of the sum.
    """
    fall = 0.0 if matter.pull is None else matter.h * size_of(matter.pull)
    relative, whole = speeds
    moving, least = push * ease + (relative + fall), _BELOW_ROUND_OFF * whole + _TINY
    return ease / select(moving > least, moving, least)


def changed(old, new, share):
    """The change from an impulse to the new one, and that share of it, which is made."""
    more = new - old
    return more, share * more


def change_of(contact, k, new, share):
    """The same of an impulse in three columns of a contact, which it changes."""
    old = contact.vector(k)
    more, part = changed(old, new, share)
    contact.set_vector(k, old + part)
    return more, part


def size_of(a):
    """The sum of the magnitudes of the components."""
    return total(absolute(a))


# --- Of sweeps for friction ------------------------------------------------------------------------------


class ContactSweep(Record):
    """One of some sweeps: its number, 0 where it goes over all contacts, the share of changes, and what is solved.

    `inverse` is 1/omega of successive over-relaxation, by which friction changes omega times as much as it would alone.

    Which contacts a later sweep for friction goes over is noted by their balls, `Touches.stirred`.
    """

    number: int
    share: float
    solved: float
    inverse: float


def is_due(sweep, stirred, i):
    """Whether a contact of a ball was not solved in the sweep before or in this one: else none of the ball changes."""
    return stirred[i] >= sweep.number - 1


def stir(sweep, stirred, i, off):
    """Note where a contact of a ball is not solved."""
    stirred[i] = select(off <= sweep.solved, stirred[i], sweep.number)


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
    s = nearest(matter.period, vector_at(place, i, col.X), vector_at(place, j, col.X))
    return s + (vector_at(place, i, col.LOST) - vector_at(place, j, col.LOST))


def _note(rows, c, a, b, k):
    rows[c, col.ONE], rows[c, col.OTHER], rows[c, col.PLACE] = a, b, k


def move_of(matter, grains, i):
    """The move of a ball in the step."""
    return 0.5 * matter.h * (vector_at(grains.speed, i, col.BEFORE) + vector_at(grains.speed, i, col.AFTER))


def foresee(matter, grains, course, i):
    """Write the course of a ball in the step, by its velocities at both ends."""
    place = grains.place
    set_vector(course, i, col.FROM, vector_at(place, i, col.X))
    set_vector(course, i, col.MOVE, move_of(matter, grains, i))
    course[i, col.EXTENT], course[i, col.YIELDING] = place[i, col.RADIUS], place[i, col.LIGHTNESS]


def _course(course, i):
    """The course of a ball, read."""
    here, move = vector_at(course, i, col.FROM), vector_at(course, i, col.MOVE)
    return here, move, course[i, col.EXTENT], course[i, col.YIELDING]


def _approach(matter, course, ball, j):
    """The square of how near two balls are at an end of the step, at least, and R_i + R_j, by the courses of both.

    That of the first one is given as it was read. What round-off has taken of places decides nothing here.
    """
    here, move, extent, yielding = ball
    s0 = nearest(matter.period, here, vector_at(course, j, col.FROM))
    q0, q1 = square(s0), square(s0 + (move - vector_at(course, j, col.MOVE)))
    nearest_one, reach = select(q1 < q0, q1, q0), extent + course[j, col.EXTENT]
    if matter.holds is None:
        return nearest_one, reach
    # Where walls hold both they do not meet.
    return select(yielding + course[j, col.YIELDING] > 0.0, nearest_one, math.inf), reach


@outlined
def _foresee_all(matter, grains, touches):
    """Write the courses of all balls."""
    for k in range(grains.place.shape[0]):
        foresee(matter, grains, touches.course, index(k))


@outlined
def find_pairs(matter, near, touches):
    """Find the pairs that are in contact at an end of the step, and those that miss one another by the margin or less.

    How many contacts are new.
    """
    course, found, missed = touches.course, touches.found, touches.missed
    known, count, passed, margin = touches.used[0], touches.used[0], 0, touches.margin[0]
    for a in range(course.shape[0]):
        i = index(a)
        ball = _course(course, i)
        for k in range(near.first[i], near.first[i + 1]):
            b, was_on = near.mate[index(k)], near.is_on[index(k)]
            q, reach = _approach(matter, course, ball, index(b))
            # Without a branch, which would go either way: a row that does not count is written over.
            is_on = was_on | (q < reach * reach)
            near.is_on[index(k)] = is_on
            _note(found, index(count), a, b, k)
            count += is_on & (not was_on)
            wide = reach + margin
            _note(missed, index(passed), a, b, k)
            passed += (q < wide * wide) & (not is_on)
    touches.used[0], touches.passed[0] = count, passed
    return count - known


@outlined
def _find_missed(matter, grains, near, touches):
    """The same among those that have missed one another by the margin or less."""
    course, found, missed, count = touches.course, touches.found, touches.missed, touches.used[0]
    known = count
    for m in range(touches.passed[0]):
        a, b, k = missed[index(m), col.ONE], missed[index(m), col.OTHER], missed[index(m), col.PLACE]
        foresee(matter, grains, course, index(a))
        foresee(matter, grains, course, index(b))
        q, reach = _approach(matter, course, _course(course, index(a)), index(b))
        if (q < reach * reach) & (not near.is_on[index(k)]):
            near.is_on[index(k)] = True
            _note(found, index(count), a, b, k)
            count += 1
    touches.used[0] = count
    return count - known


class Travel(Record):
    """How far balls are, at the end of a step, from where they were foreseen and listed, and how far they moved."""

    off_course: Any  # with the last step's change, at most [m]
    from_list: Any  # their squares, at most [m^2]
    longest: Any


@outlined
def travel_of(matter, grains):
    """The `Travel` of all balls."""
    place, speed, listed, half = grains.place, grains.speed, grains.listed, 0.5 * matter.h
    off, farthest, longest = 0.0, 0.0, 0.0
    for k in range(place.shape[0]):
        i = index(k)
        v, end = vector_at(speed, i, col.BEFORE), vector_at(speed, i, col.AFTER)
        off = worse(square(end - (v + vector_at(grains.change, i, col.LAST))), off)
        move = (v + end) * half
        farthest = worse(square(vector_at(place, i, col.X) + move - vector_at(listed, i, col.X)), farthest)
        longest = worse(square(move), longest)
    return Travel(half * math.sqrt(off), farthest, longest)


def find_more_pairs(matter, grains, near, touches, off_course):
    """Find the pairs that are in contact by what has been solved, and were not before; how many.

    `off_course` is that of the `Travel`.
    """
    # Two balls are nearer than foreseen by no more than this.
    off = 2.0 * off_course
    is_known = off <= _SURE * touches.margin[0]
    touches.margin[0] = off * _WIDER
    if is_known:
        return _find_missed(matter, grains, near, touches)
    _foresee_all(matter, grains, touches)
    return find_pairs(matter, near, touches)

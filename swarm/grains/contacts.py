"""The contacts of a step. Their impulses depend on one another, and are solved one after the other to convergence.

With the vector s from one centre to the other at both ends of a step, the gap g = R_i + R_j - |s| and V of
contact/regularisation.py, the impulse on i is the composite discrete gradient of V with q = |s|^2,
    J = -h (V1 - V0)/(q1 - q0) (s0 + s1) = h V[g0, g1] (s0 + s1)/(|s0| + |s1|),
as q is quadratic; so J.(s1 - s0)/h = -(V1 - V0). A wall has the same equation with its own q and discrete gradient.
A damper adds C (Phi1 - Phi0)/h to V[g0, g1], and the sum is no less than 0. The energy that it takes is 0 or more, for
Phi grows with g. The restitution of two balls alone is then the same at any speed, for any exponent: see `damping_of`.
"""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import absolute, dot, set_vector, square, total, vector_at
from . import grain_arrays as col
from .cell import nearest

_TINY = 1e-300
# The speed to which changes at a contact are relative is no less than this part of the velocities. Their round-off is
# then 1e-10 of it, and sweeps that gain no more end (`_NEARLY` of step.py).
_BELOW_ROUND_OFF = 2e-6
# The weight of a change of an impulse where a damper acts: the energy that the damper takes is booked from the impulse
# as it is, so that an error in it loses none.
_DAMPED = 1e-6
# The margin is `_WIDER` times the one that the step before would have needed. It is relied on up to its part `_SURE`,
# so that round-off decides nothing. It has no purpose but speed.
_WIDER, _SURE = 8.0, 0.5


class Losses(Record):
    """The dampers and the friction at a contact."""

    damping: Any  # None, or the factor of the root of the mass that moves
    friction: Any  # None, or Coulomb's coefficient; 0 where only rolling is resisted
    rolling: Any = None  # None, or the coefficient of rolling.py


class Matter(Record):
    """The constants of all balls and all steps."""

    law: Any  # the regularisation
    pull: Any  # gravity, or None
    h: float  # the step [s]
    pairs: Any  # their `Losses`
    walls: Any  # the `Losses` of each wall
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
        """Whether rolling is resisted at any contact: a constant for the compiler."""
        return any(one.rolling is not None for one in (self.pairs, *self.walls))


# --- The law of a contact --------------------------------------------------------------------------------


def pressed(matter, damping, gap, change):
    """Return the impulse, 0 or more, of a contact with a change of the gap, and its derivative by the change.

    `damping` has been divided by the step.
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
    """The weight of a change of an impulse."""
    return 1.0 if law.damping is None else _DAMPED


def lasting(gap):
    """Return 1 if a contact with this gap was one in the step before, else 0, as its kept impulses are out of date."""
    return select(gap > 0.0, 1.0, 0.0)


def worse(off, worst):
    """The larger one of two errors, or NaN if one of them is NaN."""
    return select((off <= worst) | (worst != worst), worst, off)


def improved(push, wanted, gain):
    """Return the size of an impulse after a Newton step."""
    new = push + (wanted - push) * gain
    return select(new > 0.0, new, 0.0)


def begin_solve(pressed_first, ease):
    """Return the first size of an impulse, and the gain of all Newton steps."""
    push, slope = pressed_first
    return push, 1.0 / (1.0 + select(slope > 0.0, ease * slope, 0.0))


def scale_of(matter, push, speeds, ease):
    """Return the factor that makes a change of an impulse relative to the speed at the contact.

    This speed is that of the first impulse, of the fall in a step and of the relative velocity. `speeds` are the
    magnitude of the relative velocity, by which balls that are carried along are solved as at rest, and the sum of the
    magnitudes of both velocities; round-off of the latter is the lower bound.
    """
    fall = 0.0 if matter.pull is None else matter.h * size_of(matter.pull)
    relative, whole = speeds
    moving, least = push * ease + (relative + fall), _BELOW_ROUND_OFF * whole + _TINY
    return ease / select(moving > least, moving, least)


def changed(old, new, share):
    """Return the change from an impulse to the new one, and the share of it that is made."""
    more = new - old
    return more, share * more


def change_of(contact, k, new, share):
    """Change an impulse in three columns of a contact by a share; return the whole change, and the share."""
    old = contact.vector(k)
    more, part = changed(old, new, share)
    contact.set_vector(k, old + part)
    return more, part


def size_of(a):
    """The sum of the magnitudes of the components."""
    return total(absolute(a))


# --- Sweeps for friction ---------------------------------------------------------------------------------


class ContactSweep(Record):
    """A sweep for friction.

    The contacts that later sweeps go over are noted by their balls, in `Touches.stirred`.
    """

    number: int  # 0 goes over all contacts
    share: float  # the share of a change that is made
    solved: float  # the change below which a contact is solved
    inverse: float  # 1/omega of successive over-relaxation: friction changes omega times as much as without it


def is_due(sweep, stirred, i):
    """Whether a contact of a ball was unsolved in this sweep or the one before; else none of its contacts changes."""
    return stirred[i] >= sweep.number - 1


def stir(sweep, stirred, i, off):
    """Note the sweep for a ball if a contact with the error `off` is not solved."""
    stirred[i] = select(off <= sweep.solved, stirred[i], sweep.number)


# --- Pairs -----------------------------------------------------------------------------------------------


class Closing(Record):
    """Two balls in a step: s0 + s1 over |s0| + |s1|, and the change of the gap."""

    along: Any
    change: float


def closing(s0, size, move):
    """Return the `Closing` of two balls at s0 of magnitude `size`, where s changes by `move`."""
    both = s0 + s0 + move
    risen = dot(move, both)
    q1 = size * size + risen
    inverse = 1.0 / (size + math.sqrt(select(q1 > 0.0, q1, 0.0)))
    return Closing(inverse * both, -inverse * risen)


def apart(matter, place, i, j):
    """The vector from ball j to ball i, with the round-off lost from their centres."""
    s = nearest(matter.period, vector_at(place, i, col.X), vector_at(place, j, col.X))
    return s + (vector_at(place, i, col.LOST) - vector_at(place, j, col.LOST))


def _note(rows, c, a, b, k):
    rows[c, col.ONE], rows[c, col.OTHER], rows[c, col.PLACE] = a, b, k


def move_of(matter, grains, i):
    """Return the move of a ball in the step."""
    return 0.5 * matter.h * (vector_at(grains.speed, i, col.BEFORE) + vector_at(grains.speed, i, col.AFTER))


def foresee(matter, grains, course, i):
    """Write the course of a ball in the step, from its velocities at both ends."""
    place = grains.place
    set_vector(course, i, col.FROM, vector_at(place, i, col.X))
    set_vector(course, i, col.MOVE, move_of(matter, grains, i))
    course[i, col.EXTENT], course[i, col.YIELDING] = place[i, col.RADIUS], place[i, col.LIGHTNESS]


def _course(course, i):
    """Return the course of a ball: its centre, its move, its radius and 1/mass."""
    here, move = vector_at(course, i, col.FROM), vector_at(course, i, col.MOVE)
    return here, move, course[i, col.EXTENT], course[i, col.YIELDING]


def _approach(matter, course, ball, j):
    """Return the square of the smaller distance of two balls at the ends of the step, and R_i + R_j.

    `ball` is the course of the first one. The round-off lost from places decides nothing here.
    """
    here, move, extent, yielding = ball
    s0 = nearest(matter.period, here, vector_at(course, j, col.FROM))
    q0, q1 = square(s0), square(s0 + (move - vector_at(course, j, col.MOVE)))
    nearest_one, reach = select(q1 < q0, q1, q0), extent + course[j, col.EXTENT]
    if matter.holds is None:
        return nearest_one, reach
    # Two balls that walls hold do not meet.
    return select(yielding + course[j, col.YIELDING] > 0.0, nearest_one, math.inf), reach


@outlined
def _foresee_all(matter, grains, touches):
    """Write the courses of all balls."""
    for k in range(grains.place.shape[0]):
        foresee(matter, grains, touches.course, index(k))


@outlined
def find_pairs(matter, near, touches):
    """Find the pairs in contact at an end of the step, and the pairs that miss one another by the margin or less.

    Return how many contacts are new.
    """
    course, found, missed = touches.course, touches.found, touches.missed
    known, count, passed, margin = touches.used[0], touches.used[0], 0, touches.margin[0]
    for a in range(course.shape[0]):
        i = index(a)
        ball = _course(course, i)
        for k in range(near.first[i], near.first[i + 1]):
            b, was_on = near.mate[index(k)], near.is_on[index(k)]
            q, reach = _approach(matter, course, ball, index(b))
            # There is no branch, which no processor could predict; a row that does not count is written over.
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
    """Find the pairs in contact among those that missed one another by the margin or less; return how many are new."""
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
    """The largest distances of balls at the end of a step: from the place foreseen, the listed place, and the start."""

    off_course: Any  # from the place foreseen by the change of the last step [m]
    from_list: Any  # from the place when listed, squared [m^2]
    longest: Any  # of a move in the step, squared [m^2]


@outlined
def travel_of(matter, grains):
    """Return the `Travel` of all balls."""
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
    """Find the pairs that the solved impulses have brought into contact; return how many are new.

    `off_course` is the one of the `Travel`.
    """
    # Two balls are nearer than foreseen by no more than this.
    off = 2.0 * off_course
    is_known = off <= _SURE * touches.margin[0]
    touches.margin[0] = off * _WIDER
    if is_known:
        return _find_missed(matter, grains, near, touches)
    _foresee_all(matter, grains, touches)
    return find_pairs(matter, near, touches)

"""Coulomb's friction at the contacts of a step, and spins.

With s the mean of the vector between the centres at both ends of a step, R = R_i + R_j and the impulse J on ball i, the
twist T = s x J/R turns both balls the same way, I_i (w1 - w0) = -R_i T and I_j (w1 - w0) = -R_j T: the arms add up to
s, so that angular momentum is conserved. The slip is u = v_i - v_j - (R_i w_i + R_j w_j) x s/R across s, and with its
mean over the step friction does the work J.u. At a wall the arm is the radius, and the wall's own velocity counts.

A contact sticks if an impulse within mu times the normal one leaves no slip at the end of the step: a pile at rest does
not creep. Else it slides, with mu times the normal impulse against the slip at the end. With the mean slip instead, a
contact that reverses within a step has no impulse on which its neighbours can rely, and sweeps over dense piles go in
cycles. So a slip that reverses may gain a little energy in that step, which is booked as a negative loss.
"""

import math

from ..contact.wall_impact import give_work
from ..kernel.arrays import index
from ..kernel.jit import outlined, select
from ..kernel.limits import EPSILON
from ..kernel.vector import ZERO, cross, dot, set_vector, square, vector_at
from ..surfaces.in_motion.posed import Posed
from . import grain_arrays as col
from .at_walls import press_at_wall, step_at_wall, velocity_at_end
from .contacts import change_of, is_due, size_of, stir, worse
from .grain_arrays import ROUNDNESS, OfWall
from .heavy_walls import ease_across, is_heavy, now, react
from .vessel import gives_work, met

# The error of the square of the length of a unit vector.
_UNIT = 8.0 * EPSILON


def across(a, n):
    """The part of a vector perpendicular to n; the whole vector where n is 0."""
    size2 = square(n)
    return a - (dot(a, n) / select(size2 > 0.0, size2, 1.0)) * n


def rubbed(drag, slip, ease, limit):
    """Return the impulse of friction, at most `limit`, from the last one, the slip at the end with it, and its ease."""
    stick = drag - slip * (1.0 / ease)
    size = math.sqrt(square(stick))
    return stick * select(size > limit, limit / select(size > 0.0, size, 1.0), 1.0)


# --- Pairs -----------------------------------------------------------------------------------------------


def arm_of(way, size, change, nearness):
    """s/R of two balls, from their `Closing`, |s0|, the change of the gap, and 1/R."""
    # s0 + s1 = (|s0| + |s1|) along.
    return way.along * (0.5 * (2.0 * size - change) * nearness)


# --- Walls -----------------------------------------------------------------------------------------------


def _carried(wall, r0, r1):
    """Return twice the mean velocity of the surface of a wall over a step, and the velocity at its end."""
    last = velocity_at_end(wall, r1)
    return (wall.velocity(r0) if isinstance(wall, Posed) else ZERO) + last, last


def _facing(own, way, radius, r0, move):
    """Return the unit normal of a contact with a wall, and the velocities `_carried` of the wall there.

    The normal is 0 where a step leads through a slab to the same depth on its other side, with the same stored energy.
    """
    n, size2 = way.along, square(way.along)
    # At a flat wall `along` is the unit normal, except in a step from one side of a slab to the other.
    if not (own.flat and abs(size2 - 1.0) <= _UNIT):
        n = n * (1.0 / math.sqrt(select(size2 > 0.0, size2, 1.0)))
    return n, _carried(own, r0 - radius * n, r0 + move - radius * n)


def faced(matter, wall, grains, touches, c, i):
    """Return the result of `_facing` for the ball of contact c, and its current move in the step."""
    own, move, way = step_at_wall(matter, wall, grains, touches, c, i)
    return *_facing(own, way, grains.place[i, col.RADIUS], vector_at(touches.wall_rows, c, col.START), move), move


@outlined
def rub_wall(matter, law, wall, grains, touches, number, sweep):
    """Improve the impulse and the friction of each ball at a wall; return the largest changes, as for pairs."""
    rows, speed, spin, half = touches.wall_rows, grains.speed, grains.spin, 0.5 * matter.h
    worst, pressed_worst = 0.0, 0.0
    begin, share = touches.wall_spans[0, number], sweep.share
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        # The contacts of other balls also move a wall with a mass.
        if not is_heavy(wall) and not is_due(sweep, touches.stirred, i):
            continue
        radius, ease, w = grains.place[i, col.RADIUS], rows[c, col.EASE], vector_at(spin, i, col.AFTER)
        own = met(wall, touches.listed, touches.spans, c, radius)
        way, v, off = press_at_wall(matter, law, own, grains, rows, (c, i), share)
        move = vector_at(rows, c, col.COAST) + half * v
        n, (_both, last) = _facing(now(own), way, radius, vector_at(rows, c, col.START), move)
        slip = across(v - last - radius * cross(w, n), n)
        before = across(vector_at(rows, c, col.DRAG), n)
        slipping = sweep.inverse * ease_across(own, rows, c, ease * (1.0 + ROUNDNESS))
        new = rubbed(before, slip, slipping, law.friction * rows[c, col.PUSH])
        more, part = change_of(OfWall(rows, c), col.DRAG, new, share)
        react(own, part)
        set_vector(speed, i, col.AFTER, v + part * ease)
        set_vector(spin, i, col.AFTER, w - cross(n, part) * (ROUNDNESS * ease / radius))
        pressed_worst = worse(off, pressed_worst)
        off = worse(size_of(more) * rows[c, col.SCALE], off)
        stir(sweep, touches.stirred, i, off)
        worst = worse(off, worst)
    return worst, pressed_worst


@outlined
def twist_wall(matter, wall, grains, touches, number):
    """Add the twists of a wall to the spins at the end of the step; the velocities there are final."""
    rows, spin, begin = touches.wall_rows, grains.spin, touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        n, _velocities, _move = faced(matter, wall, grains, touches, c, i)
        turned = cross(n, vector_at(rows, c, col.DRAG)) * (ROUNDNESS * rows[c, col.EASE] / grains.place[i, col.RADIUS])
        set_vector(spin, i, col.AFTER, vector_at(spin, i, col.AFTER) - turned)


@outlined
def book_rubbing(matter, wall, grains, near, touches, books, number):
    """Book the energy that friction at a wall takes from balls, and the work of the wall; keep its impulse."""
    rows, spin, begin = touches.wall_rows, grains.spin, touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        one, drag = index(grains.number[i]), vector_at(rows, c, col.DRAG)
        set_vector(near.wall_drag, index(int(rows[c, col.LISTED])), 0, drag)
        n, (both, _last), move = faced(matter, wall, grains, touches, c, i)
        turned = vector_at(spin, i, col.BEFORE) + vector_at(spin, i, col.AFTER)
        gained = dot(drag, move) / matter.h - 0.5 * grains.place[i, col.RADIUS] * dot(cross(n, drag), turned)
        given = 0.5 * dot(drag, both)
        rows[c, col.RUBBED] = given - gained
        books.dissipated[one] += given - gained
        if gives_work(wall):
            give_work(books, index(number), one, given)

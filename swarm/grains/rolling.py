"""Resistance to rolling at the contacts of a step.

A contact with the normal impulse J resists the angular velocity w_i - w_j across its normal, at a wall the one relative
to the wall. The angular impulse is at most rolling R J, with R = R_i R_j/(R_i + R_j), at a wall the radius, and at most
the one that stops the rolling. It is opposite for both balls, so that angular momentum is conserved. This is the model
of a directional constant torque of Zhou, Wright, Yang, Xu & Yu, Physica A 269 (1999) 536-553. With friction that holds,
a ball rolls on a plane with a deceleration of 5/7 rolling G.
"""

from ..contact.wall_impact import give_work
from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.vector import ZERO, dot, set_vector, square, vector_at
from ..surfaces.in_motion.posed import Posed
from . import grain_arrays as col
from .contacts import change_of, size_of, stir, worse
from .friction import across, rubbed
from .grain_arrays import ROUNDNESS, OfWall
from .lanes_of_pairs import pair_at
from .vessel import gives_work, met


def _ease(place, i):
    """1/I of a ball."""
    return ROUNDNESS * place[i, col.LIGHTNESS] / (place[i, col.RADIUS] * place[i, col.RADIUS])


def _resist(contact, rolling, sizes, sweep):
    """Improve the angular impulse of a contact by the rolling at the end of the step; return the change, and the error.

    `rolling` is the relative angular velocity and the coefficient, `sizes` the radius R and 1/I.
    """
    (radius, ease), n, roll = sizes, contact.vector(col.IMPULSE), contact.vector(col.ROLL)
    if not square(n) > 0.0:
        contact.set_vector(col.ROLL, ZERO)
        return -1.0 * roll, 0.0
    limit = rolling[1] * radius * contact.number(col.PUSH)
    new = rubbed(across(roll, n), across(rolling[0], n), sweep.inverse * ease, limit)
    more, part = change_of(contact, col.ROLL, new, sweep.share)
    return part, size_of(more * (1.0 / radius)) * contact.number(col.SCALE)


# --- Pairs -----------------------------------------------------------------------------------------------


@outlined
def roll_pairs(matter, grains, touches, sweep):
    """Improve the angular impulse of each pair in turn; return the largest relative change."""
    place, spin, worst = grains.place, grains.spin, 0.0
    for g in range(touches.used[1]):
        for k in range(touches.lanes[index(g)]):
            contact, (i, j) = pair_at(touches, g, index(k))
            w, u = vector_at(spin, i, col.AFTER), vector_at(spin, j, col.AFTER)
            one, two = _ease(place, i), _ease(place, j)
            radius = place[i, col.RADIUS] * place[j, col.RADIUS] / (place[i, col.RADIUS] + place[j, col.RADIUS])
            rolling = w - u, matter.pairs.rolling
            part, off = _resist(contact, rolling, (radius, one + two), sweep)
            set_vector(spin, i, col.AFTER, w + part * one)
            set_vector(spin, j, col.AFTER, u - part * two)
            stir(sweep, touches.stirred, i, off)
            stir(sweep, touches.stirred, j, off)
            worst = worse(off, worst)
    return worst


@outlined
def turn_pairs(grains, touches):
    """Add the angular impulses of all pairs to the spins at the end of the step."""
    place, spin = grains.place, grains.spin
    for g in range(touches.used[1]):
        for k in range(touches.lanes[index(g)]):
            contact, (i, j) = pair_at(touches, g, index(k))
            roll = contact.vector(col.ROLL)
            set_vector(spin, i, col.AFTER, vector_at(spin, i, col.AFTER) + roll * _ease(place, i))
            set_vector(spin, j, col.AFTER, vector_at(spin, j, col.AFTER) - roll * _ease(place, j))


@outlined
def book_rolling_pairs(grains, near, touches, books):
    """Book the energy that the resistance takes from pairs; keep its angular impulses for the next step."""
    spin = grains.spin
    for g in range(touches.used[1]):
        for k in range(touches.lanes[index(g)]):
            contact, (i, j) = pair_at(touches, g, index(k))
            roll = contact.vector(col.ROLL)
            set_vector(near.drag, contact.listed(), col.KEPT_ROLL, roll)
            turned = vector_at(spin, i, col.BEFORE) + vector_at(spin, i, col.AFTER)
            turned = turned - (vector_at(spin, j, col.BEFORE) + vector_at(spin, j, col.AFTER))
            lost = -0.25 * dot(roll, turned)
            contact.rows[contact.q + col.RUBBED, contact.lane] += 2.0 * lost
            books.dissipated[index(grains.number[i])] += lost
            books.dissipated[index(grains.number[j])] += lost


# --- Walls -----------------------------------------------------------------------------------------------


def _spin_of(wall, grains, touches, c, i):
    """The angular velocity of the wall at a contact."""
    own = met(wall, touches.listed, touches.spans, c, grains.place[i, col.RADIUS])
    return own.drive.spin if isinstance(own, Posed) and own.drive.spin is not None else ZERO


@outlined
def roll_wall(law, wall, grains, touches, number, sweep):
    """Improve the angular impulse of each ball at a wall; return the largest relative change."""
    rows, place, spin, begin, worst = touches.wall_rows, grains.place, grains.spin, touches.wall_spans[0, number], 0.0
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        w, ease = vector_at(spin, i, col.AFTER), _ease(place, i)
        rolling = w - _spin_of(wall, grains, touches, c, i), law.rolling
        part, off = _resist(OfWall(rows, c), rolling, (place[i, col.RADIUS], ease), sweep)
        set_vector(spin, i, col.AFTER, w + part * ease)
        stir(sweep, touches.stirred, i, off)
        worst = worse(off, worst)
    return worst


@outlined
def turn_wall(grains, touches, number):
    """Add the angular impulses of a wall to the spins at the end of the step."""
    rows, spin, begin = touches.wall_rows, grains.spin, touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        turned = vector_at(rows, c, col.ROLL) * _ease(grains.place, i)
        set_vector(spin, i, col.AFTER, vector_at(spin, i, col.AFTER) + turned)


@outlined
def book_rolling(wall, grains, near, touches, books, number):
    """Book the energy that the resistance at a wall takes from balls, and the work of the wall; keep its impulse."""
    rows, spin, begin = touches.wall_rows, grains.spin, touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        one, roll = index(grains.number[i]), vector_at(rows, c, col.ROLL)
        set_vector(near.wall_drag, index(int(rows[c, col.LISTED])), col.KEPT_ROLL, roll)
        gained = 0.5 * dot(roll, vector_at(spin, i, col.BEFORE) + vector_at(spin, i, col.AFTER))
        given = dot(roll, _spin_of(wall, grains, touches, c, i))
        rows[c, col.RUBBED] += given - gained
        books.dissipated[one] += given - gained
        if gives_work(wall):
            give_work(books, index(number), one, given)

"""Sweeps over the contacts of pairs, some at once, each in a lane: one after the other takes three times as long.

The contacts of a step are some parts, and a group has one of each part, so that its balls are far from one another.
Where two of a group share a ball all of it goes one by one: so each contact begins with what the ones before have led
to. The numbers of a group are beside one another, by columns, and LLVM makes vectors of them.
"""

import numpy as np

from ..kernel.arrays import fetch, index, unwritten
from ..kernel.jit import outlined
from ..kernel.vector import Vec, cross, dot, square
from .contacts import changed, closing, improved, pressed, relative, size_of, weight_of, worse
from .friction import ROUNDNESS, arm_of, rubbed
from .grain_arrays import (
    AFTER,
    COAST,
    COLUMNS,
    COLUMNS_OF_LANES,
    DAMPING,
    DRAG,
    EASE,
    GAIN,
    GAP,
    IMPULSE,
    LANES,
    LIGHTNESS,
    PUSH,
    RADIUS,
    SIZE,
    START,
    set_vector,
    vector_at,
    with_lanes,
)

# Columns of a group behind those of `Touches.rows` up to DRAG: R_i + R_j, and of both balls 1/m and what turns them.
_REACH, _EASES, _LEVERS = 19, 20, 22
# Rows of what a group begins with: v_i - v_j, the sum of the magnitudes of both, and R_i w_i + R_j w_j; and of what it
# gives: the change of the impulse, the error, and the twist.
_SLIP, _SPEEDS, _TURNING, _BEGUN = 0, 3, 4, 7
_PART, _OFF, _TWIST, _GIVEN = 0, 3, 4, 7
# The balls of contacts so much later are asked for. A loop that asks is not one of vectors either: LLVM would make
# gathers of its loads, which take AMD processors longer.
_LATER = 32


def _at(rows, k, lane):
    return Vec(rows[k, lane], rows[k + 1, lane], rows[k + 2, lane])


def _put(rows, k, lane, a):
    rows[k, lane], rows[k + 1, lane], rows[k + 2, lane] = a.x, a.y, a.z


def _groups(count):
    """How many groups so many contacts are."""
    return (count + LANES - 1) // LANES


def _lanes(count, groups, q):
    """How many lanes of a group have a contact."""
    return (count - q + groups - 1) // groups


@outlined
def group_pairs(matter, grains, touches):
    """Copy the contacts of pairs into groups."""
    rows, place, tile, marks = touches.rows, grains.place, with_lanes(touches.tile).rows, touches.marks
    count = touches.used[0]
    groups = _groups(count)
    marks[:] = -1
    for g in range(groups):
        q, shares = index(g * COLUMNS_OF_LANES), False
        for k in range(_lanes(count, groups, g)):
            lane = index(k)
            c = index(k * groups + g)
            i, j = index(touches.ends[c, 0]), index(touches.ends[c, 1])
            shares = shares | (marks[i] == g) | (marks[j] == g)
            marks[i], marks[j] = g, g
            for column in range(COLUMNS):
                tile[q + index(column), lane] = rows[c, index(column)]
            if matter.pairs.friction is not None:
                _put(tile, q + DRAG, lane, vector_at(rows, c, DRAG))
                radius, other = place[i, RADIUS], place[j, RADIUS]
                tile[q + _REACH, lane] = radius + other
                tile[q + _LEVERS, lane] = ROUNDNESS * place[i, LIGHTNESS] / radius
                tile[q + _LEVERS + 1, lane] = ROUNDNESS * place[j, LIGHTNESS] / other
            tile[q + _EASES, lane], tile[q + _EASES + 1, lane] = place[i, LIGHTNESS], place[j, LIGHTNESS]
        touches.shares[index(g)] = shares


@outlined
def return_pairs(matter, touches):
    """Copy the impulses of pairs out of their groups."""
    rows, tile, count = touches.rows, with_lanes(touches.tile).rows, touches.used[0]
    groups = _groups(count)
    for g in range(groups):
        q = index(g * COLUMNS_OF_LANES)
        for k in range(_lanes(count, groups, g)):
            lane = index(k)
            c = index(k * groups + g)
            rows[c, PUSH] = tile[q + PUSH, lane]
            set_vector(rows, c, IMPULSE, _at(tile, q + IMPULSE, lane))
            if matter.pairs.friction is not None:
                set_vector(rows, c, DRAG, _at(tile, q + DRAG, lane))


# --- A group ---------------------------------------------------------------------------------------------


def _press(matter, tile, q, lane, begun, given, share):
    """Improve the impulse of a contact of a group: its `Closing`, and the change."""
    move = _at(tile, q + COAST, lane) + 0.5 * matter.h * _at(begun, _SLIP, lane)
    way = closing(_at(tile, q + START, lane), tile[q + SIZE, lane], move)
    damping = None if matter.pairs.damping is None else tile[q + DAMPING, lane]
    wanted, _slope = pressed(matter, damping, tile[q + GAP, lane], way.change)
    push = improved(tile[q + PUSH, lane], wanted, tile[q + GAIN, lane])
    old = _at(tile, q + IMPULSE, lane)
    more, part = changed(old, push * way.along, share)
    tile[q + PUSH, lane] = push
    _put(tile, q + IMPULSE, lane, old + part)
    off = relative(matter, more, push, begun[_SPEEDS, lane], tile[q + EASE, lane])
    given[_OFF, lane] = weight_of(matter.pairs) * off
    return way, part


def _rub(matter, tile, q, lane, begun, given, share):
    """Improve the impulse and the friction of a contact of a group."""
    way, part = _press(matter, tile, q, lane, begun, given, share)
    ease, push, over = tile[q + EASE, lane], tile[q + PUSH, lane], 1.0 / square(way.along)
    arm = arm_of(way, tile[q + SIZE, lane], way.change, tile[q + _REACH, lane])
    slip = _at(begun, _SLIP, lane) + ease * part - cross(_at(begun, _TURNING, lane), arm)
    slip = slip - (dot(slip, way.along) * over) * way.along
    old = _at(tile, q + DRAG, lane)
    before = old - (dot(old, way.along) * over) * way.along
    new = rubbed(before, slip, ease * (1.0 + ROUNDNESS * square(arm)), matter.pairs.friction * push)
    more, rub = changed(old, new, share)
    _put(tile, q + DRAG, lane, old + rub)
    _put(given, _PART, lane, part + rub)
    _put(given, _TWIST, lane, cross(arm, rub))
    given[_OFF, lane] = worse(relative(matter, more, push, begun[_SPEEDS, lane], ease), given[_OFF, lane])


@outlined
def _sweep_group(matter, grains, touches, group, share):
    """Improve the impulses of a group from one lane to another; the largest change."""
    (groups, g, begin, end), tile, speed, worst = group, with_lanes(touches.tile).rows, grains.speed, 0.0
    begun, given = unwritten((_BEGUN, LANES), np.float64), unwritten((_GIVEN, LANES), np.float64)
    q = index(g * COLUMNS_OF_LANES)
    for k in range(begin, end):
        lane, c = index(k), index(k * groups + g)
        fetch(touches.ends, 2 * c + _LATER)
        v, u = vector_at(speed, index(touches.ends[c, 0]), AFTER), vector_at(speed, index(touches.ends[c, 1]), AFTER)
        _put(begun, _SLIP, lane, v - u)
        begun[_SPEEDS, lane] = size_of(v) + size_of(u)
    for k in range(begin, end):
        _way, part = _press(matter, tile, q, index(k), begun, given, share)
        _put(given, _PART, index(k), part)
    for k in range(begin, end):
        lane, c = index(k), index(k * groups + g)
        i, j, part = index(touches.ends[c, 0]), index(touches.ends[c, 1]), _at(given, _PART, lane)
        set_vector(speed, i, AFTER, vector_at(speed, i, AFTER) + part * tile[q + _EASES, lane])
        set_vector(speed, j, AFTER, vector_at(speed, j, AFTER) - part * tile[q + _EASES + 1, lane])
        worst = worse(given[_OFF, lane], worst)
    return worst


@outlined
def _rub_group(matter, grains, touches, group, share):
    """Improve the impulses of a group with those of friction, as `_sweep_group`."""
    (groups, g, begin, end), tile, place, worst = group, with_lanes(touches.tile).rows, grains.place, 0.0
    begun, given = unwritten((_BEGUN, LANES), np.float64), unwritten((_GIVEN, LANES), np.float64)
    q, speed, spin = index(g * COLUMNS_OF_LANES), grains.speed, grains.spin
    for k in range(begin, end):
        lane, c = index(k), index(k * groups + g)
        fetch(touches.ends, 2 * c + _LATER)
        i, j = index(touches.ends[c, 0]), index(touches.ends[c, 1])
        v, u = vector_at(speed, i, AFTER), vector_at(speed, j, AFTER)
        _put(begun, _SLIP, lane, v - u)
        begun[_SPEEDS, lane] = size_of(v) + size_of(u)
        turning = vector_at(spin, i, AFTER) * place[i, RADIUS] + vector_at(spin, j, AFTER) * place[j, RADIUS]
        _put(begun, _TURNING, lane, turning)
    for k in range(begin, end):
        _rub(matter, tile, q, index(k), begun, given, share)
    for k in range(begin, end):
        lane, c = index(k), index(k * groups + g)
        i, j = index(touches.ends[c, 0]), index(touches.ends[c, 1])
        part, twist = _at(given, _PART, lane), _at(given, _TWIST, lane)
        set_vector(speed, i, AFTER, vector_at(speed, i, AFTER) + part * tile[q + _EASES, lane])
        set_vector(speed, j, AFTER, vector_at(speed, j, AFTER) - part * tile[q + _EASES + 1, lane])
        set_vector(spin, i, AFTER, vector_at(spin, i, AFTER) - twist * tile[q + _LEVERS, lane])
        set_vector(spin, j, AFTER, vector_at(spin, j, AFTER) - twist * tile[q + _LEVERS + 1, lane])
        worst = worse(given[_OFF, lane], worst)
    return worst


# --- All -------------------------------------------------------------------------------------------------


def _over_groups(one, matter, grains, touches, share):
    count, worst = touches.used[0], 0.0
    groups = _groups(count)
    for g in range(groups):
        lanes = _lanes(count, groups, g)
        begin, width = 0, 1 if touches.shares[index(g)] else lanes
        while begin < lanes:
            group = groups, g, begin, begin + width
            worst = worse(one(matter, grains, touches, group, share), worst)
            begin += width
    return worst


@outlined
def sweep_pairs(matter, grains, touches, share):
    """Improve the impulse of each pair; the largest change of one, relative to what moves there."""
    return _over_groups(_sweep_group, matter, grains, touches, share)


@outlined
def rub_pairs(matter, grains, touches, share):
    """Improve the impulse and the friction of each pair; the largest change, relative to what moves there."""
    return _over_groups(_rub_group, matter, grains, touches, share)

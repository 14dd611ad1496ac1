"""Sweeps over the contacts of pairs by their groups, see groups.py.

Where two of a group share a ball it goes in parts: so each contact begins with what the ones before have led to.
"""

import numpy as np

from ..kernel.arrays import index, kept, unwritten
from ..kernel.jit import outlined
from ..kernel.vector import cross, dot, square
from .contacts import changed, closing, improved, pressed, size_of, weight_of, worse
from .friction import arm_of, rubbed, turning
from .grain_arrays import (
    AFTER,
    DAMPING,
    DRAG,
    EASE,
    GAIN,
    GAP,
    IMPULSE,
    LANES,
    NEARNESS,
    PUSH,
    ROUNDNESS,
    SCALE,
    SIZE,
    START,
    set_vector_in,
    vector_at,
    vector_in,
)
from .groups import balls_of, move_in, of_group, push_ends, twist_ends

# Rows of what a group begins with: v_i - v_j, and R_i w_i + R_j w_j; and of what it gives: the change of the impulse,
# the twist, and the largest error of the sweep in each lane.
_SLIP, _TURNING, _BEGUN = 0, 3, 6
_PART, _TWIST, _WORST, _GIVEN = 0, 3, 6, 7


# --- A group ---------------------------------------------------------------------------------------------


def _press(matter, rows, q, lane, begun, given, share):
    """Improve the impulse of a contact of a group: its `Closing`, and the change."""
    move = move_in(matter, rows, q, lane, vector_in(begun, _SLIP, lane))
    way = closing(vector_in(rows, q + START, lane), rows[q + SIZE, lane], move)
    damping = None if matter.pairs.damping is None else rows[q + DAMPING, lane]
    wanted, _slope = pressed(matter, damping, rows[q + GAP, lane], way.change)
    push = improved(rows[q + PUSH, lane], wanted, rows[q + GAIN, lane])
    old = vector_in(rows, q + IMPULSE, lane)
    more, part = changed(old, push * way.along, share)
    rows[q + PUSH, lane] = push
    set_vector_in(rows, q + IMPULSE, lane, old + part)
    off = weight_of(matter.pairs) * (size_of(more) * rows[q + SCALE, lane])
    given[_WORST, lane] = worse(off, kept(given[_WORST, lane]))
    return way, part


def _rub(matter, rows, q, lane, begun, given, share):
    """Improve the impulse and the friction of a contact of a group."""
    way, part = _press(matter, rows, q, lane, begun, given, share)
    ease, push, over = rows[q + EASE, lane], rows[q + PUSH, lane], 1.0 / square(way.along)
    arm = arm_of(way, rows[q + SIZE, lane], way.change, rows[q + NEARNESS, lane])
    slip = vector_in(begun, _SLIP, lane) + ease * part - cross(vector_in(begun, _TURNING, lane), arm)
    slip = slip - (dot(slip, way.along) * over) * way.along
    old = vector_in(rows, q + DRAG, lane)
    before = old - (dot(old, way.along) * over) * way.along
    new = rubbed(before, slip, ease * (1.0 + ROUNDNESS * square(arm)), matter.pairs.friction * push)
    more, rub = changed(old, new, share)
    set_vector_in(rows, q + DRAG, lane, old + rub)
    set_vector_in(given, _PART, lane, part + rub)
    set_vector_in(given, _TWIST, lane, cross(arm, rub))
    given[_WORST, lane] = worse(size_of(more) * rows[q + SCALE, lane], kept(given[_WORST, lane]))


def _begin(grains, ends, e, lane, begun):
    """Read what the improvement of a contact begins with; its balls."""
    i, j = balls_of(ends, e, lane)
    set_vector_in(begun, _SLIP, lane, vector_at(grains.speed, i, AFTER) - vector_at(grains.speed, j, AFTER))
    return i, j


def _sweep_group(matter, grains, touches, group, arrays, share):
    """Improve the impulses of a group from one lane to another."""
    (g, begin, end), (begun, given) = group, arrays
    rows, q, ends, e = of_group(touches, g)
    for k in range(begin, end):
        _begin(grains, ends, e, index(k), begun)
    for k in range(begin, end):
        _way, part = _press(matter, rows, q, index(k), begun, given, share)
        set_vector_in(given, _PART, index(k), part)
    for k in range(begin, end):
        push_ends(grains.speed, rows, q, ends, e, index(k), vector_in(given, _PART, index(k)))


def _rub_group(matter, grains, touches, group, arrays, share):
    """Improve the impulses of a group with those of friction, as `_sweep_group`."""
    (g, begin, end), (begun, given) = group, arrays
    rows, q, ends, e = of_group(touches, g)
    for k in range(begin, end):
        i, j = _begin(grains, ends, e, index(k), begun)
        set_vector_in(begun, _TURNING, index(k), turning(grains, i, j, AFTER))
    for k in range(begin, end):
        _rub(matter, rows, q, index(k), begun, given, share)
    for k in range(begin, end):
        push_ends(grains.speed, rows, q, ends, e, index(k), vector_in(given, _PART, index(k)))
        twist_ends(grains.spin, rows, q, ends, e, index(k), vector_in(given, _TWIST, index(k)))


# --- All -------------------------------------------------------------------------------------------------


def _over_groups(one, matter, grains, touches, share):
    begun, given = unwritten((_BEGUN, LANES), np.float64), unwritten((_GIVEN, LANES), np.float64)
    for lane in range(LANES):
        given[_WORST, index(lane)] = 0.0
    for g in range(touches.used[1]):
        lanes, splits, begin = touches.lanes[index(g)], touches.splits[index(g)], 0
        while begin < lanes:
            end = begin + 1
            while end < lanes and (splits >> end) & 1 == 0:
                end += 1
            one(matter, grains, touches, (g, begin, end), (begun, given), share)
            begin = end
    worst = 0.0
    for lane in range(LANES):
        worst = worse(given[_WORST, index(lane)], worst)
    return worst


@outlined
def sweep_pairs(matter, grains, touches, share):
    """Improve the impulse of each pair; the largest change of one, relative to what moves there."""
    return _over_groups(_sweep_group, matter, grains, touches, share)


@outlined
def rub_pairs(matter, grains, touches, share):
    """Improve the impulse and the friction of each pair; the largest change, relative to what moves there."""
    return _over_groups(_rub_group, matter, grains, touches, share)

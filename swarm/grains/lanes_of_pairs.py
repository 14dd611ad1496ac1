"""The contacts of pairs in groups, each in a lane: one after the other takes three times as long.

They are some parts, and a group has one of each part, so that its balls are far from one another. The numbers of a
group are beside one another, by columns, and LLVM makes vectors of them: what is computed for a group is a loop over
its lanes that reads what balls have, one without a branch, and one that writes to balls, which may be the same ones.
Sweeps go over all groups; where two of a group share a ball it goes in parts: so each contact begins with what the ones
before have led to.
"""

import math

import numpy as np

from ..kernel.arrays import fetch, index, kept, unwritten
from ..kernel.jit import outlined
from ..kernel.vector import cross, dot, square
from .contacts import (
    ContactSweep,
    apart,
    begin_solve,
    changed,
    closing,
    improved,
    is_due,
    lasting,
    pressed,
    scale_of,
    size_of,
    stir,
    weight_of,
    worse,
)
from .friction import arm_of, rubbed, turning
from .grain_arrays import (
    AFTER,
    BEFORE,
    COAST,
    COLUMNS,
    COLUMNS_OF_LANES,
    DAMPING,
    DRAG,
    EASE,
    EASES,
    ENDS,
    GAIN,
    GAP,
    GIVEN,
    IMPULSE,
    KEPT_ROLL,
    LANES,
    LEVER,
    LEVERS,
    LIGHTNESS,
    LISTED,
    NEARNESS,
    ONE,
    OTHER,
    PLACE,
    PUSH,
    RADIUS,
    ROLL,
    ROUNDNESS,
    SCALE,
    SIZE,
    START,
    OfPair,
    set_vector,
    set_vector_in,
    vector_at,
    vector_in,
    with_lanes,
)

# The balls of contacts so much later are asked for. A loop that asks is not one of vectors either: LLVM would make
# gathers of its loads, which take AMD processors longer.
_LATER = 32


def of_group(touches, g):
    """The rows of the contacts, the first one of a group, the rows of the balls, and the first one of the group."""
    tile = with_lanes(touches.tile)
    return tile.rows, index(g * COLUMNS_OF_LANES), tile.ends, index(g * ENDS)


def balls_of(ends, e, lane):
    """The balls of a contact of the group with these rows of balls."""
    fetch(ends, index(e * LANES) + lane + _LATER)
    return index(ends[e, lane]), index(ends[e + 1, lane])


def _fetch_next(rows, q, lane, columns):
    """Ask for the lane's part of so many columns of the next group: those of many balls are not in the second cache."""
    for k in range(-(-columns // LANES)):
        fetch(rows, (q + COLUMNS_OF_LANES + k * LANES + lane) * LANES)


def _fetch_ball(grains, i):
    """Ask for what a contact begins with of a ball."""
    for rows in (grains.place, grains.speed, grains.change):
        fetch(rows, i * rows.shape[1])
    if grains.spin is not None:
        fetch(grains.spin, i * grains.spin.shape[1])


def pair_at(touches, g, lane):
    """A contact of a group, and its balls."""
    rows, q, ends, e = of_group(touches, g)
    return OfPair(rows, q, lane), balls_of(ends, e, lane)


def move_in(matter, rows, q, lane, difference):
    """The change of s in a step by that of the velocities at its end."""
    return vector_in(rows, q + COAST, lane) + 0.5 * matter.h * difference


# --- At the start of a step ------------------------------------------------------------------------------

# Rows of what the contacts of a group begin with: v_i - v_j, of both ends of the step together, R_i + R_j, and the sum
# of the magnitudes of the velocities that are foreseen; then the impulse, and the twist.
_BOTH, _REACH, _SPEEDS, _ALL, _TURN, _READ = 0, 3, 4, 5, 8, 11


def _lay(touches, g, lane, c):
    """Give a contact that has been found a lane."""
    rows, q, ends, e = of_group(touches, g)
    ends[e, lane], ends[e + 1, lane] = touches.found[c, ONE], touches.found[c, OTHER]
    rows[q + LISTED, lane] = touches.found[c, PLACE]


@outlined
def _begin_group(matter, grains, near, touches, group):
    """Begin to solve for the contacts of a group from one lane to another, with their impulses as they are foreseen."""
    (g, begin, end), place, speed, spin, half = group, grains.place, grains.speed, grains.spin, 0.5 * matter.h
    read, (rows, q, ends, e) = unwritten((_READ, LANES), np.float64), of_group(touches, g)
    for k in range(begin, end):
        lane = index(k)
        i, j = balls_of(ends, e, lane)
        # Of the second ball in the next group, which has been laid; the first one is often that of this group.
        _fetch_ball(grains, index(ends[e + ENDS + 1, lane]))
        if near.drag is not None:
            fetch(near.drag, int(rows[q + COLUMNS_OF_LANES + LISTED, lane]) * near.drag.shape[1])
        v, u = vector_at(speed, i, BEFORE), vector_at(speed, j, BEFORE)
        set_vector_in(rows, q + START, lane, apart(matter, place, i, j))
        set_vector_in(rows, q + COAST, lane, v - u)
        v1, u1 = vector_at(speed, i, AFTER), vector_at(speed, j, AFTER)
        set_vector_in(read, _BOTH, lane, (v + v1) - (u + u1))
        read[_SPEEDS, lane] = size_of(v1) + size_of(u1)
        read[_REACH, lane] = place[i, RADIUS] + place[j, RADIUS]
        one, two = place[i, LIGHTNESS], place[j, LIGHTNESS]
        rows[q + EASES, lane], rows[q + EASES + 1, lane] = one, two
        if near.drag is not None:
            listed = index(int(rows[q + LISTED, lane]))
            if matter.pairs.friction is not None:
                rows[q + LEVERS, lane], rows[q + LEVERS + 1, lane] = one * spin[i, LEVER], two * spin[j, LEVER]
                set_vector_in(rows, q + DRAG, lane, vector_at(near.drag, listed, 0))
            if matter.pairs.rolling is not None:
                set_vector_in(rows, q + ROLL, lane, vector_at(near.drag, listed, KEPT_ROLL))
    for k in range(begin, end):
        lane = index(k)
        s0, move = vector_in(rows, q + START, lane), half * vector_in(read, _BOTH, lane)
        size = math.sqrt(s0.x * s0.x + s0.y * s0.y + s0.z * s0.z)
        gap, ease = read[_REACH, lane] - size, rows[q + EASES, lane] + rows[q + EASES + 1, lane]
        rows[q + SIZE, lane], rows[q + GAP, lane], rows[q + EASE, lane] = size, gap, ease
        set_vector_in(rows, q + COAST, lane, half * vector_in(rows, q + COAST, lane))
        damping = None
        if matter.pairs.damping is not None:
            damping = matter.pairs.damping / math.sqrt(ease) / matter.h
            rows[q + DAMPING, lane] = damping
        way = closing(s0, size, move)
        push, gain = begin_solve(pressed(matter, damping, gap, way.change), half * ease)
        rows[q + PUSH, lane], rows[q + GAIN, lane] = push, gain
        rows[q + SCALE, lane] = scale_of(matter, push, read[_SPEEDS, lane], ease)
        set_vector_in(rows, q + IMPULSE, lane, push * way.along)
        set_vector_in(read, _ALL, lane, push * way.along)
        if matter.pairs.friction is not None:
            rows[q + NEARNESS, lane] = 1.0 / read[_REACH, lane]
            drag = vector_in(rows, q + DRAG, lane) * lasting(gap)
            set_vector_in(rows, q + DRAG, lane, drag)
            set_vector_in(read, _ALL, lane, push * way.along + drag)
            set_vector_in(read, _TURN, lane, twist_in(rows, q, lane, move))
        if matter.pairs.rolling is not None:
            set_vector_in(rows, q + ROLL, lane, vector_in(rows, q + ROLL, lane) * lasting(gap))
    _give(matter, grains, touches, group, read)


def _give(matter, grains, touches, group, read):
    """Add what a group begins with to the sums of balls, from one lane to another."""
    g, begin, end = group
    rows, q, ends, e = of_group(touches, g)
    for k in range(begin, end):
        push_ends(grains.change, GIVEN, (rows, q, ends, e), index(k), vector_in(read, _ALL, index(k)))
        if matter.pairs.friction is not None:
            twist_ends(grains.spin, rows, q, ends, e, index(k), vector_in(read, _TURN, index(k)))


@outlined
def group_pairs(matter, grains, near, touches, known):
    """Put the contacts that have been found, after those which are known, into groups, and begin to solve for them."""
    count, found, marks = touches.used[0], touches.found, touches.marks
    if known == 0:
        groups, parts = (count + LANES - 1) // LANES, 0
        marks[:] = 0
        for g in range(groups):
            lanes, splits = (count - g + groups - 1) // groups, 0
            parts += 1
            for k in range(lanes):
                c = index(k * groups + g)
                i, j = index(found[c, ONE]), index(found[c, OTHER])
                if (marks[i] == parts) | (marks[j] == parts):
                    splits |= 1 << k
                    parts += 1
                marks[i], marks[j] = parts, parts
                _lay(touches, g, index(k), c)
            touches.lanes[index(g)], touches.splits[index(g)] = lanes, splits
        for g in range(groups):
            _begin_group(matter, grains, near, touches, (g, 0, touches.lanes[index(g)]))
        touches.used[1] = groups
    else:
        # Few, behind the others.
        for k in range(known, count):
            last = touches.used[1] - 1
            if touches.lanes[index(last)] == LANES:
                last += 1
                touches.lanes[index(last)], touches.splits[index(last)], touches.used[1] = 0, 0, last + 1
            lane = touches.lanes[index(last)]
            _lay(touches, last, index(lane), index(k))
            touches.lanes[index(last)] = lane + 1
            touches.splits[index(last)] |= 1 << lane
            _begin_group(matter, grains, near, touches, (last, lane, lane + 1))


# --- At its end ------------------------------------------------------------------------------------------


@outlined
def push_pairs(matter, grains, touches):
    """Sum the impulses of the pairs."""
    given = unwritten((3, LANES), np.float64)
    for g in range(touches.used[1]):
        rows, q, ends, e = of_group(touches, g)
        lanes = touches.lanes[index(g)]
        for k in range(lanes):
            lane = index(k)
            impulse = vector_in(rows, q + IMPULSE, lane)
            if matter.pairs.friction is not None:
                impulse = impulse + vector_in(rows, q + DRAG, lane)
            set_vector_in(given, 0, lane, impulse)
        for k in range(lanes):
            push_ends(grains.change, GIVEN, (rows, q, ends, e), index(k), vector_in(given, 0, index(k)))


def push_ends(target, column, tile, lane, impulse):
    """Change what both balls of a contact have in a column, velocities or sums, by an impulse on the first one."""
    rows, q, ends, e = tile
    i, j = balls_of(ends, e, lane)
    set_vector(target, i, column, vector_at(target, i, column) + impulse * rows[q + EASES, lane])
    set_vector(target, j, column, vector_at(target, j, column) - impulse * rows[q + EASES + 1, lane])


def twist_ends(spin, rows, q, ends, e, lane, twist):
    """Change the spins of both balls of a contact by a twist."""
    i, j = balls_of(ends, e, lane)
    set_vector(spin, i, AFTER, vector_at(spin, i, AFTER) - twist * rows[q + LEVERS, lane])
    set_vector(spin, j, AFTER, vector_at(spin, j, AFTER) - twist * rows[q + LEVERS + 1, lane])


@outlined
def twist_pairs(matter, grains, touches):
    """Add the twists of all pairs to the spins at the end of the step; the velocities there are final."""
    speed, spin, given = grains.speed, grains.spin, unwritten((3, LANES), np.float64)
    for g in range(touches.used[1]):
        rows, q, ends, e = of_group(touches, g)
        lanes = touches.lanes[index(g)]
        for k in range(lanes):
            i, j = balls_of(ends, e, index(k))
            set_vector_in(given, 0, index(k), vector_at(speed, i, AFTER) - vector_at(speed, j, AFTER))
        for k in range(lanes):
            lane = index(k)
            move = move_in(matter, rows, q, lane, vector_in(given, 0, lane))
            set_vector_in(given, 0, lane, twist_in(rows, q, lane, move))
        for k in range(lanes):
            twist_ends(spin, rows, q, ends, e, index(k), vector_in(given, 0, index(k)))


def twist_in(rows, q, lane, move):
    """s x J/R of a pair; its s changes by `move`: with all of J, so that no angular momentum is lost at all."""
    s = vector_in(rows, q + START, lane) + 0.5 * move
    impulse = vector_in(rows, q + IMPULSE, lane) + vector_in(rows, q + DRAG, lane)
    return cross(s * rows[q + NEARNESS, lane], impulse)


# --- Sweeps --------------------------------------------------------------------------------------------

# Rows of what a group begins with: v_i - v_j, and R_i w_i + R_j w_j; and of what it gives: the change of the impulse,
# the twist, the largest error of the sweep in each lane, and that of the contact.
_SLIP, _TURNING, _BEGUN = 0, 3, 6
_PART, _TWIST, _WORST, _OFF, _GIVEN = 0, 3, 6, 7, 8


def _press(matter, rows, q, lane, begun, share):
    """Improve the impulse of a contact of a group: its `Closing`, the change, and the error."""
    move = move_in(matter, rows, q, lane, vector_in(begun, _SLIP, lane))
    way = closing(vector_in(rows, q + START, lane), rows[q + SIZE, lane], move)
    damping = None if matter.pairs.damping is None else rows[q + DAMPING, lane]
    wanted, _slope = pressed(matter, damping, rows[q + GAP, lane], way.change)
    push = improved(rows[q + PUSH, lane], wanted, rows[q + GAIN, lane])
    old = vector_in(rows, q + IMPULSE, lane)
    more, part = changed(old, push * way.along, share)
    rows[q + PUSH, lane] = push
    set_vector_in(rows, q + IMPULSE, lane, old + part)
    return way, part, weight_of(matter.pairs) * (size_of(more) * rows[q + SCALE, lane])


def _rub(matter, rows, q, lane, begun, given, share):
    """Improve the impulse and the friction of a contact of a group."""
    way, part, off = _press(matter, rows, q, lane, begun, share)
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
    off = worse(size_of(more) * rows[q + SCALE, lane], off)
    given[_OFF, lane], given[_WORST, lane] = off, worse(off, kept(given[_WORST, lane]))


def _read(grains, ends, e, lane, begun):
    """Read what the improvement of a contact begins with; its balls."""
    i, j = balls_of(ends, e, lane)
    set_vector_in(begun, _SLIP, lane, vector_at(grains.speed, i, AFTER) - vector_at(grains.speed, j, AFTER))
    return i, j


def _sweep_group(matter, grains, touches, group, arrays, sweep):
    """Improve the impulses of a group from one lane to another."""
    (g, begin, end), (begun, given) = group, arrays
    rows, q, ends, e = of_group(touches, g)
    for k in range(begin, end):
        _read(grains, ends, e, index(k), begun)
        _fetch_next(rows, q, index(k), COLUMNS)
    for k in range(begin, end):
        _way, part, off = _press(matter, rows, q, index(k), begun, sweep.share)
        set_vector_in(given, _PART, index(k), part)
        given[_WORST, index(k)] = worse(off, kept(given[_WORST, index(k)]))
    for k in range(begin, end):
        push_ends(grains.speed, AFTER, (rows, q, ends, e), index(k), vector_in(given, _PART, index(k)))


def _rub_group(matter, grains, touches, group, arrays, sweep):
    """Improve the impulses of a group with those of friction, as `_sweep_group`."""
    (g, begin, end), (begun, given) = group, arrays
    rows, q, ends, e = of_group(touches, g)
    for k in range(begin, end):
        i, j = _read(grains, ends, e, index(k), begun)
        _fetch_next(rows, q, index(k), COLUMNS_OF_LANES)
        set_vector_in(begun, _TURNING, index(k), turning(grains, i, j, AFTER))
    unsolved = False
    for k in range(begin, end):
        _rub(matter, rows, q, index(k), begun, given, sweep.share)
        unsolved |= not given[_OFF, index(k)] <= sweep.solved
    for k in range(begin, end):
        push_ends(grains.speed, AFTER, (rows, q, ends, e), index(k), vector_in(given, _PART, index(k)))
        twist_ends(grains.spin, rows, q, ends, e, index(k), vector_in(given, _TWIST, index(k)))
    if unsolved:
        for k in range(begin, end):
            i, j = balls_of(ends, e, index(k))
            stir(sweep, touches.stirred, i, given[_OFF, index(k)])
            stir(sweep, touches.stirred, j, given[_OFF, index(k)])


# --- Sweeps over all groups -----------------------------------------------------------------------------


_ALL_LANES = -1


def _all_lanes(touches, g, sweep):
    return _ALL_LANES


def _due_lanes(touches, g, sweep):
    """The lanes of a group with contacts that a sweep goes over, as bits."""
    if sweep.number == 0:
        return _ALL_LANES
    _rows, _q, ends, e = of_group(touches, g)
    stirred, due = touches.stirred, 0
    for k in range(touches.lanes[index(g)]):
        i, j = balls_of(ends, e, index(k))
        due |= (is_due(sweep, stirred, i) | is_due(sweep, stirred, j)) << k
    return due


def _over_groups(one, lanes_of, matter, grains, touches, sweep):
    begun, given = unwritten((_BEGUN, LANES), np.float64), unwritten((_GIVEN, LANES), np.float64)
    for lane in range(LANES):
        given[_WORST, index(lane)] = 0.0
    for g in range(touches.used[1]):
        lanes, splits, begin = touches.lanes[index(g)], touches.splits[index(g)], 0
        due = lanes_of(touches, g, sweep)
        while begin < lanes:
            end = begin + 1
            if (due >> begin) & 1 == 1:
                while end < lanes and (splits >> end) & 1 == 0 and (due >> end) & 1 == 1:
                    end += 1
                one(matter, grains, touches, (g, begin, end), (begun, given), sweep)
            begin = end
    worst = 0.0
    for lane in range(LANES):
        worst = worse(given[_WORST, index(lane)], worst)
    return worst


@outlined
def sweep_pairs(matter, grains, touches, share):
    """Improve the impulse of each pair; the largest change of one, relative to what moves there."""
    return _over_groups(_sweep_group, _all_lanes, matter, grains, touches, ContactSweep(0, share, 0.0))


@outlined
def rub_pairs(matter, grains, touches, sweep):
    """Improve the impulse and the friction of each pair that is due; the largest change, relative to what moves."""
    return _over_groups(_rub_group, _due_lanes, matter, grains, touches, sweep)

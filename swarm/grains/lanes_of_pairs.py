"""The contacts of pairs in groups, one contact a lane; one after the other they take three times as long.

Contacts are cut into slices, a slice into as many parts as a group has lanes, and a group has one contact of each part.
So its balls are far from one another, while their rows are in the second cache. The numbers of a group are stored by
columns, from which LLVM makes vectors. A group is computed in three loops over its lanes: one reads from balls, one
computes without a branch, and one writes to balls, which may be the same. Sweeps go over all groups. A group in which
two contacts share a ball is done in parts, so that each contact begins with the result of the contacts before it.
"""

import math

import numpy as np

from ..kernel.arrays import fetch, index, kept, unwritten
from ..kernel.jit import is_known, outlined, select
from ..kernel.lines import FOUR, LANES, add_from_lanes, into_lanes
from ..kernel.vector import Vec, column, cross, dot, put, square, vector_at
from . import grain_arrays as col
from .cell import nearest
from .contacts import (
    ContactSweep,
    begin_solve,
    changed,
    closing,
    improved,
    is_due,
    lasting,
    pressed,
    scale_of,
    size_of,
    weight_of,
    worse,
)
from .friction import arm_of, rubbed
from .grain_arrays import ROUNDNESS, OfPair, with_lanes


def of_group(touches, g):
    """The rows of the contacts and the first row of a group, the rows of the balls and the first row of the group."""
    tile = with_lanes(touches.tile)
    return tile.rows, index(g * col.COLUMNS), tile.ends, index(g * col.ENDS)


def balls_of(ends, e, lane):
    """The balls of a contact in a lane; the rows of the balls of its group begin at e."""
    return index(ends[e, lane]), index(ends[e + 1, lane])


def _fetch_next(rows, q, columns):
    """Fetch `columns` columns of the next group: the groups of many balls are not in the second cache."""
    for k in range(columns):
        fetch(rows, (q + col.COLUMNS + k) * LANES)


def _fetch_ball(grains, i):
    """Fetch the rows of a ball with which a contact begins."""
    for rows in (grains.place, grains.speed, grains.change):
        fetch(rows, i * rows.shape[1])
    if grains.spin is not None:
        fetch(grains.spin, i * grains.spin.shape[1])


def read_lines(table, ends, e, tile, k):
    """Read all columns of both balls of each contact of a group, the columns of the second ball last."""
    for n in (0, 1):
        first = k + n * col.COLUMNS_OF_BALLS
        into_lanes(tile, first, table, 0, ends, e + n)
        into_lanes(tile, first + FOUR, table, FOUR, ends, e + n)


def read_ends(table, ends, e, tile, k):
    """Read the four columns of the end of the step of both balls of each contact of a group."""
    into_lanes(tile, k, table, col.AFTER, ends, e)
    into_lanes(tile, k + FOUR, table, col.AFTER, ends, e + 1)


def slip_in(tile, k, lane):
    """v_i - v_j, from `read_ends`."""
    return column(tile, k, lane) - column(tile, k + FOUR, lane)


def turning_in(tile, one, other, k, lane):
    """R_i w_i + R_j w_j; `one` and `other` are the rows of a tile in which the columns of both balls begin."""
    turned = column(tile, one + k, lane) * tile[one + col.ARM, lane]
    return turned + column(tile, other + k, lane) * tile[other + col.ARM, lane]


def pair_at(touches, g, lane):
    """Return a contact of a group, and its balls."""
    rows, q, ends, e = of_group(touches, g)
    return OfPair(rows, q, ends, e, lane), balls_of(ends, e, lane)


def move_in(matter, rows, q, lane, difference):
    """The change of s in a step, from the difference of the velocities at its end."""
    return column(rows, q + col.COAST, lane) + 0.5 * matter.h * difference


# --- At the start of a step ------------------------------------------------------------------------------

# Rows that the contacts of a group read at the start: `place`, `speed` and the last columns of `spin` of both balls.
# The rows that they write, as `_give` does, follow: velocities by the impulses, and spins by the twists.
_PLACE, _SPEED, _TURNS = 0, 16, 32
_IMPULSES, _TWISTS, _READ = 40, 48, 56


# The most groups of a slice: their rows, and those of their balls, fit into a second cache of 1 MB. With one slice for
# all, a step takes 1.02 to 1.1 times as long while 10 000 grains lie, on a busy machine, and as long while they fall.
_SLICE = 288


def _lay(touches, g, lane, c):
    """Put a contact that has been found into a lane."""
    # The columns of the contact are written later: they are not in the cache yet.
    _rows, _q, ends, e = of_group(touches, g)
    for k in (col.ONE, col.OTHER, col.PLACE):
        ends[e + k, lane] = touches.found[c, k]


@outlined
def _begin_group(matter, grains, near, touches, group):
    """Begin to solve for the contacts of a group from one lane to another, with the impulses foreseen.

    In a whole group, lanes without a contact are computed too.
    """
    (g, begin, end, is_whole), spin = group, grains.spin
    lanes = lanes_between(begin, end)
    read, (rows, q, ends, e) = unwritten((_READ, LANES), np.float64), of_group(touches, g)
    for k in range(begin, end):
        # The second ball of the contact in the next group, which has been laid; its first ball is often in this group.
        _fetch_ball(grains, index(ends[e + col.ENDS + 1, index(k)]))
        if near.drag is not None:
            fetch(near.drag, ends[e + col.ENDS + col.PLACE, index(k)] * near.drag.shape[1])
    read_lines(grains.place, ends, e, read, _PLACE)
    read_lines(grains.speed, ends, e, read, _SPEED)
    if matter.pairs.friction is not None:
        into_lanes(read, _TURNS, spin, FOUR, ends, e)
        into_lanes(read, _TURNS + FOUR, spin, FOUR, ends, e + 1)
    if near.drag is not None:
        for k in range(begin, end):
            lane, listed = index(k), index(ends[e + col.PLACE, index(k)])
            if matter.pairs.friction is not None:
                put(rows, q + col.DRAG, lane, vector_at(near.drag, listed, 0))
            if matter.pairs.rolling is not None:
                put(rows, q + col.ROLL, lane, vector_at(near.drag, listed, col.KEPT_ROLL))
    for k in over_lanes(lanes) if is_whole else range(begin, end):
        _begin_contact(matter, rows, q, index(k), read)
    add_from_lanes(grains.change, col.GIVEN, ends, e, read, _IMPULSES, lanes)
    if matter.pairs.friction is not None:
        add_from_lanes(spin, col.AFTER, ends, e, read, _TWISTS, lanes)


def _begin_contact(matter, rows, q, lane, read):
    """Begin to solve for a contact of a group."""
    half, one, other = 0.5 * matter.h, _PLACE, _PLACE + col.COLUMNS_OF_BALLS
    s0 = nearest(matter.period, column(read, one + col.X, lane), column(read, other + col.X, lane))
    s0 = s0 + (column(read, one + col.LOST, lane) - column(read, other + col.LOST, lane))
    reach = read[one + col.RADIUS, lane] + read[other + col.RADIUS, lane]
    eases = read[one + col.LIGHTNESS, lane], read[other + col.LIGHTNESS, lane]
    one, other = _SPEED, _SPEED + col.COLUMNS_OF_BALLS
    v, u = column(read, one + col.BEFORE, lane), column(read, other + col.BEFORE, lane)
    v1, u1 = column(read, one + col.AFTER, lane), column(read, other + col.AFTER, lane)
    move = half * ((v + v1) - (u + u1))
    size = math.sqrt(s0.x * s0.x + s0.y * s0.y + s0.z * s0.z)
    gap, ease = reach - size, eases[0] + eases[1]
    put(rows, q + col.START, lane, s0)
    rows[q + col.SIZE, lane], rows[q + col.GAP, lane], rows[q + col.EASE, lane] = size, gap, ease
    rows[q + col.EASES, lane], rows[q + col.EASES + 1, lane] = eases
    put(rows, q + col.COAST, lane, half * (v - u))
    damping = None
    if matter.pairs.damping is not None:
        damping = matter.pairs.damping / math.sqrt(ease) / matter.h
        rows[q + col.DAMPING, lane] = damping
    way = closing(s0, size, move)
    push, gain = begin_solve(pressed(matter, damping, gap, way.change), half * ease)
    rows[q + col.PUSH, lane], rows[q + col.GAIN, lane] = push, gain
    rows[q + col.SCALE, lane] = scale_of(matter, push, (size_of(v1 - u1), size_of(v1) + size_of(u1)), ease)
    impulse = push * way.along
    put(rows, q + col.IMPULSE, lane, impulse)
    if matter.pairs.friction is not None:
        rows[q + col.LEVERS, lane] = eases[0] * read[_TURNS + col.LEVER - FOUR, lane]
        rows[q + col.LEVERS + 1, lane] = eases[1] * read[_TURNS + col.LEVER, lane]
        rows[q + col.NEARNESS, lane] = 1.0 / reach
        drag = column(rows, q + col.DRAG, lane) * lasting(gap)
        put(rows, q + col.DRAG, lane, drag)
        impulse = impulse + drag
        give_twist(rows, q, lane, read, _TWISTS, twist_in(rows, q, lane, move))
    if matter.pairs.rolling is not None:
        put(rows, q + col.ROLL, lane, column(rows, q + col.ROLL, lane) * lasting(gap))
    give_impulse(rows, q, lane, read, _IMPULSES, impulse)


@outlined
def group_pairs(matter, grains, near, touches, known):
    """Put the contacts that have been found, from number `known` on, into groups, and begin to solve for them."""
    count, found, marks = touches.used[0], touches.found, touches.marks
    if known == 0:
        groups, parts = (count + LANES - 1) // LANES, 0
        slices = groups // _SLICE + 1
        marks[:] = 0
        for n in range(slices):
            first, end = n * groups // slices, (n + 1) * groups // slices
            part, held = end - first, min(end * LANES, count) - first * LANES
            for g in range(first, end):
                lanes, splits = (held - (g - first) + part - 1) // part, 0
                parts += 1
                for k in range(lanes):
                    c = index(first * LANES + k * part + (g - first))
                    i, j = index(found[c, col.ONE]), index(found[c, col.OTHER])
                    if (marks[i] == parts) | (marks[j] == parts):
                        splits |= 1 << k
                        parts += 1
                    marks[i], marks[j] = parts, parts
                    _lay(touches, g, index(k), c)
                touches.lanes[index(g)], touches.splits[index(g)] = lanes, splits
        for g in range(groups):
            end = touches.lanes[index(g)]
            _begin_group(matter, grains, near, touches, (g, 0, end, True))
        touches.used[1] = groups
    else:
        # New contacts are few, and go behind the others.
        for k in range(known, count):
            last = touches.used[1] - 1
            if touches.lanes[index(last)] == LANES:
                last += 1
                touches.lanes[index(last)], touches.splits[index(last)], touches.used[1] = 0, 0, last + 1
            lane = touches.lanes[index(last)]
            _lay(touches, last, index(lane), index(k))
            touches.lanes[index(last)] = lane + 1
            touches.splits[index(last)] |= 1 << lane
            _begin_group(matter, grains, near, touches, (last, lane, lane + 1, False))


# --- At the end of a step --------------------------------------------------------------------------------


def lanes_between(begin, end):
    """The lanes from `begin` to the one before `end`, as bits."""
    return (1 << end) - (1 << begin)


# The lanes of each pattern of bits.
_SOME_LANES = tuple(tuple(k for k in range(LANES) if (lanes >> k) & 1 == 1) for lanes in range(2**LANES))


def over_lanes(lanes):
    """The range of a loop over some lanes, as bits: in a kernel all lanes, so that the loop has whole vectors."""
    return _SOME_LANES[lanes] if is_known(lanes) else range(LANES)


def is_in(lanes, k):
    """Whether a lane is among some lanes, as bits."""
    return (lanes >> k) & 1 == 1


def _give(given, k, lane, to_first, to_second):
    """Write the changes of both balls of a contact into eight rows, of which the fourth and the eighth are 0."""
    put(given, k, lane, to_first)
    put(given, k + FOUR, lane, to_second)
    given[k + FOUR - 1, lane], given[k + 2 * FOUR - 1, lane] = 0.0, 0.0


def give_impulse(rows, q, lane, given, k, impulse):
    """Write the changes of both velocities by an impulse on the first ball of a contact."""
    to_second = impulse * rows[q + col.EASES + 1, lane]
    _give(given, k, lane, impulse * rows[q + col.EASES, lane], -1.0 * to_second)


def give_twist(rows, q, lane, given, k, twist):
    """Write the changes of both spins of a contact by a twist."""
    _give(given, k, lane, -1.0 * (twist * rows[q + col.LEVERS, lane]), -1.0 * (twist * rows[q + col.LEVERS + 1, lane]))


@outlined
def push_pairs(matter, grains, touches):
    """Add the impulses of all pairs to the sums of their balls."""
    given = unwritten((2 * FOUR, LANES), np.float64)
    for g in range(touches.used[1]):
        rows, q, ends, e = of_group(touches, g)
        lanes = touches.lanes[index(g)]
        for k in over_lanes(lanes_between(0, lanes)):
            impulse = column(rows, q + col.IMPULSE, index(k))
            if matter.pairs.friction is not None:
                impulse = impulse + column(rows, q + col.DRAG, index(k))
            give_impulse(rows, q, index(k), given, 0, impulse)
        add_from_lanes(grains.change, col.GIVEN, ends, e, given, 0, lanes_between(0, lanes))


@outlined
def twist_pairs(matter, grains, touches):
    """Add the twists of all pairs to the spins at the end of the step; the velocities there are final."""
    begun, given = unwritten((_BEGUN, LANES), np.float64), unwritten((2 * FOUR, LANES), np.float64)
    for g in range(touches.used[1]):
        rows, q, ends, e = of_group(touches, g)
        lanes = touches.lanes[index(g)]
        read_ends(grains.speed, ends, e, begun, _SLIP)
        for k in over_lanes(lanes_between(0, lanes)):
            move = move_in(matter, rows, q, index(k), slip_in(begun, _SLIP, index(k)))
            give_twist(rows, q, index(k), given, 0, twist_in(rows, q, index(k), move))
        add_from_lanes(grains.spin, col.AFTER, ends, e, given, 0, lanes_between(0, lanes))


def twist_in(rows, q, lane, move):
    """s x J/R of a pair, where s changes by `move`; J has both impulses, so that no angular momentum is lost."""
    s = column(rows, q + col.START, lane) + 0.5 * move
    impulse = column(rows, q + col.IMPULSE, lane) + column(rows, q + col.DRAG, lane)
    return cross(s * rows[q + col.NEARNESS, lane], impulse)


# --- Sweeps --------------------------------------------------------------------------------------------

# Rows that a group reads: the velocities of both balls, and their spins with the radii. Rows that it writes, the first
# two as `_give` does: the velocities by the change of the impulse, the spins by the twist, the largest error of the
# sweep in each lane, the largest error of normal impulses alone, and the error of the contact.
_SLIP, _TURNING, _BEGUN = 0, 8, 16
_PART, _TWIST, _WORST, _PRESSED, _OFF, _GIVEN = 0, 8, 16, 17, 18, 19


def _press(matter, rows, q, lane, is_due, begun, share):
    """Improve the impulse of a contact of a group if it is due; return its `Closing`, its size, change and error."""
    move = move_in(matter, rows, q, lane, slip_in(begun, _SLIP, lane))
    way = closing(column(rows, q + col.START, lane), rows[q + col.SIZE, lane], move)
    damping = None if matter.pairs.damping is None else rows[q + col.DAMPING, lane]
    wanted, _slope = pressed(matter, damping, rows[q + col.GAP, lane], way.change)
    push = improved(rows[q + col.PUSH, lane], wanted, rows[q + col.GAIN, lane])
    old = column(rows, q + col.IMPULSE, lane)
    more, part = changed(old, push * way.along, share)
    rows[q + col.PUSH, lane] = select(is_due, push, kept(rows[q + col.PUSH, lane]))
    put(rows, q + col.IMPULSE, lane, old + _if(is_due, part))
    return way, push, part, weight_of(matter.pairs) * (size_of(more) * rows[q + col.SCALE, lane])


def _if(is_due, change):
    """A change if it is due, else -0.0, which changes no number that it is added to."""
    return Vec(select(is_due, change.x, -0.0), select(is_due, change.y, -0.0), select(is_due, change.z, -0.0))


def _rub(matter, rows, q, lane, is_due, begun, given, sweep):
    """Improve impulse and friction of a contact if it is due; return the larger error, and that of the impulse."""
    way, push, part, off = _press(matter, rows, q, lane, is_due, begun, sweep.share)
    ease, over = rows[q + col.EASE, lane], 1.0 / square(way.along)
    arm = arm_of(way, rows[q + col.SIZE, lane], way.change, rows[q + col.NEARNESS, lane])
    turning = turning_in(begun, _TURNING - col.AFTER, _TURNING + FOUR - col.AFTER, col.AFTER, lane)
    slip = slip_in(begun, _SLIP, lane) + ease * part - cross(turning, arm)
    slip = slip - (dot(slip, way.along) * over) * way.along
    old = column(rows, q + col.DRAG, lane)
    before = old - (dot(old, way.along) * over) * way.along
    new = rubbed(before, slip, sweep.inverse * (ease * (1.0 + ROUNDNESS * square(arm))), matter.pairs.friction * push)
    more, rub = changed(old, new, sweep.share)
    put(rows, q + col.DRAG, lane, old + _if(is_due, rub))
    give_impulse(rows, q, lane, given, _PART, part + rub)
    give_twist(rows, q, lane, given, _TWIST, cross(arm, rub))
    return worse(size_of(more) * rows[q + col.SCALE, lane], off), off


def _note_worst(given, k, lane, is_due, off):
    """Keep the error of a contact in its lane if it is due and the largest."""
    before = kept(given[k, lane])
    given[k, lane] = select(is_due, worse(off, before), before)


def _sweep_group(matter, grains, touches, group, arrays, sweep):
    """Improve the impulses in some lanes of a group, as bits."""
    (g, lanes), (begun, given) = group, arrays
    rows, q, ends, e = of_group(touches, g)
    read_ends(grains.speed, ends, e, begun, _SLIP)
    _fetch_next(rows, q, col.COLUMNS_SWEPT)
    for k in over_lanes(lanes):
        lane, is_due = index(k), is_in(lanes, k)
        _way, _push, part, off = _press(matter, rows, q, lane, is_due, begun, sweep.share)
        give_impulse(rows, q, lane, given, _PART, part)
        _note_worst(given, _WORST, lane, is_due, off)
    add_from_lanes(grains.speed, col.AFTER, ends, e, given, _PART, lanes)


def _rub_group(matter, grains, touches, group, arrays, sweep):
    """Improve impulses and friction in some lanes of a group, as bits."""
    (g, lanes), (begun, given) = group, arrays
    rows, q, ends, e = of_group(touches, g)
    read_ends(grains.speed, ends, e, begun, _SLIP)
    read_ends(grains.spin, ends, e, begun, _TURNING)
    _fetch_next(rows, q, col.COLUMNS_RUBBED)
    unsolved = 0
    for k in over_lanes(lanes):
        lane, is_due = index(k), is_in(lanes, k)
        off, pressed_off = _rub(matter, rows, q, lane, is_due, begun, given, sweep)
        given[_OFF, lane] = off
        _note_worst(given, _WORST, lane, is_due, off)
        _note_worst(given, _PRESSED, lane, is_due, pressed_off)
        unsolved |= select(off <= sweep.solved, 0, 1) << k
    add_from_lanes(grains.speed, col.AFTER, ends, e, given, _PART, lanes)
    add_from_lanes(grains.spin, col.AFTER, ends, e, given, _TWIST, lanes)
    unsolved &= lanes
    if unsolved != 0:
        for k in range(LANES):
            if is_in(unsolved, k):
                i, j = balls_of(ends, e, index(k))
                touches.stirred[i], touches.stirred[j] = sweep.number, sweep.number


# --- Sweeps over all groups -----------------------------------------------------------------------------


_ALL_LANES = 2**LANES - 1


def _all_lanes(touches, g, sweep):
    return _ALL_LANES


def _due_lanes(touches, g, sweep):
    """The lanes of a group with contacts that are due in a sweep, as bits."""
    if sweep.number == 0:
        return _ALL_LANES
    _rows, _q, ends, e = of_group(touches, g)
    stirred, due = touches.stirred, 0
    for k in range(LANES):
        i, j = balls_of(ends, e, index(k))
        due |= select(is_due(sweep, stirred, i) | is_due(sweep, stirred, j), 1, 0) << k
    return due


def _part_from(begin, lanes, splits):
    """The end of the part of a group that begins in a lane."""
    end = lanes
    if splits >> (begin + 1) != 0:
        end = begin + 1
        while end < lanes and (splits >> end) & 1 == 0:
            end += 1
    return end


def _over_groups(one, lanes_of, matter, grains, touches, sweep):
    begun, given = unwritten((_BEGUN, LANES), np.float64), unwritten((_GIVEN, LANES), np.float64)
    for lane in range(LANES):
        given[_WORST, index(lane)], given[_PRESSED, index(lane)] = 0.0, 0.0
    for g in range(touches.used[1]):
        lanes, splits, begin = touches.lanes[index(g)], touches.splits[index(g)], 0
        due = lanes_of(touches, g, sweep)
        while begin < lanes:
            end = _part_from(begin, lanes, splits)
            some = lanes_between(begin, end) & due
            if some != 0:
                one(matter, grains, touches, (g, some), (begun, given), sweep)
            begin = end
    worst, pressed_worst = 0.0, 0.0
    for lane in range(LANES):
        worst = worse(given[_WORST, index(lane)], worst)
        pressed_worst = worse(given[_PRESSED, index(lane)], pressed_worst)
    return worst, pressed_worst


@outlined
def sweep_pairs(matter, grains, touches, share):
    """Improve the impulse of each pair; return the largest relative change."""
    worst, _pressed = _over_groups(_sweep_group, _all_lanes, matter, grains, touches, ContactSweep(0, share, 0.0, 1.0))
    return worst


@outlined
def rub_pairs(matter, grains, touches, sweep):
    """Improve the impulse and the friction of each pair that is due.

    Return the largest relative change, and the largest one of normal impulses.
    """
    return _over_groups(_rub_group, _due_lanes, matter, grains, touches, sweep)

"""Sums over contacts: impulses on walls and their work, the virial, dissipated energy, and collisions."""

from typing import Any, NamedTuple

import numpy as np

from ..contact.wall_impact import give_work
from ..kernel.arrays import index, unwritten
from ..kernel.jit import Array, outlined
from ..kernel.lines import LANES
from ..kernel.vector import column, dot, norm, set_vector, vector_at
from . import grain_arrays as col
from .at_walls import step_at_wall
from .contacts import closing, worse
from .heavy_walls import is_heavy
from .lanes_of_pairs import (
    balls_of,
    lanes_between,
    move_in,
    of_group,
    over_lanes,
    read_ends,
    read_lines,
    slip_in,
    turning_in,
    twist_in,
)
from .vessel import gives_work, met_member


class ContactTotals(NamedTuple):
    """The sums since the start, of each particle by its number, and of all together."""

    collisions: Array  # (N,) int64
    impacts: Array  # (N,) int64
    impulse: Array  # (walls, N) [N s], then (walls, N) the work of moving walls [J]
    dissipated: Array  # (N,) [J]
    virial: Array  # (1,) [J s]
    sweeps: Array  # (1,) int64
    lagging: Array  # (1,) int64, steps in which friction, or a damper, was not solved to its tolerance
    overlap: Array  # (1,) the largest overlap since the frame before [m]
    failed: Array  # (4,) the failure of a refused step, see overlaps.py
    escape_time: Any = None  # (N,) [s], of a scene with openings
    # If walls send balls off:
    heat: Any = None  # (walls, N) [J]
    ended: Any = None  # (N,) int64, ended contacts with walls, the counter of the random numbers
    absorbed_time: Any = None  # (N,) [s], with the number of the wall, where a law absorbs balls
    absorbed_wall: Any = None


def _lost(matter, work, gap, change):
    """The energy that the damper of a contact takes [J]; `work` is the work of its impulse times the step."""
    # The impulse counts as it is, not the law of the damper, so that no energy is missing if the step is solved badly.
    force, _slope = matter.law.energy_slope(gap, gap + change)
    return -work / matter.h - force * change


# Rows that are read of the balls of a group: velocities at the end of the step, and all columns of spins.
_SLIP, _SPINS, _READ = 0, 8, 24
# Rows that are booked of a contact: its part of the virial, the gap at the end, and the energy lost.
_VIRIAL, _END, _LOST, _BOOKED = 0, 1, 2, 3


def _weigh(matter, rows, q, lane, read, booked, notes):
    """Compute the numbers that are booked of a contact."""
    s0, impulse = column(rows, q + col.START, lane), column(rows, q + col.IMPULSE, lane)
    move = move_in(matter, rows, q, lane, slip_in(read, _SLIP, lane))
    gap, way, lost = rows[q + col.GAP, lane], closing(s0, rows[q + col.SIZE, lane], move), 0.0
    booked[_VIRIAL, lane], booked[_END, lane] = dot(s0 + 0.5 * move, impulse), gap + way.change
    if matter.pairs.damping is not None:
        lost = _lost(matter, dot(impulse, move), gap, way.change)
    if matter.pairs.friction is not None:
        gained = dot(column(rows, q + col.DRAG, lane), move) / matter.h
        lines = _SPINS, _SPINS + col.COLUMNS_OF_BALLS
        turned = turning_in(read, *lines, col.BEFORE, lane) + turning_in(read, *lines, col.AFTER, lane)
        gained = gained - 0.5 * dot(twist_in(rows, q, lane, move), turned)
        if notes:
            rows[q + col.RUBBED, lane] = -gained
        lost = lost - gained
    booked[_LOST, lane] = 0.5 * lost


def _enter(matter, books, rows, q, lane, numbers, booked):
    """Book a contact of the particles with these numbers."""
    one, other = numbers
    if (rows[q + col.GAP, lane] <= 0.0) & (booked[_END, lane] > 0.0):
        books.collisions[one] += 1
        books.collisions[other] += 1
    if matter.pairs.damping is not None or matter.pairs.friction is not None:
        books.dissipated[one] += booked[_LOST, lane]
        books.dissipated[other] += booked[_LOST, lane]


@outlined
def book_pairs(matter, grains, near, touches, books, notes):
    """Book the contacts of pairs, and keep their friction for the next step; return the largest overlap [m].

    `notes` says whether the energy that friction takes from each contact is needed.
    """
    number, deepest, virial = grains.number, 0.0, 0.0
    read, booked = unwritten((_READ, LANES), np.float64), unwritten((_BOOKED, LANES), np.float64)
    for g in range(touches.used[1]):
        rows, q, ends, e = of_group(touches, g)
        lanes = touches.lanes[index(g)]
        read_ends(grains.speed, ends, e, read, _SLIP)
        if matter.pairs.friction is not None:
            read_lines(grains.spin, ends, e, read, _SPINS)
        for k in over_lanes(lanes_between(0, lanes)):
            _weigh(matter, rows, q, index(k), read, booked, notes)
        for k in range(lanes):
            lane = index(k)
            i, j = balls_of(ends, e, lane)
            virial += booked[_VIRIAL, lane]
            deepest = worse(booked[_END, lane], worse(rows[q + col.GAP, lane], deepest))
            _enter(matter, books, rows, q, lane, (index(number[i]), index(number[j])), booked)
            if matter.pairs.friction is not None:
                listed = index(ends[e + col.PLACE, lane])
                set_vector(near.drag, listed, 0, column(rows, q + col.DRAG, lane))
    books.virial[0] += virial
    return deepest


@outlined
def book_wall(matter, law, wall, grains, touches, books, number):
    """Book the contacts with a wall; return the largest overlap [m]."""
    rows, begin, deepest = touches.wall_rows, touches.wall_spans[0, number], 0.0
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        one, gap, push = index(grains.number[i]), rows[c, col.GAP], rows[c, col.PUSH]
        own, move, way = step_at_wall(matter, wall, grains, touches, c, i)
        deepest = max(deepest, max(gap, gap + way.change))
        books.impacts[one] += (gap <= 0.0) & (gap + way.change > 0.0)
        impulse = vector_at(rows, c, col.IMPULSE)
        books.impulse[index(number), one] += norm(impulse)
        work = dot(impulse, move)
        if gives_work(wall):
            # The work of the wall is the energy that the ball gains and the contact stores or loses.
            given = work + push * way.change
            give_work(books, index(number), one, given / matter.h)
            work = work - given
        elif is_heavy(wall):
            work = work - dot(impulse, own.displacement())
        if law.damping is not None:
            books.dissipated[one] += _lost(matter, work, gap, way.change)
    return deepest


@outlined
def count_members(matter, wall, world, number):
    """Count the contacts with a wall that begin in the step, by its members."""
    grains, touches, begin = world.grains, world.touches, world.touches.wall_spans[0, number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i, gap = index(touches.wall_ends[c]), touches.wall_rows[c, col.GAP]
        _own, move, way = step_at_wall(matter, wall, grains, touches, c, i)
        if gap <= 0.0 and gap + way.change > 0.0:
            r = vector_at(touches.wall_rows, c, col.START) + move
            m = met_member(wall, touches.listed, touches.spans, c, grains.place[i, col.RADIUS], r)
            world.counts.add(world.places[number][index(m)], 1)

"""Sums over the contacts of a step: impulses on walls and their works, the virial, dissipated energy, and meetings."""

from typing import Any, NamedTuple

from ..kernel.arrays import index
from ..kernel.jit import Array, outlined
from ..kernel.vector import dot, norm
from .at_walls import rising
from .contacts import closing
from .grain_arrays import AFTER, COAST, GAP, IMPULSE, PUSH, RADIUS, SIZE, START, vector_at
from .vessel import met, met_member, moves


class ContactTotals(NamedTuple):
    """The sums since the start, by the numbers of particles, and those of all."""

    collisions: Array  # (N,) int64
    impacts: Array  # (N,) int64
    impulse: Array  # (walls, N) [N s], then (walls, N) the work of walls that move [J]
    dissipated: Array  # (N,) [J]
    virial: Array  # (1,) [J s]
    sweeps: Array  # (1,) int64
    lagging: Array  # (1,) int64, steps in which friction, or a damper, was not solved to its tolerance
    overlap: Array  # (1,) the largest overlap since the frame before [m]
    failed: Array  # (4,) what a step was refused for, see overlaps.py
    escape_time: Any = None  # (N,) [s], of a scene with openings
    # Where walls send balls off:
    heat: Any = None  # (walls, N) [J]
    ended: Any = None  # (N,) int64, contacts with walls that have ended, as random numbers count them
    absorbed_time: Any = None  # (N,) [s], and the number of the wall, where a law absorbs balls
    absorbed_wall: Any = None


class MemberCounts(NamedTuple):
    """Where contacts with walls are counted as they begin, by members."""

    counts: Any  # `Counts`
    places: Any  # of each wall, of each member its wall in these counts, (members,) int64


def _lost(matter, work, gap, change):
    """The energy that the damper of a contact takes [J], by the work of its impulse times the step."""
    # By what it did, not by what it was to do: so nothing is missing, however well the step is solved.
    force, _slope = matter.law.energy_slope(gap, gap + change)
    return -work / matter.h - force * change


@outlined
def book_pairs(matter, grains, touches, books):
    """Book the contacts of pairs; their largest overlap [m]."""
    rows, speed, half, deepest = touches.rows, grains.speed, 0.5 * matter.h, 0.0
    for k in range(touches.used[0]):
        c = index(k)
        i, j = index(touches.ends[c, 0]), index(touches.ends[c, 1])
        one, other = index(grains.number[i]), index(grains.number[j])
        s0, impulse = vector_at(rows, c, START), vector_at(rows, c, IMPULSE)
        move = vector_at(rows, c, COAST) + half * (vector_at(speed, i, AFTER) - vector_at(speed, j, AFTER))
        way = closing(s0, rows[c, SIZE], move)
        books.virial[0] += dot(s0 + 0.5 * move, impulse)
        end = rows[c, GAP] + way.change
        deepest = max(deepest, max(rows[c, GAP], end))
        begins = (rows[c, GAP] <= 0.0) & (end > 0.0)
        books.collisions[one] += begins
        books.collisions[other] += begins
        if matter.pairs.damping is not None:
            lost = 0.5 * _lost(matter, dot(impulse, move), rows[c, GAP], way.change)
            books.dissipated[one] += lost
            books.dissipated[other] += lost
    return deepest


@outlined
def book_wall(matter, law, wall, grains, touches, books, number):
    """Book the contacts with a wall; their largest overlap [m]."""
    rows, speed, half, begin = touches.wall_rows, grains.speed, 0.5 * matter.h, touches.wall_spans[0, number]
    deepest = 0.0
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        one, gap, push = index(grains.number[i]), rows[c, GAP], rows[c, PUSH]
        move = vector_at(rows, c, COAST) + half * vector_at(speed, i, AFTER)
        own = met(wall, touches.listed, touches.spans, c, grains.place[i, RADIUS])
        way = rising(own, vector_at(rows, c, START), rows[c, SIZE], move)
        deepest = max(deepest, max(gap, gap + way.change))
        books.impacts[one] += (gap <= 0.0) & (gap + way.change > 0.0)
        impulse = vector_at(rows, c, IMPULSE)
        books.impulse[index(number), one] += norm(impulse)
        work = dot(impulse, move)
        if moves(wall):
            # What it gives is what the ball gains and the contact stores or loses.
            given = work + push * way.change
            books.impulse[index(books.impulse.shape[0] // 2) + index(number), one] += given / matter.h
            work = work - given
        if law.damping is not None:
            books.dissipated[one] += _lost(matter, work, gap, way.change)
    return deepest


@outlined
def count_members(matter, wall, grains, touches, members, number):
    """Count the contacts with a wall that begin in the step, by its members."""
    rows, half, begin = touches.wall_rows, 0.5 * matter.h, touches.wall_spans[0, number]
    places = members.places[number]
    for k in range(begin, begin + touches.wall_spans[1, number]):
        c = index(k)
        i = index(touches.wall_ends[c])
        r0, gap = vector_at(rows, c, START), rows[c, GAP]
        move = vector_at(rows, c, COAST) + half * vector_at(grains.speed, i, AFTER)
        own = met(wall, touches.listed, touches.spans, c, grains.place[i, RADIUS])
        if gap <= 0.0 and gap + rising(own, r0, rows[c, SIZE], move).change > 0.0:
            place = places[
                index(met_member(wall, touches.listed, touches.spans, c, grains.place[i, RADIUS], r0 + move))
            ]
            members.counts.add(place, 1)

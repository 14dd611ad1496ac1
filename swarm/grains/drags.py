"""What is kept of contacts from step to step, such as their friction, carried over when lists are made anew."""

from typing import Any, NamedTuple

import numpy as np

from ..kernel.arrays import index
from ..kernel.jit import Array, long_kernel, outlined
from . import grain_arrays as col

# Columns that are the other way round for the other particle: the impulses of friction and of rolling.
_TURNS = 6


class Drags(NamedTuple):
    """What acts: of pairs, by both particles, on the first one; at walls, in the order of the lists."""

    used: Array  # (2,) how many pairs there are, and how many contacts at walls
    one: Array  # (room,) int64
    other: Array
    drag: Array  # (room, columns)
    number: Array  # (room of walls,) int64, the particle
    wall: Array  # (room of walls,) int64
    face: Array  # (room of walls,) int64, of a field, else 0
    wall_drag: Array


def kept_drags(kernel: Any, world: Any) -> Drags | None:
    """What lists keep of contacts, None where they keep nothing; `kernel` is that of the `Tier`."""
    if world.near.drag is None:
        return None
    kept = room_for(world.near)
    kernel(carry)(world.grains.number, world.near, kept, False)
    return kept


def room_for(near: Any) -> Drags:
    """Room for what lists keep."""
    pairs, touching = near.mate.size, near.slot.size
    one, other = np.empty((2, pairs), np.int64)
    number, wall, face = np.empty((3, touching), np.int64)
    drag, wall_drag = np.empty_like(near.drag), np.empty_like(near.wall_drag)
    return Drags(np.zeros(2, np.int64), one, other, drag, number, wall, face, wall_drag)


def set_drags(kernel: Any, world: Any, kept: Drags | None) -> None:
    """Give what was kept to new lists."""
    if kept is not None:
        row = np.full(world.books.impacts.size, -1)
        row[world.grains.number] = np.arange(len(world.grains.number))
        world.near.drag[: int(world.near.first[-1])] = 0.0
        world.near.wall_drag[: int(world.near.wall_first[-1])] = 0.0
        kernel(carry)(row, world.near, kept, True)


@long_kernel
def carry(numbers, near, kept, gives):
    """Give new lists what was kept of what is listed again, or keep what acts.

    `numbers` are the row of each particle, -1 of one that is gone, or the particle of each row.
    """
    if gives:
        for m in range(kept.used[0]):
            _give_pair(numbers, near, kept, index(m))
        for m in range(kept.used[1]):
            c = index(m)
            k = _listed_at(near, kept.wall[c], numbers[index(kept.number[c])], kept.face[c])
            if k >= 0:
                _copy(near.wall_drag, index(k), kept.wall_drag, c, 1.0)
    else:
        kept.used[:] = 0
        for a in range(numbers.size):
            _keep_pairs(numbers, near, kept, index(a))
        for wall in range(near.wall_first.size - 1):
            _keep_at_wall(numbers, near, kept, wall)


def _keep_pairs(number, near, kept, a):
    """Keep what acts of the pairs of a row."""
    for m in range(near.first[a], near.first[a + 1]):
        k, c = index(m), index(kept.used[0])
        if _copy(kept.drag, c, near.drag, k, 1.0):
            kept.one[c], kept.other[c] = number[a], number[index(near.mate[k])]
            kept.used[0] += 1


def _keep_at_wall(number, near, kept, wall):
    """Keep what acts at a wall."""
    for m in range(near.wall_first[index(wall)], near.wall_first[index(wall + 1)]):
        k, c = index(m), index(kept.used[1])
        if _copy(kept.wall_drag, c, near.wall_drag, k, 1.0):
            kept.number[c], kept.wall[c] = number[index(near.slot[k])], wall
            kept.face[c] = 0 if near.spans is None else near.spans[k, col.FACE]
            kept.used[1] += 1


@outlined
def _copy(into, c, drag, k, sign):
    """Copy what is kept of a contact, of the other particle where the sign is -1; whether anything is."""
    acts = False
    for column in range(drag.shape[1]):
        into[c, column] = drag[k, column] * (sign if column < _TURNS else 1.0)
        acts |= drag[k, column] != 0.0
    return acts


def _give_pair(row, near, kept, c):
    """Give a pair that is listed again what was kept of it."""
    one, other = row[index(kept.one[c])], row[index(kept.other[c])]
    a, b = min(one, other), max(one, other)
    if a < 0:
        return
    # One after the other: a ball has few.
    k, end = near.first[index(a)], near.first[index(a + 1)]
    while k < end and near.mate[index(k)] != b:
        k += 1
    if k < end:
        _copy(near.drag, index(k), kept.drag, c, 1.0 if one < other else -1.0)


def _listed_at(near, wall, a, face):
    """The place in the lists of a row at a wall, or at a face of one, -1 where it is not listed; rows ascend there."""
    k, end = near.wall_first[index(wall)], near.wall_first[index(wall + 1)]
    last = end
    while k < last:
        middle = (k + last) // 2
        if near.slot[index(middle)] < a:
            k = middle + 1
        else:
            last = middle
    if near.spans is not None:
        while k < end and near.slot[index(k)] == a and near.spans[index(k), col.FACE] != face:
            k += 1
    return k if k < end and near.slot[index(k)] == a else -1

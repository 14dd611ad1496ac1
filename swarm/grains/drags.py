"""The numbers kept of contacts from step to step, such as friction, carried over when lists are made anew."""

from typing import Any, NamedTuple

import numpy as np

from ..kernel.arrays import index
from ..kernel.jit import Array, long_kernel, outlined
from . import grain_arrays as col

# The first columns change sign for the other particle: the impulses of friction and of rolling.
_TURNS = 6


class Drags(NamedTuple):
    """The kept numbers that are not 0: of pairs, with impulses on the first particle, and at walls, in list order."""

    used: Array  # (2,) the numbers of pairs, and of contacts at walls
    one: Array  # (room,) int64
    other: Array
    drag: Array  # (room, columns)
    number: Array  # (room of walls,) int64, the particle
    wall: Array  # (room of walls,) int64
    face: Array  # (room of walls,) int64, the face of a field, else 0
    wall_drag: Array


def kept_drags(kernel: Any, world: Any) -> Drags | None:
    """Return the numbers that lists keep of contacts, or None; `kernel` is the method of the `Tier`."""
    if world.near.drag is None:
        return None
    kept = room_for(world.near)
    kernel(carry)(world.grains.number, world.near, kept, False)
    return kept


def room_for(near: Any) -> Drags:
    """Return an empty `Drags` with the room of the lists."""
    pairs, touching = near.mate.size, near.slot.size
    one, other = np.empty((2, pairs), np.int64)
    number, wall, face = np.empty((3, touching), np.int64)
    drag, wall_drag = np.empty_like(near.drag), np.empty_like(near.wall_drag)
    return Drags(np.zeros(2, np.int64), one, other, drag, number, wall, face, wall_drag)


def set_drags(kernel: Any, world: Any, kept: Drags | None) -> None:
    """Write the kept numbers into new lists; `kernel` is the method of the `Tier`."""
    if kept is not None:
        row = np.full(world.books.impacts.size, -1)
        row[world.grains.number] = np.arange(len(world.grains.number))
        world.near.drag[: int(world.near.first[-1])] = 0.0
        world.near.wall_drag[: int(world.near.wall_first[-1])] = 0.0
        kernel(carry)(row, world.near, kept, True)


@long_kernel
def carry(numbers, near, kept, gives):
    """Write the kept numbers of contacts into new lists that have these contacts, or keep the numbers that are not 0.

    If `gives`, `numbers` are the rows of the particles, -1 for one that has left; else the particles of the rows.
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
    """Keep the numbers of the pairs of a row that act."""
    for m in range(near.first[a], near.first[a + 1]):
        k, c = index(m), index(kept.used[0])
        if _copy(kept.drag, c, near.drag, k, 1.0):
            kept.one[c], kept.other[c] = number[a], number[index(near.mate[k])]
            kept.used[0] += 1


def _keep_at_wall(number, near, kept, wall):
    """Keep the numbers of the contacts at a wall that act."""
    for m in range(near.wall_first[index(wall)], near.wall_first[index(wall + 1)]):
        k, c = index(m), index(kept.used[1])
        if _copy(kept.wall_drag, c, near.wall_drag, k, 1.0):
            kept.number[c], kept.wall[c] = number[index(near.slot[k])], wall
            kept.face[c] = 0 if near.spans is None else near.spans[k, col.FACE]
            kept.used[1] += 1


@outlined
def _copy(into, c, drag, k, sign):
    """Copy the kept numbers of a contact, for the other particle if `sign` is -1; return whether any is not 0."""
    acts = False
    for column in range(drag.shape[1]):
        into[c, column] = drag[k, column] * (sign if column < _TURNS else 1.0)
        acts |= drag[k, column] != 0.0
    return acts


def _give_pair(row, near, kept, c):
    """Write the kept numbers of a pair that is listed again into the list."""
    one, other = row[index(kept.one[c])], row[index(kept.other[c])]
    a, b = min(one, other), max(one, other)
    if a < 0:
        return
    # A linear search: a ball has few pairs.
    k, end = near.first[index(a)], near.first[index(a + 1)]
    while k < end and near.mate[index(k)] != b:
        k += 1
    if k < end:
        _copy(near.drag, index(k), kept.drag, c, 1.0 if one < other else -1.0)


def _listed_at(near, wall, a, face):
    """The place of a row in the list of a wall, or of its face, where rows ascend; -1 if it is not listed."""
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

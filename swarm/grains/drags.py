"""What is kept of contacts from step to step, such as their friction, carried over when lists are made anew."""

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .grain_arrays import FACE

# Columns that are the other way round for the other particle: the impulses of friction and of rolling.
_TURNS = 6
# More than a field has.
_FACES = 1 << 31


class Drags(NamedTuple):
    """What is not 0, by both particles of a pair, on the first one; and at walls, in the order of their numbers."""

    one: NDArray[np.int64]
    other: NDArray[np.int64]
    drag: NDArray[np.float64]  # (pairs, columns)
    at_wall: NDArray[np.int64]
    wall_drag: NDArray[np.float64]


def _at_walls(world: Any) -> NDArray[np.int64]:
    """Of each ball that is listed at a wall a number that only they have."""
    number, near, most = world.grains.number, world.near, world.books.impacts.size
    first, count = near.wall_first, int(near.wall_first[-1])
    wall = np.repeat(np.arange(len(first) - 1), np.diff(first))
    if near.spans is not None:
        wall = wall * _FACES + near.spans[: wall.size, FACE]
    return np.asarray(wall * most + number[near.slot[:count]], np.int64)


def kept_drags(world: Any) -> Drags | None:
    """What lists keep of contacts, None where they keep nothing."""
    near = world.near
    if near.drag is None:
        return None
    number, acts = world.grains.number, _acts(near.drag[: int(near.first[-1])])
    first = np.repeat(np.arange(len(number)), np.diff(near.first))[acts]
    at_wall = _at_walls(world)
    here = _acts(near.wall_drag[: at_wall.size])
    here = here[np.argsort(at_wall[here])]
    return Drags(number[first], number[near.mate[acts]], near.drag[acts], at_wall[here], near.wall_drag[here])


def _turned(drag: NDArray[np.float64], sign: NDArray[np.float64]) -> NDArray[np.float64]:
    """What is kept of pairs, of the other particle where the sign is -1."""
    return np.concatenate([drag[:, :_TURNS] * sign[:, None], drag[:, _TURNS:]], axis=1)


def _acts(drag: NDArray[np.float64]) -> NDArray[np.int64]:
    """The places of those that are not 0."""
    # Column by column: of rows of three NumPy takes ten times as long.
    return np.flatnonzero(functools.reduce(np.logical_or, (one != 0.0 for one in drag.T)))


def set_drags(world: Any, kept: Drags | None) -> None:
    """Give them to new lists."""
    if kept is None:
        return
    near = world.near
    row = np.full(world.books.impacts.size, -1)
    row[world.grains.number] = np.arange(len(world.grains.number))
    one, other = row[kept.one], row[kept.other]
    at = _listed(near, np.minimum(one, other), np.maximum(one, other))
    old = np.flatnonzero(at >= 0)
    near.drag[: int(near.first[-1])] = 0.0
    near.drag[at[old]] = _turned(kept.drag[old], np.where(one < other, 1.0, -1.0)[old])
    key = _at_walls(world)
    at, old = _found(key, kept.at_wall)
    near.wall_drag[: key.size] = 0.0
    near.wall_drag[at] = kept.wall_drag[old]


def _listed(near: Any, i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.int64]:
    """The place in the lists of each pair of rows i < j, -1 of one that is not listed, or of a row -1."""
    place = np.full(i.size, -1)
    left = np.flatnonzero((i >= 0) & (near.first[i] < near.first[i + 1]))
    at, end = near.first[i], near.first[i + 1]
    # All at once, one place further each time: a ball has few.
    while left.size:
        here = at[left]
        found = near.mate[here] == j[left]
        place[left[found]] = here[found]
        at[left] += 1
        left = left[~found & (at[left] < end[left])]
    return place


def _found(key: NDArray[np.int64], known: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The places of the keys that are known, and those of the same keys among the known ones, in ascending order."""
    if not known.size:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    place = np.minimum(np.searchsorted(known, key), known.size - 1)
    at = np.flatnonzero(known[place] == key)
    return at, place[at]

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
    """What is not 0, by their pairs of particles, in ascending order; and those at walls."""

    pair: NDArray[np.int64]
    drag: NDArray[np.float64]  # (pairs, columns) on the particle with the smaller number
    at_wall: NDArray[np.int64]
    wall_drag: NDArray[np.float64]


def _pairs(world: Any) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Of each listed pair a number that only it has, and 1 or -1 where its first particle has the larger number."""
    number, near, most = world.grains.number, world.near, world.books.impacts.size
    first, count = near.first, int(near.first[-1])
    one = number[np.repeat(np.arange(len(number)), np.diff(first))]
    other = number[near.mate[:count]]
    key = np.minimum(one, other) * most + np.maximum(one, other)
    return key, np.where(one < other, 1.0, -1.0)


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
    key, sign = _pairs(world)
    at = _in_order(key, near.drag)
    at_wall = _at_walls(world)
    here = _in_order(at_wall, near.wall_drag)
    return Drags(key[at], _turned(near.drag[at], sign[at]), at_wall[here], near.wall_drag[here])


def _turned(drag: NDArray[np.float64], sign: NDArray[np.float64]) -> NDArray[np.float64]:
    """What is kept of pairs, of the other particle where the sign is -1."""
    return np.concatenate([drag[:, :_TURNS] * sign[:, None], drag[:, _TURNS:]], axis=1)


def _in_order(key: NDArray[np.int64], drag: NDArray[np.float64]) -> NDArray[np.int64]:
    """The places of those that are not 0 in the order of their keys."""
    # Column by column: of rows of three NumPy takes ten times as long.
    acts = np.flatnonzero(functools.reduce(np.logical_or, (one != 0.0 for one in drag[: key.size].T)))
    return np.asarray(acts[np.argsort(key[acts])])


def set_drags(world: Any, kept: Drags | None) -> None:
    """Give them to new lists."""
    if kept is None:
        return
    near = world.near
    key, sign = _pairs(world)
    at, old = _found(key, kept.pair)
    near.drag[: key.size] = 0.0
    near.drag[at] = _turned(kept.drag[old], sign[at])
    key = _at_walls(world)
    at, old = _found(key, kept.at_wall)
    near.wall_drag[: key.size] = 0.0
    near.wall_drag[at] = kept.wall_drag[old]


def _found(key: NDArray[np.int64], known: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The places of the keys that are known, and those of the same keys among the known ones, in ascending order."""
    if not known.size:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    place = np.minimum(np.searchsorted(known, key), known.size - 1)
    at = np.flatnonzero(known[place] == key)
    return at, place[at]

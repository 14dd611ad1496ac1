"""Lists of neighbours: balls in the order of cells, the pairs of each ball within a reach, the balls near each wall.

A ball looks for the balls after it in the rows of cells around its own; along an axis that does not repeat, a row of
cells is one part of the order.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import index, scratch
from ..kernel.grid import wrapped
from ..kernel.jit import Array, long_kernel, outlined
from ..kernel.vector import set_vector, square, vector_at
from ..surfaces.balls.joined_faces import JoinedFaces
from ..surfaces.in_motion.posed import Posed
from ..surfaces.walls import Field
from . import grain_arrays as col
from .cell import nearest
from .heavy_walls import is_heavy
from .vessel import list_in_field

# The most cells along an axis: the numbers along three axes still fit into one integer.
_MOST_CELLS = 1 << 20


class CellOrder(NamedTuple):
    """The cells at one time: the number of each ball's cell, in ascending order, and the strides of these numbers."""

    key: Array  # (N,) int64
    counts: Array  # (3,) of cells along each axis
    strides: Array  # (3,)
    wraps: Array  # (3,) bool, where the first cell is beside the last


def cells_of(centres: NDArray[np.float64], reach: float, period: Any) -> tuple[CellOrder, NDArray[np.int64]]:
    """Return the `CellOrder` of centres (N, 3) with cells no narrower than a reach, and the order of balls by cell."""
    # Extremes are taken by columns, as NumPy takes ten times as long for rows of three numbers.
    x, y, z = centres.T
    low, high = np.array([[k.min(), k.max()] for k in (x, y, z)]).T if len(centres) else np.zeros((2, 3))
    wraps = np.zeros(3, np.bool_)
    for k, length in enumerate(period or ()):
        if length is not None:
            low[k], high[k], wraps[k] = 0.0, length, True
    counts = np.clip(np.floor((high - low) / reach), 1, _MOST_CELLS).astype(np.int64)
    width = np.where(high > low, (high - low) / counts, 1.0)
    cell = np.clip(np.floor((centres - low) / width), 0, counts - 1).astype(np.int64) + 1
    # There is a cell without balls on each side, so that no row runs into the next one.
    strides = np.array([1, counts[0] + 2, (counts[0] + 2) * (counts[1] + 2)], np.int64)
    key = cell @ strides
    order = np.argsort(key, kind="stable")
    return CellOrder(key[order], counts, strides, wraps), order


def _first_from(key, wanted, guess):
    """Return the first place in ascending numbers with a number of at least `wanted`, step by step from a guess on."""
    at = guess
    while at > 0 and key[index(at - 1)] >= wanted:
        at -= 1
    while at < key.size and key[index(at)] < wanted:
        at += 1
    return at


def _beside(cells, k, here, step):
    """The number along an axis of the cell that is a step away from the cell `here`."""
    return wrapped(here + step - 1, cells.counts[k]) + 1 if cells.wraps[k] else here + step


def _is_again(cells, k, step):
    """Whether a step along an axis leads to a cell that another step has reached, as it may where few cells wrap."""
    return bool(cells.wraps[k]) & ((cells.counts[k] < 2) & (step != 0) | (cells.counts[k] < 3) & (step < 0))


@outlined
def _list_between(period, grains, near, span, i, found):
    """List the pairs of ball i with the balls in a span of the order; return how many pairs are listed then."""
    place, (begin, end, skin) = grains.place, span
    here, radius = vector_at(place, i, col.X), place[i, col.RADIUS]
    for k in range(begin, end):
        j = index(k)
        s = nearest(period, here, vector_at(place, j, col.X))
        reach = radius + place[j, col.RADIUS] + skin
        if square(s) < reach * reach:
            if found < near.mate.size:
                near.mate[index(found)] = k
            found += 1
    return found


@long_kernel
def list_pairs(period, grains, near, cells, skin):
    """List all pairs nearer than the sum of their radii and the skin; return their number, also beyond the room."""
    key, strides, found, ways = cells.key, cells.strides, 0, scratch((3, 3, 3), np.int64)
    for a in range(key.size):
        i = index(a)
        near.first[i], given = found, (cells, skin, a, ways)
        z = key[i] // strides[2]
        y = (key[i] - z * strides[2]) // strides[1]
        x = key[i] - z * strides[2] - y * strides[1]
        for up in range(-1, 2):
            for aside in range(-1, 2):
                if _is_again(cells, 2, up) or _is_again(cells, 1, aside):
                    continue
                row = _beside(cells, 2, z, up) * strides[2] + _beside(cells, 1, y, aside) * strides[1]
                if cells.wraps[0]:
                    for along in range(-1, 2):
                        if not _is_again(cells, 0, along):
                            some, way = (row + _beside(cells, 0, x, along), 0), (up + 1, aside + 1, along + 1)
                            found = _list_cells(period, grains, near, given, some, way, found)
                elif row + x + 1 >= key[i]:
                    found = _list_cells(period, grains, near, given, (row + x, 1), (up + 1, aside + 1, 0), found)
    near.first[index(key.size)] = found
    return found


def _list_cells(period, grains, near, given, some, way, found):
    """List the pairs of a ball with the balls after it in some cells of a row; return how many are listed then.

    `some` is the middle cell, and the number of cells on each side of it; `way` leads from the ball's cell to them.
    """
    (cells, skin, a, ways), (middle, around), (up, aside, along) = given, some, way
    # The search begins at the result of the ball before, which was in this cell or one not far before it: from there
    # it takes a step or two, while a search through the whole order takes longer than the distances of the pairs.
    first = _first_from(cells.key, middle - around, ways[index(up), index(aside), index(along)])
    ways[index(up), index(aside), index(along)] = first
    begin = max(first, a + 1)
    end = _first_from(cells.key, middle + around + 1, begin)
    return _list_between(period, grains, near, (begin, end, skin), index(a), found)


def _depth(wall, r):
    """The depth of a ball in a wall to first order, which may be off by half; for faces that end, an upper bound."""
    return -wall.clearance(r) if isinstance(wall, JoinedFaces) else wall.distance(r)


@outlined
def _list_at_wall(wall, grains, near, skin, found):
    """List the balls near a wall, or all balls if it has a prescribed motion; return how many are listed then."""
    place, always = grains.place, isinstance(wall, Posed) and not is_heavy(wall)
    for k in range(place.shape[0]):
        i = index(k)
        if always or _depth(wall.grown(place[i, col.RADIUS]), vector_at(place, i, col.X)) > -2.0 * skin:
            if found < near.slot.size:
                near.slot[index(found)] = k
                if near.spans is not None:
                    near.spans[index(found), col.FACE] = 0
            found += 1
    return found


@long_kernel
def list_walls(walls, faces, grains, near, skin, remaining):
    """List the balls near each wall, with `remaining` [s] of the frame left; return their number, also beyond the room.

    `faces` has, for each field, the number of the face, or of the body, to which each member belongs.
    """
    found = 0
    if near.used is not None:
        near.used[0] = 0
    for k, wall in enumerate(walls.at(remaining).each):
        near.wall_first[k] = found
        if isinstance(wall, Field):
            found = list_in_field(wall, faces[k], grains, near, skin, found)
        else:
            found = _list_at_wall(wall, grains, near, skin, found)
    near.wall_first[len(walls.each)] = found
    for k in range(grains.place.shape[0]):
        i = index(k)
        set_vector(grains.listed, i, 0, vector_at(grains.place, i, col.X))
    return found

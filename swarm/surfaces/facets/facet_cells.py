"""The grid of facets: the entries of each cell, and the distance from each empty cell to the next that is not empty.

The facets of a mesh are on a surface, so most cells are empty: a flight leaps through blocks of empty cells.
"""

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernel import cache
from ...kernel.arrays import aligned_copy, index
from ...kernel.gravity import as_vector
from ...kernel.grid import MARGIN, Grid, filled_grid
from ...kernel.jit import Array, select
from ...kernel.limits import TINY
from ...kernel.record import Record
from ...kernel.vector import Vec, absolute, dot, norm, square, total
from ...state import Floats
from ..fields.grid import enter_bodies
from .free_room import rows_of, spare_of

# The square of the width of a cell is this multiple of the mean area of a facet: in wider cells a flight tests more
# facets, and it crosses more of narrower ones. It doubles with ten times as many facets, from the first number of
# facets to the second: cells that the processor's cache holds are crossed sooner. The most cells for each facet, and
# in all, of 5 bytes each.
_AREA, _DOUBLES, _FEW, _MANY = 1.0, math.log10(2.0), 260.0, 1e5
_CELLS_EACH, _MOST_CELLS = 32.0, 100_000_000
# The least number of cells.
_LEAST_CELLS = 64
# A plane in a cell is stored as whole numbers up to this one, and so to these parts of the cell's diagonal and of a
# speed; and how many are computed at once.
_FULL, _OFF, _OFF_SPEED, _TOGETHER = 32767.0, 1.5e-4, 6e-5, 1_000_000
# A ball around a facet is stored if its middle and its radius are within this number of diagonals: its middle to half
# of one of these whole numbers along each axis, and the plane to 3 diagonals times the round-off of the normal more.
_REACH = 2.0
# The halves of balls are stored as three digits to this base, above this zero, with at most this length.
_BASE, _ZERO, _LONGEST = 32.0, 16.0, 26.0
# The first of these parts in the unit of the balls, and times the length of whole normals.
_NEAR_PLACE = _OFF * _FULL / _REACH
_NEAR = _NEAR_PLACE * _FULL
# The largest s (s - 1/2) (s - 1) on the way from 0 to 1, sqrt(3)/36
_CUBIC = 0.0482
# How far beside the true place a flight may seem to cross a plane, for a distance and a speed that may be 0.
_BESIDE = 4.0 / _OFF_SPEED
# A flight to a mesh that turns or swings is known to be in a cell until shortly before its end: it ends beyond the wall
# of the cell by this part of a cell.
MOVING_MARGIN = 0.02
# Up to this number of facets are entered in plain Python.
_SOME = 60
# This number of entries is tested together, by the same instructions: their data are side by side. A loop over
# four LLVM writes out, and makes no vectors of it.
BLOCK = 8


# A plane that hardly any flight crosses, as it faces away and is far ahead.
_NO_PLANE = np.array([-32767, 0, 0, 0, 32767, 0, 0, 0], np.int16)


class FacetCells(Record):
    """The data of the cells of facets: `Grid.known`."""

    planes: Array  # (blocks, 8, BLOCK) int16: normal, half and ball of each entry, see `passes`
    room: Array  # (cells + 1, 8) int8: the free cells around each cell, see free_room.py
    boxes: Any = None  # for a closed mesh, `boxes_of` its triangles

    def spare(self, cell):
        """Return the number of last entries of a cell that are repeated to fill its last block."""
        return spare_of(self.room, cell)


def cells_around(like, table: Floats, corners: Floats, beyond: float = 0.0, margin: float = MARGIN) -> Grid:
    """Return the grid of the facets of a table, without the free blocks around its cells.

    Args:
        like: one of the facets.
        table: the numbers of the facets, one facet in each row.
        corners: the three corners of each facet (T, 3, 3) [m].
        beyond: how far each facet extends beyond the box of its corners [m].
        margin: the part of a cell that a flight ends beyond its wall.
    """
    low, high = (
        np.ascontiguousarray(end(corners, axis=1).T + way * beyond) for end, way in ((np.min, -1.0), (np.max, 1.0))
    )
    enter = cache.in_python(enter_bodies) if len(table) <= _SOME else enter_bodies
    cells = _cells(corners, low.min(axis=1), high.max(axis=1), margin)
    grid = filled_grid(*cells, partial(enter, like, table, (low, high)), margin)
    return _in_blocks(grid, table, corners)


def _in_blocks(grid: Grid, table: Floats, corners: Floats) -> Grid:
    """Return the grid with the entries of each cell in blocks of their own, without the free blocks around its cells.

    The last entry of a cell is repeated to fill its last block.
    """
    counts = np.diff(grid.first)
    blocks = -(-counts // BLOCK)
    starts = np.concatenate([[0], np.cumsum(blocks)])
    cells = np.repeat(np.arange(len(counts)), blocks)
    # The places of the entries of each block among the entries of its cell
    places = BLOCK * (np.arange(len(cells)) - starts[cells])[:, None] + np.arange(BLOCK)
    last = counts[cells][:, None] - 1
    facets = grid.entries[grid.first[cells][:, None] + np.minimum(places, last)]
    planes = _planes(grid, table, corners, facets.ravel(), np.repeat(cells, BLOCK))
    planes[(places > last).ravel()] = _NO_PLANE
    planes = planes.reshape(-1, BLOCK, 8).swapaxes(1, 2)
    known = FacetCells(aligned_copy(planes), rows_of(counts, BLOCK * blocks))
    return grid._replace(first=(BLOCK * starts).astype(np.int32), entries=aligned_copy(facets.ravel()), known=known)


def _cells(corners: Floats, low: Floats, high: Floats, margin: float) -> tuple[Floats, Floats, Floats]:
    """Return the corner of the first cell, the number of cells along each axis, and their widths."""
    a, b, c = np.moveaxis(corners, 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / len(corners)
    extent = high - low
    # A flat mesh has cells before and behind it.
    extent = np.maximum(extent, 1e-3 * extent.max())
    most = min(max(_CELLS_EACH * len(corners), _LEAST_CELLS), _MOST_CELLS)
    wide = _AREA * (min(max(len(corners), _FEW), _MANY) / _FEW) ** _DOUBLES
    side = max(math.sqrt(wide * area), (extent.prod() / most) ** (1.0 / 3.0))
    shape = np.maximum(np.ceil(extent / side), 1.0)
    room = 4.0 * np.where(margin > MARGIN, margin * extent / shape, MARGIN * extent)
    middle = 0.5 * (low + high)
    width = (extent + 2.0 * room) / shape
    return middle - 0.5 * shape * width, shape, width


def _planes(
    grid: Grid, table: Floats, corners: Floats, facets: NDArray[np.int32], cells: NDArray[np.int64]
) -> NDArray[np.int16]:
    """Return the planes and the half balls of facets, each in the cell with this number."""
    width = np.array(grid.width)
    diagonal = float(np.linalg.norm(width))
    unit, none = _FULL / (_REACH * diagonal), _digits(np.zeros(3))
    made = np.zeros((len(cells), 8), np.int16)
    middles, radii, halves = _half_balls(corners)
    for first in range(0, len(cells), _TOGETHER):
        some = slice(first, min(first + _TOGETHER, len(cells)))
        places = np.stack(np.unravel_index(cells[some], tuple(int(n) for n in grid.shape)), axis=1)
        normal, offset = table[facets[some], :3], table[facets[some], 3]
        middle = np.array(grid.low) + (places + 0.5) * width
        made[some, :3] = np.rint(normal * _FULL)
        away, radius = middles[facets[some]] - middle, radii[facets[some]]
        near = (np.abs(away).max(axis=1) < _REACH * diagonal) & (radius < 0.9 * _REACH * diagonal)
        # Otherwise a place of the plane, and no half
        foot = (offset - (normal * middle).sum(axis=1))[:, None] * normal
        made[some, 3] = np.where(near, _digits(halves[facets[some]]), none)
        made[some, 4:7] = np.rint(np.where(near[:, None], away, foot) * unit)
        made[some, 7] = np.where(near, np.ceil(radius * unit) + 2.0, _FULL)
    return made


def _half_balls(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the least ball around each facet: its middle in the plane, its radius, and its half.

    The half is a vector h of digits: no point r of the facet has h.(r - middle) below -radius, which is beyond
    its longest edge. The half of a ball around a triangle with a right angle is twice as large as the triangle.
    """
    sides, every = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), np.arange(len(corners))
    squares = (sides**2).sum(axis=2)
    k = squares.argmax(axis=1)
    begin, way = corners[every, (k + 1) % 3], -sides[every, k]
    # The circumcentre by its weights, or the middle of the longest edge if the circumcentre is beyond it
    weights = squares * (squares.sum(axis=1)[:, None] - 2.0 * squares)
    acute = weights.min(axis=1) > 0.0
    sums = np.where(acute, weights.sum(axis=1), 1.0)
    around = (weights[:, :, None] * corners).sum(axis=1) / sums[:, None]
    middle = np.where(acute[:, None], around, begin + 0.5 * way)
    places = corners - middle[:, None]
    radius = np.linalg.norm(places, axis=2).max(axis=1)
    into = places[every, k] - places[every, (k + 1) % 3]
    into -= ((into * way).sum(axis=1) / squares[every, k])[:, None] * way
    into /= np.maximum(np.abs(into).max(axis=1), TINY)[:, None]
    half = np.zeros_like(into)
    for length in range(1, int(_ZERO)):
        longer = np.rint(into * length)
        good = (longer[:, None] * places).sum(axis=2).min(axis=1) >= -radius
        half[good] = longer[good]
    return middle, radius, half


def _digits(half: Floats) -> Floats:
    """Return the three digits of a half as one number."""
    return np.asarray((half + _ZERO) @ np.array([_BASE * _BASE, _BASE, 1.0]))


def _half(digits):
    """Return the half of a number."""
    x = np.floor(digits * (1.0 / (_BASE * _BASE)))
    rest = digits - _BASE * _BASE * x
    y = np.floor(rest * (1.0 / _BASE))
    return Vec(x - _ZERO, y - _ZERO, rest - _BASE * y - _ZERO)


def blocks_of(cells, number):
    """Return the begin and the end of the blocks of entries of the cell with this number."""
    cell, first = index(number), cells.first
    return index(first[cell]) // BLOCK, index(first[cell + index(1)]) // BLOCK


# --- Which planes a flight passes ------------------------------------------------------------------------


class FlightInCell(Record):
    """A flight through a cell: lengths are in the unit of the balls, times in units of its span."""

    at: Vec  # from the middle of the cell
    way: Vec  # by its velocity, and by its acceleration, or None
    bent: Any
    slow: float  # a way by a velocity and by an acceleration that may be 0, along whole normals
    weak: float
    curve: Any  # the `CurveBound` of a changing acceleration, or None


class CurveBound(Record):
    """The bounds of a flight that is no parabola, in the same units."""

    off: float  # its largest distance from the parabola
    bends: float  # the largest change of its velocity, and of half of its acceleration
    reach: float  # its largest distance from the middle between its ends


def from_middle(cells, place, r):
    """Return the vector from the middle of the cell at `place` to r."""
    w = cells.width
    return r - (cells.low + Vec((place.x + 0.5) * w.x, (place.y + 0.5) * w.y, (place.z + 0.5) * w.z))


def flight_in(cells, at, v, pull, span, jerk=None):
    """Return the `FlightInCell` of a flight that is in a cell for the time `span`.

    Args:
        cells: the grid.
        at: its start, from the middle of the cell [m].
        v: the velocity there [m/s].
        pull: the acceleration there [m/s^2], or None.
        span: the time [s].
        jerk: its `Jerk` during this time, if the acceleration changes.
    """
    unit = (_FULL / _REACH) / math.sqrt(square(cells.width))
    way, bent, weak, curve = (unit * span) * v, None, 0.0, None
    if pull is not None:
        bent = (0.5 * unit * span * span) * as_vector(pull)
    if jerk is not None:
        sixth = unit * span * span * span * (1.0 / 6.0)
        off, bends = sixth * jerk.off, 3.0 * sixth * jerk.rest
        if jerk.known is not None:
            # s^3 = (3 s^2 - s)/2 + s (s - 1/2) (s - 1), of which the last term is small, and so are its derivatives.
            cubic = sixth * jerk.known
            size, way, bent = norm(cubic), way - 0.5 * cubic, bent + 1.5 * cubic
            off, bends = off + _CUBIC * size, bends + 1.5 * size
        # The middle of a parabola is a quarter of its bend from that between its ends.
        curve = CurveBound(off, bends, 0.5 * norm(way + bent) + 0.25 * norm(bent) + off)
    if bent is not None:
        weak = _FULL * _OFF_SPEED * total(absolute(bent))
    return FlightInCell(unit * at, way, bent, _FULL * _OFF_SPEED * total(absolute(way)) + 2.0 * weak, weak, curve)


def passes(cells, block, k, here):
    """Whether a flight may cross the plane of an entry in its cell within the half ball of the facet.

    Most flights do not, and no facet is looked up. The plane is known to the round-off of whole numbers, and so is the
    length of its normal. Without a branch: no processor predicts which entries a flight passes.
    """
    rows = cells.known.planes
    normal = _row(rows, block, 0, k)
    half, radius = _half(float(rows[block, 3, k])), float(rows[block, 7, k])
    at = here.at - _row(rows, block, 4, k)
    depth, rate = dot(normal, at), dot(normal, here.way)
    if here.bent is None:
        beyond = rate + here.slow
        meets = (beyond > 0.0) & (depth <= _NEAR) & (depth + beyond >= -_NEAR)
        # All lengths times the speed along the normal, so that nothing is divided: a third of these tests.
        away = rate * at - depth * here.way
        reach, off = radius * rate, 2.0 * _BESIDE * _NEAR_PLACE * here.slow
        return meets & (not ((rate > 2.0 * here.slow) & _is_beside(away, half, reach, off, rate)))
    return _passes_in_curve(here, at, (depth, rate, dot(normal, here.bent)), half, radius)


def _is_beside(away, half, reach, off, unit):
    """Whether a place is surely outside of a half ball.

    Args:
        away: the place less the middle of the ball.
        half: the vector of the half.
        reach: the radius of the ball.
        off: the largest error of the place.
        unit: the largest error of the middle, in the unit of the other arguments.
    """
    ball = reach + off
    return (square(away) > ball * ball) | (dot(half, away) < -(reach + _LONGEST * (off + unit)))


def _passes_in_curve(here, at, level, half, radius):
    """Whether a flight that is nearly a parabola passes: its level is depth + rate s + bend s^2 at the part s."""
    (depth, rate, bend), off, bends, farther = level, 0.0, 0.0, 0.0
    if here.curve is not None:
        off, bends, farther = _FULL * here.curve.off, _FULL * here.curve.bends, here.curve.off
    rises, falls = select(bend > 0.0, bend, 0.0), select(bend < 0.0, -bend, 0.0)
    # The level is within `more` of this parabola.
    more, most, least = here.slow + off + _NEAR, rate + rises, rate - falls
    grows, reaches = most + rises + here.slow + bends > 0.0, depth + select(most > 0.0, most, 0.0) >= -more
    # A flight behind the plane comes back first.
    comes_back = (bend > -(here.weak + bends)) & (depth + select(least < 0.0, least, 0.0) <= more)
    meets = grows & reaches & ((depth <= _NEAR) | comes_back)
    # Where it crosses the plane its level rises by 2 root. Only during a short time is it near 0, unless it
    # comes back.
    b = 0.5 * rate
    below = b * b - bend * depth
    turns = (bend < 0.0) & (depth + rate + bend <= more)
    is_known = (rate > 0.0) & (below > more * (more + 4.0 * abs(bend))) & (not turns)
    root = np.sqrt(select(is_known, below, 0.0))
    part = -depth / select(is_known, b + root, 1.0)
    away = root * (at + part * (here.way + part * here.bent))
    # Times the root, to avoid divisions.
    length = (here.slow + 2.0 * here.weak) * (1.0 / (_FULL * _OFF_SPEED))
    error = (farther + _NEAR_PLACE) * root + length * more
    meets = meets & (not (is_known & _is_beside(away, half, radius * root, error, root)))
    if here.curve is None:
        return meets
    # It is in a ball around the middle between its ends.
    middle, reach = at + 0.5 * (here.way + here.bent), radius + here.curve.reach + _NEAR_PLACE
    return meets & (square(middle) <= reach * reach)


def _row(rows, block, first, k):
    return Vec(float(rows[block, first, k]), float(rows[block, first + 1, k]), float(rows[block, first + 2, k]))

"""Cells, each with a list of the balls whose centres are in it: who meets whom before one of them leaves its cell.

No cell is shorter than the largest diameter, so that balls that touch are in the same cell or in neighbours. Each axis
has one cell more at either end, which is empty, or stands for the one at the other end where the scene repeats. The
outermost cells have no end where it does not.
"""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.jit import Array, select
from ..kernel.record import Record
from ..kernel.vector import Vec
from ..surfaces.course import rise_time
from ..surfaces.walls import Field
from .rows import BEFORE, CELL, FLOATS, LEAVES, NEXT, NOBODY, WHOLES


class Axis(Record):
    """The cells along an axis: numbers 1 to `count`."""

    low: float  # where the first one begins [m]
    width: float  # [m]
    count: int
    offset: Array  # (count + 2) int32: what each adds to the number of a cell
    period: Any  # [m], or None
    last: Any  # the number before the period, or None

    def nearest(self, b):
        """The shortest of the distances along this axis of a particle and the images of another one."""
        if self.period is None:
            return b
        half = 0.5 * self.period
        return select(b > half, b - self.period, select(b < -half, b + self.period, b))

    def until_end(self, x, v, a, cell):
        """How long a flight stays between the faces of a cell, and whether it leaves by the upper one."""
        low, high = self.low + (cell - 1) * self.width, self.low + cell * self.width
        if a is None:
            up = v > 0.0
            time = select(up, high - x, low - x) / v
            time = select(time > 0.0, time, 0.0)
            ends = (v != 0.0) & self._has_face(cell, up)
            return select(ends, time, math.inf), up
        above, below = rise_time(x - high, 0.5 * v, 0.5 * a), rise_time(low - x, -0.5 * v, -0.5 * a)
        above = select(self._has_face(cell, True), above, math.inf)
        below = select(self._has_face(cell, False), below, math.inf)
        up = above <= below
        return select(up, above, below), up

    def _has_face(self, cell, up):
        if self.period is not None:
            return True
        return select(up, cell < self.count, cell > 1)


class Grid(Record):
    """The cells of a scene."""

    x: Axis
    y: Axis
    z: Axis
    near: Array  # bool, whether a ball in a cell may touch a wall
    few: Any = None  # 1.0 where some axis has so few cells that two images of a ball may be near another one

    def axes(self):
        """The three axes."""
        return self.x, self.y, self.z

    def number(self, i, flock):
        """The number of the cell of a ball."""
        row, found = WHOLES * i + CELL, 0
        for k, axis in enumerate(self.axes()):
            found = axis.offset[index(flock.tag[index(row + k)])] + found
        return found


def until_exit(grid, pull, flock, i, now):
    """Find when a ball leaves its cell, from a time on."""
    r, v = flock.at(pull, i, now)
    first, a = math.inf, (None, None, None) if pull is None else pull
    for k, axis in enumerate(grid.axes()):
        time, _up = axis.until_end(r[k], v[k], a[k], flock.tag[index(WHOLES * i + CELL + k)])
        first = min(time, first)
    flock.event[index(FLOATS * i + LEAVES)] = now + first


def take_out(grid, flock, i):
    """Remove a ball from the list of its cell."""
    before, after = flock.tag[index(WHOLES * i + BEFORE)], flock.link[index(WHOLES * i + NEXT)]
    if before >= 0:
        flock.link[index(WHOLES * before + NEXT)] = after
    else:
        flock.head[index(grid.number(i, flock))] = after
    if after >= 0:
        flock.tag[index(WHOLES * after + BEFORE)] = before


def put_in(grid, flock, i):
    """Add a ball to the list of its cell, as the first."""
    cell = grid.number(i, flock)
    after = flock.head[index(cell)]
    flock.link[index(WHOLES * i + NEXT)], flock.tag[index(WHOLES * i + BEFORE)] = after, NOBODY
    if after >= 0:
        flock.tag[index(WHOLES * after + BEFORE)] = i
    flock.head[index(cell)] = i


def cross(grid, pull, flock, i, now):
    """Bring a ball into the cell that it enters now: (axis, by the upper face, how many periods it goes back)."""
    r, v = flock.at(pull, i, now)
    first, which, rises, a = math.inf, 0, False, (None, None, None) if pull is None else pull
    for k, axis in enumerate(grid.axes()):
        time, up = axis.until_end(r[k], v[k], a[k], flock.tag[index(WHOLES * i + CELL + k)])
        sooner = time < first
        first, which, rises = select(sooner, time, first), select(sooner, k, which), select(sooner, up, rises)
    take_out(grid, flock, i)
    turns = 0
    for k, axis in enumerate(grid.axes()):
        if which == k:
            row = index(WHOLES * i + CELL + k)
            cell = flock.tag[row] + select(rises, 1, -1)
            if axis.period is not None:
                turns = select(cell > axis.count, 1, select(cell < 1, -1, 0))
                cell -= turns * axis.count
                flock.flight[index(FLOATS * i + k)] -= turns * axis.period
            flock.tag[row] = cell
    put_in(grid, flock, i)
    return which, rises, turns


# --- At the start ----------------------------------------------------------------------------------------


def mark_near(grid, walls, radius, plane):
    """Mark the cells of a plane across x in which a ball of at most this radius may touch a wall."""
    reach = radius
    for axis in grid.axes():
        reach = 0.5 * axis.width + reach
    for ky in range(grid.y.count + 2):
        for kz in range(grid.z.count + 2):
            where, is_outer = (plane, ky, kz), False
            r = Vec(*(axis.low + (k - 0.5) * axis.width for axis, k in zip(grid.axes(), where, strict=True)))
            for axis, k in zip(grid.axes(), where, strict=True):
                # Of a cell that has no end nothing is known.
                if axis.period is None:
                    is_outer = (k <= 1) | (k >= axis.count) | is_outer
            number = (plane * (grid.y.count + 2) + ky) * (grid.z.count + 2) + kz
            grid.near[index(number)] = is_outer or not _clear(walls, r) > reach


def _clear(walls, r):
    """A lower bound of the distance of a place from all walls."""
    least = math.inf
    for wall in walls.each:
        least = min(_clear_of(wall, r), least)
    return least


def _clear_of(wall, r):
    if isinstance(wall, Field):
        return 0.0
    return -wall.distance(r) if wall.flat is True else wall.far(r)

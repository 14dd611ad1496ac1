"""Cells, each with the balls that have their centres in it, in which collisions are looked for.

No cell is shorter than the largest diameter, so that balls that touch are in the same cell or in neighbours. Each axis
has one more cell at either end. It is empty, or stands for the cell at the other end if the axis is periodic. The
outermost cells of an axis that is not periodic are unbounded.
"""

import math
from typing import Any

from ...kernel.arrays import index
from ...kernel.jit import Array, select
from ...kernel.record import Record
from ...kernel.vector import Vec
from ...surfaces.time_of_impact.course import rise_time
from ...surfaces.walls import Field
from .rows import AFTER, CELL, FLOATS, LEAVES, WHOLES
from .window import middle_of, swept


class Axis(Record):
    """The cells along an axis: numbers 1 to `count`."""

    low: float  # the start of the first cell [m]
    width: float  # [m]
    count: int
    offset: Array  # (count + 2) int32: the part of the number of a cell that each place on the axis adds
    period: Any  # [m], or None
    last: Any  # the largest float below the period, or None

    def nearest(self, b):
        """The shortest of the signed distances along this axis from a particle to the images of another one."""
        if self.period is None:
            return b
        half = 0.5 * self.period
        return select(b > half, b - self.period, select(b < -half, b + self.period, b))

    def until_end(self, x, v, a, cell):
        """Return how long a flight stays between the faces of a cell, and whether it leaves by the upper one."""
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


class BallGrid(Record):
    """The cells of a scene."""

    x: Axis
    y: Axis
    z: Axis
    near: Array  # bool, whether a ball in a cell may touch a wall
    few: Any = None  # 1.0 if two images of a ball may be near another ball, as an axis has few cells

    def axes(self):
        """The three axes."""
        return self.x, self.y, self.z

    def number(self, i, flock):
        """The number of the cell of a ball."""
        found = 0
        for axis, k in zip(self.axes(), flock.cell(i), strict=True):
            found = axis.offset[index(k)] + found
        return found


def until_exit(grid, pull, flock, i, now):
    """Find the time after `now` at which a ball leaves its cell, and the face by which it does."""
    r, v = flock.at(pull, i, now)
    first, face, a = math.inf, 0, (None, None, None) if pull is None else pull
    for k, (axis, cell) in enumerate(zip(grid.axes(), flock.cell(i), strict=True)):
        time, up = axis.until_end(r[k], v[k], a[k], cell)
        sooner = time < first
        first, face = select(sooner, time, first), select(sooner, 2 * k + select(up, 1, 0), face)
    flock.event[index(FLOATS * i + LEAVES)] = now + first
    flock.leave_by(i, face)


def put_in(flock, i, cell):
    """Put a ball into a cell, as the first ball there."""
    flock.link[index(WHOLES * i + AFTER)] = flock.head[index(cell)]
    flock.head[index(cell)] = i


def take_out(flock, i, cell):
    """Remove a ball from its cell."""
    after, k = flock.after(i), flock.head[index(cell)]
    if k == i:
        flock.head[index(cell)] = after
    else:
        while flock.after(k) != i:
            k = flock.after(k)
        flock.link[index(WHOLES * k + AFTER)] = after


def cross(grid, flock, i):
    """Move a ball into the cell that it enters now; return the axis, and by how many periods the ball goes back."""
    face, old = flock.face(i), grid.number(i, flock)
    which, step = face >> 1, 2 * (face & 1) - 1
    new, turns, cell = old, 0, 0
    for k, (axis, here) in enumerate(zip(grid.axes(), flock.cell(i), strict=True)):
        if which == k:
            cell = here + step
            if axis.period is not None:
                turns = select(cell > axis.count, 1, select(cell < 1, -1, 0))
                cell -= turns * axis.count
            new = old + axis.offset[index(cell)] - axis.offset[index(here)]
    take_out(flock, i, old)
    put_in(flock, i, new)
    flock.tag[index(WHOLES * i + CELL + which)] = cell
    for k, axis in enumerate(grid.axes()):
        if axis.period is not None and which == k:
            flock.flight[index(FLOATS * i + k)] -= turns * axis.period
    return which, turns


# --- At the start ----------------------------------------------------------------------------------------


def mark_near(box, radius, plane):
    """Mark the cells of a plane across x in which a ball of at most this radius may touch a wall."""
    grid, reach = box.grid, radius
    walls, half = middle_of(box)
    for axis in grid.axes():
        reach = 0.5 * axis.width + reach
    for ky in range(grid.y.count + 2):
        for kz in range(grid.z.count + 2):
            where, is_outer = (plane, ky, kz), False
            r = Vec(*(axis.low + (k - 0.5) * axis.width for axis, k in zip(grid.axes(), where, strict=True)))
            for axis, k in zip(grid.axes(), where, strict=True):
                # An unbounded cell may be near a wall anywhere.
                if axis.period is None:
                    is_outer = (k <= 1) | (k >= axis.count) | is_outer
            number = (plane * (grid.y.count + 2) + ky) * (grid.z.count + 2) + kz
            grid.near[index(number)] = is_outer or not _clear(walls, r, half) > reach


def _clear(walls, r, half):
    """A lower bound of the distance of a place from all walls, for moving walls from `half` [s] before to after."""
    least = math.inf
    for wall in walls.each:
        least = min(_clear_of(wall, r) - swept(wall, r, half), least)
    return least


def _clear_of(wall, r):
    if isinstance(wall, Field):
        return 0.0
    return -wall.distance(r) if wall.flat is True else wall.far(r)

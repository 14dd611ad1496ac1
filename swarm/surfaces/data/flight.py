"""Flights with a sampled surface by safe steps from cell to cell.

Far from the surface a step goes as far as it surely does not reach it, or to the wall of the cell. Near it a step ends
where a parabola above the level rises through 0, with the bounds of its bend in the cells around, or where it leaves
these: no root is skipped.
"""

import math
from typing import NamedTuple

import numpy as np

from ...kernel.arrays import index
from ...kernel.jit import outlined, select
from ...kernel.vector import Symmetric, Vec, dot, lowest, norm, square, times, total
from ..course import rise_time
from ..march import bisected, lets_go
from . import spline as splines
from .cells import SPREAD
from .spline import MARGIN

_EPSILON = float(np.finfo(np.float64).eps)
# Steps of one flight; what is not found by then goes on in the next pass.
_MARCH = 200
# A flight that is past the wall by so many times the round-off of its place is at it.
_ROUND_OFF = 8.0

# --- Where a flight is -----------------------------------------------------------------------------------


class Cell(NamedTuple):
    """The cell of a point, from where on, and what is known of it; `inside` is whether it is one of the grid."""

    low: Vec  # in cells from the corner of the grid
    row: int  # of what is known of the bend there
    clear: float  # how far from the surface at least [m], below 0 where it may be in the cell
    inside: bool


def _cell_of(surface, r):
    u, n = times(r - surface.spline.low, surface.spline.inverse), surface.spline.shape
    inside = _is_in(u.x, n.x) & _is_in(u.y, n.y) & _is_in(u.z, n.z)
    low = Vec(_layer(u.x, n.x), _layer(u.y, n.y), _layer(u.z, n.z))
    i, j, k = index(int(low.x)), index(int(low.y)), index(int(low.z))
    cells = surface.cells
    return Cell(low, int(cells.row[i, j, k]), (float(cells.clear[i, j, k]) - 1.0) * cells.unit, inside)


def _is_in(u, count):
    return (u >= -0.5 * MARGIN) & (u <= count + 0.5 * MARGIN)


def _layer(u, count):
    return min(max(np.floor(u), 0.0), count - 1.0)


def _until_out(surface, low, around, r, v, pull):
    """When a flight is beyond a cell and so many cells around it, as far as they are in the grid."""
    made = surface.spline
    x = _time_out(made.low.x, made.width.x, _layers(low.x, around, made.shape.x), r.x, v.x, pull.x)
    y = _time_out(made.low.y, made.width.y, _layers(low.y, around, made.shape.y), r.y, v.y, pull.y)
    z = _time_out(made.low.z, made.width.z, _layers(low.z, around, made.shape.z), r.z, v.z, pull.z)
    return min(x, y, z)


def _layers(low, around, count):
    return max(low - around, 0.0) - MARGIN, min(low + 1.0 + around, count) + MARGIN


def _time_out(first, width, layers, x, v, pull):
    """When a coordinate leaves some layers of cells."""
    low, high = first + layers[0] * width, first + layers[1] * width
    if pull == 0.0:
        return select(v != 0.0, (select(v > 0.0, high, low) - x) / select(v != 0.0, v, 1.0), math.inf)
    return min(rise_time(x - high, 0.5 * v, 0.5 * pull), rise_time(low - x, -0.5 * v, -0.5 * pull))


@outlined
def _until_in(surface, r, v, pull):
    """Until when a flight from outside of the grid is surely outside; infinite if for ever."""
    low, width, n = surface.spline.low, surface.spline.width, surface.spline.shape
    x = _time_in(low.x, low.x + n.x * width.x, r.x, v.x, pull.x)
    y = _time_in(low.y, low.y + n.y * width.y, r.y, v.y, pull.y)
    z = _time_in(low.z, low.z + n.z * width.z, r.z, v.z, pull.z)
    return max(x, y, z)


def _time_in(low, high, x, v, pull):
    """Before when a coordinate is surely not in an interval."""
    if x < low:
        return rise_time(x - low, 0.5 * v, 0.5 * pull)
    return rise_time(high - x, -0.5 * v, -0.5 * pull) if x > high else 0.0


# --- How the level bends ---------------------------------------------------------------------------------


class Bent(NamedTuple):
    """Bounds of half the second derivative of the level along a flight."""

    least: float
    most: float


def _bent(surface, row, n, v, pull, time):
    """`Bent` around a cell for so long, with the gradient and the velocity now."""
    # w.H w + grad phi.G/2 with w = v + G t and grad phi = n + 2 H (v t + G t^2/2), where |H - A| is at most the spread
    a, spread = _known(surface.cells.bends, row)
    now, falls = _form(a, v, v) + 0.5 * dot(n, pull), norm(pull) * time
    once, twice = 3.0 * _form(a, v, pull) * time, 1.5 * _form(a, pull, pull) * time * time
    speed = norm(v) + falls
    off = spread * speed * (speed + falls)
    least, most = now + min(once, 0.0) + min(twice, 0.0) - off, now + max(once, 0.0) + max(twice, 0.0) + off
    inside = surface.side > 0.0
    return Bent(select(inside, least, -most), select(inside, most, -least))


def _known(bends, i):
    """The matrix A of a row of `bends`, and how far H is from it."""
    a = Symmetric(
        _at(bends, i, 0), _at(bends, i, 1), _at(bends, i, 2), _at(bends, i, 3), _at(bends, i, 4), _at(bends, i, 5)
    )
    return a, _at(bends, i, SPREAD)


def _at(bends, i, k):
    # In plain Python products of short numbers would be short.
    return np.float64(bends[i, k])


def _form(a, v, w):
    """v.A w"""
    x, y, z = (
        a.xx * w.x + a.xy * w.y + a.zx * w.z,
        a.xy * w.x + a.yy * w.y + a.yz * w.z,
        a.zx * w.x + a.yz * w.y + a.zz * w.z,
    )
    return v.x * x + v.y * y + v.z * z


# --- Flight ----------------------------------------------------------------------------------------------


@outlined
def march(surface, r, v, pull):
    """Safe steps to the first root of the level along the flight."""
    t, before = 0.0, 0.0
    g = norm(pull)
    if norm(v) == 0.0 and g == 0.0:
        return math.inf, True
    for i in range(_MARCH):
        if g == 0.0:
            t = _through_empty(surface, r, v, t)
        p, w = r + t * (v + (0.5 * t) * pull), v + t * pull
        cell = _cell_of(surface, p)
        if not cell.inside or cell.clear >= 0.0:
            free = _free_time(surface, cell, p, w, pull)
            if not free < math.inf:
                return math.inf, True
            # Round-off must not leave it where it is for ever.
            t += max(free, _EPSILON * t)
            continue
        value, n = splines.value_and_slope(surface.spline, p)
        level, half = surface.side * value, 0.5 * surface.side * dot(n, w)
        speed, room = norm(w), 2.0 * _EPSILON * total(splines.coordinates(surface.spline, p))
        # Within round-off of the wall and not on its way off it: nothing nearer is to be found.
        noise = _ROUND_OFF * room * norm(n)
        if i > 0 and half >= 0.0 and level >= -noise:
            if level <= noise:
                return t, True
            return bisected(surface, r, v, pull, before, t), True
        step, out, bent = _safe_step(surface, cell, Near(level, half, n), p, w, pull)
        slack = room * norm(n)
        if lets_go(level, half, step, slack):
            step, _out, _bent_there = _safe_step(surface, cell, Near(-slack, half, n), p, w, pull)
            before, t = t, t + step
            continue
        before, t = t, t + step
        # What is left of the level after the step is at most (most - least) step^2, and half of its slope there at
        # least this.
        rising, left = half + bent.least * step, (bent.most - bent.least) * step * step
        arrives = speed * step + 0.5 * g * step * step <= room or left * (speed + g * step) <= 2.0 * room * rising
        if step < out and arrives and (i > 0 or rising > 0.0 or step == 0.0):
            return t, True
    return t, False


class Near(NamedTuple):
    """The level, half of its slope along a flight, and the gradient of phi."""

    level: float
    half: float
    slope: Vec


def _safe_step(surface, cell, near, r, v, pull):
    """(a time during which a flight surely stays admissible, within which its bounds hold, these as `Bent`)."""
    # A short straight step stays in the cells around, which is cheaper to know than when it leaves them.
    speed, falls = norm(v), norm(pull) > 0.0
    out = _least(surface.spline.width) / speed if speed > 0.0 else 0.0
    bent = _bent(surface, cell.row, near.slope, v, pull, 0.0)
    step = rise_time(near.level, near.half, bent.most)
    if falls or not step < out:
        out = _until_out(surface, cell.low, 1.0, r, v, pull)
        bent = _bent(surface, cell.row, near.slope, v, pull, out)
        step = min(rise_time(near.level, near.half, bent.most), out)
    if falls and 2.0 * step < out:
        # Again with the bounds of a shorter time
        out = 2.0 * step
        bent = _bent(surface, cell.row, near.slope, v, pull, out)
        step = min(max(step, rise_time(near.level, near.half, bent.most)), out)
    return step, out, bent


@outlined
def _through_empty(surface, r, v, t):
    """The time from t on at which a straight flight comes to a cell where the surface may be, or out of the grid.

    A step is as long as the clearance or as the way out of the cell, in units of cells, and without a branch: most of
    the steps of a flight are these.
    """
    made, cells = surface.spline, surface.cells
    u, w, n = times(r - made.low, made.inverse), times(v, made.inverse), made.shape
    # By each part of the clearance, and by each cell along an axis
    rate, pace = cells.unit / norm(v), Vec(_inverse(w.x), _inverse(w.y), _inverse(w.z))
    for _i in range(_MARCH):
        p = u + t * w
        low = Vec(_layer(p.x, n.x), _layer(p.y, n.y), _layer(p.z, n.z))
        clear = float(cells.clear[index(int(low.x)), index(int(low.y)), index(int(low.z))])
        if clear == 0.0 or not (_is_in(p.x, n.x) & _is_in(p.y, n.y) & _is_in(p.z, n.z)):
            break
        x = (low.x + select(w.x >= 0.0, 1.0 + MARGIN, -MARGIN) - p.x) * pace.x
        y = (low.y + select(w.y >= 0.0, 1.0 + MARGIN, -MARGIN) - p.y) * pace.y
        z = (low.z + select(w.z >= 0.0, 1.0 + MARGIN, -MARGIN) - p.z) * pace.z
        t += max((clear - 1.0) * rate, min(x, y, z), _EPSILON * t)
    return t


def _inverse(x):
    return select(x != 0.0, 1.0 / select(x != 0.0, x, 1.0), math.inf)


def _free_time(surface, cell, r, v, pull):
    """How long a flight surely stays where there is no surface, from outside of the grid or a cell that has none."""
    if not cell.inside:
        return _until_in(surface, r, v, pull) if surface.closed > 0.0 else math.inf
    if cell.clear > 0.0:
        # speed t + g t^2/2 = clear
        speed, g = norm(v), norm(pull)
        return 2.0 * cell.clear / (speed + (speed if g == 0.0 else math.sqrt(speed * speed + 2.0 * g * cell.clear)))
    return _until_out(surface, cell.low, 0.0, r, v, pull)


# Of walls that move, and of methods with steps: bounds within a distance.


@outlined
def bend(surface, r):
    """Bounds of the eigenvalues of side H: see `Smooth.bend`."""
    cell, width = _cell_of(surface, r), surface.spline.width
    if cell.clear >= 0.0 or not cell.inside:
        return 0.0, 0.0, 0.0
    u = times(r - surface.spline.low, surface.spline.inverse) - cell.low
    wall = lowest(Vec(1.0 + u.x, 1.0 + u.y, 1.0 + u.z), Vec(2.0 - u.x, 2.0 - u.y, 2.0 - u.z))
    # |A| is at most the root of the sum of the squares of its entries.
    a, spread = _known(surface.cells.bends, cell.row)
    most = math.sqrt(square(Vec(a.xx, a.yy, a.zz)) + 2.0 * square(Vec(a.xy, a.yz, a.zx))) + spread
    return most, most, _least(times(wall, width))


def _least(a):
    return min(a.x, a.y, a.z)


@outlined
def clearance(surface, r):
    """The distance to the surface at least; next to its cells, to the wall of the cell."""
    cell, width = _cell_of(surface, r), surface.spline.width
    if not cell.inside:
        return surface.closed * max(norm(splines.place_of(surface.spline, r).off), MARGIN * _least(width))
    if cell.clear < 0.0:
        return 0.0
    u = times(r - surface.spline.low, surface.spline.inverse) - cell.low
    wall = times(lowest(u, Vec(1.0 - u.x, 1.0 - u.y, 1.0 - u.z)), width)
    return max(_least(wall) + MARGIN * _least(width), cell.clear)


@outlined
def safe_time(surface, r, v, pull):
    """One safe step."""
    if norm(v) == 0.0 and norm(pull) == 0.0:
        return math.inf
    cell = _cell_of(surface, r)
    if cell.clear >= 0.0 or not cell.inside:
        return _free_time(surface, cell, r, v, pull)
    value, n = splines.value_and_slope(surface.spline, r)
    level, half = surface.side * value, 0.5 * surface.side * dot(n, v)
    if level > 0.0:
        return 0.0
    step, _out, _bent_there = _safe_step(surface, cell, Near(level, half, n), r, v, pull)
    return step

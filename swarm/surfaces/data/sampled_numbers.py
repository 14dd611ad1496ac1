"""The numbers of a sampled surface: its level set, the bounds in its cells, and flights from cell to cell.

Far from the surface a step is as long as the surface surely does not allow a hit, or as the way to the wall of the
cell. Near it a step ends where a parabola above the level rises through 0, with the bounds of its bend in the cells
around, or where the flight leaves these cells: no root is skipped.
"""

import math
from typing import NamedTuple

import numpy as np

from ...kernel.arrays import index
from ...kernel.grid import MARGIN, layer_of
from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.vector import Symmetric, Vec, absolute, dot, lowest, norm, square, times, total
from .. import contract
from ..curvature import applied
from ..time_of_impact.course import rise_time
from ..time_of_impact.march import LOOKS, SafeStep, lets_go
from .sample_cells import SPREAD, SampleCells
from .spline import Spline

# The most cells without the surface that a straight flight passes at once
_MANY = 200
# A flight that is past the wall by at most this many times the round-off of its place is at the wall.
_ROUND_OFF = 8.0


class SampleCell(NamedTuple):
    """The cell of a point, its corner, and its bounds; `inside` is whether it is a cell of the grid."""

    low: Vec  # in cells from the corner of the grid
    row: int  # the row of its bounds of the bend
    clear: float  # a lower bound of the distance from the surface [m], below 0 where the surface may be in the cell
    inside: bool


class SlopeRange(NamedTuple):
    """Bounds of half the second derivative of the level along a flight."""

    least: float
    most: float


class LevelAndSlope(NamedTuple):
    """The level, half of its slope along a flight, and the gradient of phi."""

    level: float
    half: float
    slope: Vec


def _is_in(u, count):
    return (u >= -0.5 * MARGIN) & (u <= count + 0.5 * MARGIN)


def _layers(low, around, count):
    return max(low - around, 0.0) - MARGIN, min(low + 1.0 + around, count) + MARGIN


def _time_out(first, width, layers, x, v, pull):
    """Return when a coordinate leaves some layers of cells."""
    low, high = first + layers[0] * width, first + layers[1] * width
    if pull == 0.0:
        return select(v != 0.0, (select(v > 0.0, high, low) - x) / select(v != 0.0, v, 1.0), math.inf)
    return min(rise_time(x - high, 0.5 * v, 0.5 * pull), rise_time(low - x, -0.5 * v, -0.5 * pull))


def _time_in(low, high, x, v, pull):
    """Return the time before which a coordinate is surely not in an interval."""
    if x < low:
        return rise_time(x - low, 0.5 * v, 0.5 * pull)
    return rise_time(high - x, -0.5 * v, -0.5 * pull) if x > high else 0.0


def _known(bends, i):
    """Return the matrix A of a row of `bends`, and the bound of its distance from H."""
    a = Symmetric(
        _at(bends, i, 0), _at(bends, i, 1), _at(bends, i, 2), _at(bends, i, 3), _at(bends, i, 4), _at(bends, i, 5)
    )
    return a, _at(bends, i, SPREAD)


def _at(bends, i, k):
    # In plain Python products of short numbers would be short.
    return np.float64(bends[i, k])


def _inverse(x):
    return select(x != 0.0, 1.0 / select(x != 0.0, x, 1.0), math.inf)


def _least_of(a):
    """Return the least component."""
    return min(a.x, a.y, a.z)


class SampledNumbers(contract.Smooth):
    """The numbers of a sampled surface."""

    spline: Spline
    cells: SampleCells
    side: float
    closed: float  # 1 if there is no surface outside of the grid
    least: float  # a lower bound of the least eigenvalue of side H anywhere on the surface

    def phi(self, r):
        return self.spline.value(r)

    def hessian(self, r):
        return self.spline.half_bend(r)

    def difference(self, r0, r1):
        return self.spline.difference(r0, r1)

    def gradient(self, r):
        _value, slope = self.spline.value_and_slope(r)
        return slope

    def gap_scale(self, r):
        _value, n = self.spline.value_and_slope(r)
        return total(times(absolute(n), self.spline.coordinates(r)))

    def project(self, r):
        value, n = self.spline.value_and_slope(r)
        return r - (value / dot(n, n)) * n

    def distance(self, r):
        value, n = self.spline.value_and_slope(r)
        return self.side * value / norm(n)

    def farthest_push(self):
        # 1 + kappa H has its first pole at the least eigenvalue of side H.
        return self.side * (-1.0 / self.least if self.least < 0.0 else math.inf)

    # --- Its cells ---

    def _cell_of(self, r):
        u, n = times(r - self.spline.low, self.spline.inverse), self.spline.shape
        inside = _is_in(u.x, n.x) & _is_in(u.y, n.y) & _is_in(u.z, n.z)
        low = Vec(layer_of(u.x, n.x), layer_of(u.y, n.y), layer_of(u.z, n.z))
        i, j, k = index(int(low.x)), index(int(low.y)), index(int(low.z))
        cells = self.cells
        return SampleCell(low, int(cells.row[i, j, k]), (float(cells.clear[i, j, k]) - 1.0) * cells.unit, inside)

    def _until_out(self, low, around, r, v, pull):
        """Return when a flight is beyond a cell and `around` cells around it, as far as they are in the grid."""
        made = self.spline
        x = _time_out(made.low.x, made.width.x, _layers(low.x, around, made.shape.x), r.x, v.x, pull.x)
        y = _time_out(made.low.y, made.width.y, _layers(low.y, around, made.shape.y), r.y, v.y, pull.y)
        z = _time_out(made.low.z, made.width.z, _layers(low.z, around, made.shape.z), r.z, v.z, pull.z)
        return min(x, y, z)

    @outlined
    def _until_in(self, r, v, pull):
        """Return until when a flight from outside of the grid is surely outside; infinite if for ever."""
        low, width, n = self.spline.low, self.spline.width, self.spline.shape
        x = _time_in(low.x, low.x + n.x * width.x, r.x, v.x, pull.x)
        y = _time_in(low.y, low.y + n.y * width.y, r.y, v.y, pull.y)
        z = _time_in(low.z, low.z + n.z * width.z, r.z, v.z, pull.z)
        return max(x, y, z)

    @outlined
    def _through_empty(self, r, v, t):
        """Return the time from t on when a straight flight reaches a cell where the surface may be, or leaves the grid.

        A step is as long as the clearance or as the way out of the cell, in units of cells, and without a branch: most
        of the steps of a flight are of this kind.
        """
        made, cells = self.spline, self.cells
        u, w, n = times(r - made.low, made.inverse), times(v, made.inverse), made.shape
        # By each part of the clearance, and by each cell along an axis
        rate, pace = cells.unit / norm(v), Vec(_inverse(w.x), _inverse(w.y), _inverse(w.z))
        for _i in range(_MANY):
            p = u + t * w
            low = Vec(layer_of(p.x, n.x), layer_of(p.y, n.y), layer_of(p.z, n.z))
            clear = float(cells.clear[index(int(low.x)), index(int(low.y)), index(int(low.z))])
            if clear == 0.0 or not (_is_in(p.x, n.x) & _is_in(p.y, n.y) & _is_in(p.z, n.z)):
                break
            x = (low.x + select(w.x >= 0.0, 1.0 + MARGIN, -MARGIN) - p.x) * pace.x
            y = (low.y + select(w.y >= 0.0, 1.0 + MARGIN, -MARGIN) - p.y) * pace.y
            z = (low.z + select(w.z >= 0.0, 1.0 + MARGIN, -MARGIN) - p.z) * pace.z
            t += max((clear - 1.0) * rate, min(x, y, z), EPSILON * t)
        return t

    def _free_time(self, cell, r, v, pull):
        """A time in which a flight surely meets no surface, from outside of the grid or from a cell without it."""
        if not cell.inside:
            return self._until_in(r, v, pull) if self.closed > 0.0 else math.inf
        if cell.clear > 0.0:
            # speed t + g t^2/2 = clear
            speed, g = norm(v), norm(pull)
            return 2.0 * cell.clear / (speed + (speed if g == 0.0 else math.sqrt(speed * speed + 2.0 * g * cell.clear)))
        return self._until_out(cell.low, 0.0, r, v, pull)

    @outlined
    def hessian_bounds(self, r):
        """Return bounds of the eigenvalues of side H: see `Smooth.bend`."""
        cell, width = self._cell_of(r), self.spline.width
        if cell.clear >= 0.0 or not cell.inside:
            return 0.0, 0.0, 0.0
        u = times(r - self.spline.low, self.spline.inverse) - cell.low
        wall = lowest(Vec(1.0 + u.x, 1.0 + u.y, 1.0 + u.z), Vec(2.0 - u.x, 2.0 - u.y, 2.0 - u.z))
        # |A| is at most the root of the sum of the squares of its entries.
        a, spread = _known(self.cells.bends, cell.row)
        most = math.sqrt(square(Vec(a.xx, a.yy, a.zz)) + 2.0 * square(Vec(a.xy, a.yz, a.zx))) + spread
        return most, most, _least_of(times(wall, width))

    @outlined
    def clearance(self, r):
        """Return a lower bound of the distance to the surface; next to its cells, to the wall of the cell."""
        cell, width = self._cell_of(r), self.spline.width
        if not cell.inside:
            return self.closed * max(norm(self.spline.place(r).off), MARGIN * _least_of(width))
        if cell.clear < 0.0:
            return 0.0
        u = times(r - self.spline.low, self.spline.inverse) - cell.low
        wall = times(lowest(u, Vec(1.0 - u.x, 1.0 - u.y, 1.0 - u.z)), width)
        return max(_least_of(wall) + MARGIN * _least_of(width), cell.clear)

    # --- Flight ---

    falling_looks = LOOKS

    def look(self, r, v, pull, t, is_first):
        g = norm(pull)
        if g == 0.0:
            if norm(v) == 0.0:
                return SafeStep(t, math.inf, -1.0, -1.0)
            t = self._through_empty(r, v, t)
        p, w = r + t * (v + (0.5 * t) * pull), v + t * pull
        cell = self._cell_of(p)
        if not cell.inside or cell.clear >= 0.0:
            # Round-off must not keep the flight at one place for ever.
            return SafeStep(t, max(self._free_time(cell, p, w, pull), EPSILON * t), -1.0, -1.0)
        value, n = self.spline.value_and_slope(p)
        level, half = self.side * value, 0.5 * self.side * dot(n, w)
        speed, room = norm(w), 2.0 * EPSILON * total(self.spline.coordinates(p))
        # Within round-off of the wall and not on its way off: no nearer place is to be found.
        noise = _ROUND_OFF * room * norm(n)
        if not is_first and half >= 0.0 and level >= -noise:
            return SafeStep(t, 0.0, 0.0, select(level <= noise, -1.0, 0.0))
        step, out, bent = self._safe_step(cell, LevelAndSlope(level, half, n), p, w, pull)
        slack = room * norm(n)
        if lets_go(level, half, step, slack):
            step, _out, _bent_there = self._safe_step(cell, LevelAndSlope(-slack, half, n), p, w, pull)
            return SafeStep(t, step, -1.0, -1.0)
        # After the step the level is at most (most - least) step^2 from 0, and half of its slope there is at least
        # this.
        rising, remaining = half + bent.least * step, (bent.most - bent.least) * step * step
        arrives = speed * step + 0.5 * g * step * step <= room or remaining * (speed + g * step) <= 2.0 * room * rising
        arrives = step < out and arrives and (not is_first or rising > 0.0 or step == 0.0)
        return SafeStep(t, step, select(arrives, 0.0, -1.0), -1.0)

    @outlined
    def safe_time(self, r, v, pull):
        """One safe step."""
        if norm(v) == 0.0 and norm(pull) == 0.0:
            return math.inf
        cell = self._cell_of(r)
        if cell.clear >= 0.0 or not cell.inside:
            return self._free_time(cell, r, v, pull)
        value, n = self.spline.value_and_slope(r)
        level, half = self.side * value, 0.5 * self.side * dot(n, v)
        if level > 0.0:
            return 0.0
        step, _out, _bent_there = self._safe_step(cell, LevelAndSlope(level, half, n), r, v, pull)
        return step

    def _safe_step(self, cell, here, r, v, pull):
        """(a time while a flight surely stays admissible, a time while its bounds hold, the bounds as `SlopeRange`)."""
        # A short straight step stays in the cells around, which costs less than to compute when it leaves them.
        speed, falls = norm(v), norm(pull) > 0.0
        out = _least_of(self.spline.width) / speed if speed > 0.0 else 0.0
        bent = self._bent(cell.row, here.slope, v, pull, 0.0)
        step = rise_time(here.level, here.half, bent.most)
        if falls or not step < out:
            out = self._until_out(cell.low, 1.0, r, v, pull)
            bent = self._bent(cell.row, here.slope, v, pull, out)
            step = min(rise_time(here.level, here.half, bent.most), out)
        if falls and 2.0 * step < out:
            # Again with the bounds of a shorter time
            out = 2.0 * step
            bent = self._bent(cell.row, here.slope, v, pull, out)
            step = min(max(step, rise_time(here.level, here.half, bent.most)), out)
        return step, out, bent

    def _bent(self, row, n, v, pull, time):
        """Return the `SlopeRange` around a cell up to `time`, with the gradient and the velocity now."""
        # w.H w + grad phi.G/2 with w = v + G t, grad phi = n + 2 H (v t + G t^2/2) and |H - A| at most the spread
        a, spread = _known(self.cells.bends, row)
        now, falls = dot(v, applied(a, v)) + 0.5 * dot(n, pull), norm(pull) * time
        once, twice = 3.0 * dot(v, applied(a, pull)) * time, 1.5 * dot(pull, applied(a, pull)) * time * time
        speed = norm(v) + falls
        off = spread * speed * (speed + falls)
        least, most = now + min(once, 0.0) + min(twice, 0.0) - off, now + max(once, 0.0) + max(twice, 0.0) + off
        inside = self.side > 0.0
        return SlopeRange(select(inside, least, -most), select(inside, most, -least))

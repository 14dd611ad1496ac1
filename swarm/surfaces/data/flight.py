"""Flights with a sampled surface by safe steps from cell to cell.

Far from the surface a step goes as far as it surely does not reach it, or to the wall of the cell. Near it a step ends
where a parabola above the level rises through 0, with the bounds of its bend in the cells around, or where it leaves
these: no root is skipped.
"""

import math
from typing import NamedTuple

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.vector import Vec, dot, norm, total
from ..time_of_impact.course import rise_time
from ..time_of_impact.march import LOOKS, SafeStep, lets_go
from .sampled_numbers import CellNumbers, known, least_of

# A flight that is past the wall by so many times the round-off of its place is at it.
_ROUND_OFF = 8.0


class SlopeRange(NamedTuple):
    """Bounds of half the second derivative of the level along a flight."""

    least: float
    most: float


class LevelAndSlope(NamedTuple):
    """The level, half of its slope along a flight, and the gradient of phi."""

    level: float
    half: float
    slope: Vec


def _form(a, v, w):
    """v.A w"""
    x, y, z = (
        a.xx * w.x + a.xy * w.y + a.zx * w.z,
        a.xy * w.x + a.yy * w.y + a.yz * w.z,
        a.zx * w.x + a.yz * w.y + a.zz * w.z,
    )
    return v.x * x + v.y * y + v.z * z


class SampledNumbers(CellNumbers):
    """A sampled surface as kernels take it."""

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
            # Round-off must not leave it where it is for ever.
            return SafeStep(t, max(self._free_time(cell, p, w, pull), EPSILON * t), -1.0, -1.0)
        value, n = self.spline.value_and_slope(p)
        level, half = self.side * value, 0.5 * self.side * dot(n, w)
        speed, room = norm(w), 2.0 * EPSILON * total(self.spline.coordinates(p))
        # Within round-off of the wall and not on its way off it: nothing nearer is to be found.
        noise = _ROUND_OFF * room * norm(n)
        if not is_first and half >= 0.0 and level >= -noise:
            return SafeStep(t, 0.0, 0.0, select(level <= noise, -1.0, 0.0))
        step, out, bent = self._safe_step(cell, LevelAndSlope(level, half, n), p, w, pull)
        slack = room * norm(n)
        if lets_go(level, half, step, slack):
            step, _out, _bent_there = self._safe_step(cell, LevelAndSlope(-slack, half, n), p, w, pull)
            return SafeStep(t, step, -1.0, -1.0)
        # What is left of the level after the step is at most (most - least) step^2, and half of its slope there at
        # least this.
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
        """(a time for which a flight surely stays admissible, within which its bounds hold, these as `SlopeRange`)."""
        # A short straight step stays in the cells around, which is cheaper to know than when it leaves them.
        speed, falls = norm(v), norm(pull) > 0.0
        out = least_of(self.spline.width) / speed if speed > 0.0 else 0.0
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
        """`SlopeRange` around a cell for so long, with the gradient and the velocity now."""
        # w.H w + grad phi.G/2 with w = v + G t, grad phi = n + 2 H (v t + G t^2/2) and |H - A| at most the spread
        a, spread = known(self.cells.bends, row)
        now, falls = _form(a, v, v) + 0.5 * dot(n, pull), norm(pull) * time
        once, twice = 3.0 * _form(a, v, pull) * time, 1.5 * _form(a, pull, pull) * time * time
        speed = norm(v) + falls
        off = spread * speed * (speed + falls)
        least, most = now + min(once, 0.0) + min(twice, 0.0) - off, now + max(once, 0.0) + max(twice, 0.0) + off
        inside = self.side > 0.0
        return SlopeRange(select(inside, least, -most), select(inside, most, -least))

"""What kernels know of a sampled surface: its level set."""

import math

from ...kernel.vector import ZERO, absolute, dot, norm, times, total
from .. import contract
from . import flight
from . import spline as splines
from .cells import Cells
from .spline import Spline


class SampledNumbers(contract.Smooth):
    """The numbers of a sampled surface."""

    spline: Spline
    cells: Cells
    side: float
    closed: float  # 1 if there is no surface outside of the grid
    least: float  # the least eigenvalue of side H anywhere on the surface, at least

    def phi(self, r):
        return splines.value(self.spline, r)

    def hessian(self, r):
        return splines.half_bend(self.spline, r)

    def difference(self, r0, r1):
        return splines.difference(self.spline, r0, r1)

    def gradient(self, r):
        _value, slope = splines.value_and_slope(self.spline, r)
        return slope

    def gap_scale(self, r):
        _value, n = splines.value_and_slope(self.spline, r)
        return total(times(absolute(n), splines.coordinates(self.spline, r)))

    def settle(self, r):
        value, n = splines.value_and_slope(self.spline, r)
        return r - (value / dot(n, n)) * n

    def distance(self, r):
        value, n = splines.value_and_slope(self.spline, r)
        return self.side * value / norm(n)

    def farthest_push(self):
        # 1 + kappa H has its first pole at the least eigenvalue of side H.
        return self.side * (-1.0 / self.least if self.least < 0.0 else math.inf)

    # --- Flight ---

    def first_hit(self, r, v):
        return flight.march(self, r, v, ZERO)

    def falling_hit(self, r, v, pull):
        return flight.march(self, r, v, pull)

    def safe_time(self, r, v, pull):
        return flight.safe_time(self, r, v, pull)

    def bend(self, r):
        return flight.bend(self, r)

    def clearance(self, r):
        return flight.clearance(self, r)

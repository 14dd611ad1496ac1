"""What kernels know of a sampled surface: its level set."""

import math

from ...kernel.record import Record
from ...kernel.vector import absolute, dot, norm, times, total
from .. import contract
from . import spline as splines
from .cells import Cells
from .spline import Spline


class SampledNumbers(Record):
    """The numbers of a sampled surface."""

    spline: Spline
    cells: Cells
    side: float
    closed: float  # 1 if there is no surface outside of the grid
    least: float  # the least eigenvalue of side H anywhere on the surface, at least


# --- The level set ---------------------------------------------------------------------------------------

contract.phi.register(SampledNumbers, lambda surface, r: splines.value(surface.spline, r))
contract.hessian.register(SampledNumbers, lambda surface, r: splines.half_bend(surface.spline, r))
contract.difference.register(SampledNumbers, lambda surface, r0, r1: splines.difference(surface.spline, r0, r1))


@contract.gradient.register(SampledNumbers)
def _(surface, r):
    _value, slope = splines.value_and_slope(surface.spline, r)
    return slope


def coordinates(surface, r):
    """The magnitudes of those that round a point, in the scene and in the grid: near the origin these are larger."""
    return absolute(r) + absolute(r - surface.spline.low)


@contract.gap_scale.register(SampledNumbers)
def _(surface, r):
    _value, n = splines.value_and_slope(surface.spline, r)
    return total(times(absolute(n), coordinates(surface, r)))


@contract.settle.register(SampledNumbers)
def _(surface, r):
    value, n = splines.value_and_slope(surface.spline, r)
    return r - (value / dot(n, n)) * n


@contract.distance.register(SampledNumbers)
def _(surface, r):
    value, n = splines.value_and_slope(surface.spline, r)
    return surface.side * value / norm(n)


@contract.farthest_push.register(SampledNumbers)
def _(surface):
    # 1 + kappa H has its first pole at the least eigenvalue of side H.
    return surface.side * (-1.0 / surface.least if surface.least < 0.0 else math.inf)

"""Definitions that several shapes share: class decorators that register them for a shape's numbers."""

import math
from typing import TypeVar

import numpy as np

from ...kernel.jit import select
from .. import contract

_TINY = float(np.finfo(np.float64).tiny)
Numbers = TypeVar("Numbers", bound=type)


def root_gap(kind: Numbers) -> Numbers:
    """Numbers whose inner function is a squared distance: phi = sqrt(q) - radius, with the fields radius and radius2.

    The shape registers `inner`, and `slope` or its own `gradient`.
    """
    contract.phi.register(kind, _phi)
    contract.gradient.register(kind, _gradient)
    contract.gap_of.register(kind, _gap_of)
    contract.level_of.register(kind, _level_of)
    contract.gap_slope.register(kind, _gap_slope)
    contract.clearance.register(kind, _clearance)
    contract.farthest_push.register(kind, _farthest_push)
    return kind


def exact_chord(kind: Numbers) -> Numbers:
    """Numbers whose `chord_guess` is exact, and whose gap is a distance up to round-off."""
    contract.chord_improve.register(kind, _no_improvement)
    contract.chord_sweeps.register(kind, _no_sweeps)
    contract.distance.register(kind, _distance)
    return kind


def _phi(surface, r):
    return np.sqrt(contract.inner(surface, r)) - surface.radius


def _gradient(surface, r):
    # Where q = 0 the distance has no gradient, and the answer is 0.
    return contract.slope(surface, r) * (0.5 / np.maximum(np.sqrt(contract.inner(surface, r)), _TINY))


def _gap_of(surface, q):
    return surface.side * (math.sqrt(q) - surface.radius)


def _level_of(surface, q):
    return surface.side * (q - surface.radius2)


def _gap_slope(surface, q0, q1):
    # (sqrt(q1) - sqrt(q0))/(q1 - q0) = 1/(sqrt(q0) + sqrt(q1))
    root1 = math.sqrt(q1)
    slope = 1.0 / (math.sqrt(q0) + root1)
    return surface.side * slope, -0.5 * surface.side * slope * slope / root1


def _clearance(surface, r):
    return -contract.gap_of(surface, contract.inner(surface, r))


def _farthest_push(surface):
    # The pole of 1/(1 + kappa H), where no eigenvalue of H is above 1
    return select(surface.side > 0.0, math.inf, -1.0)


def _no_improvement(surface, r, p, kappa):
    return 0.0


def _no_sweeps(surface):
    return 0


def _distance(surface, r):
    return contract.gap_of(surface, contract.inner(surface, r))

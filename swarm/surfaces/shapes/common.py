"""What several shapes share: bases of their numbers, and the definitions that follow from these."""

import math

import numpy as np

from ...kernel.jit import select
from ...kernel.record import Record
from .. import contract

_TINY = float(np.finfo(np.float64).tiny)
# The least root of an inner function that is told from 0: the cube of its inverse is a number.
_MIDDLE = 1e-100


class Distance(Record):
    """Numbers whose inner function is a squared distance: phi = sqrt(q) - radius, with the fields radius and radius2.

    The shape registers `inner`, and `slope` or its own `gradient`.
    """


contract.phi.register(Distance, lambda surface, r: np.sqrt(contract.inner(surface, r)) - surface.radius)
contract.gap_of.register(Distance, lambda surface, q: surface.side * (math.sqrt(q) - surface.radius))
contract.level_of.register(Distance, lambda surface, q: surface.side * (q - surface.radius2))
contract.clearance.register(Distance, lambda surface, r: -contract.gap_of(surface, contract.inner(surface, r)))
# The pole of 1/(1 + kappa H), where no eigenvalue of H is above 1
contract.farthest_push.register(Distance, lambda surface: select(surface.side > 0.0, math.inf, -1.0))


@contract.gradient.register(Distance)
def _(surface, r):
    # Where q = 0 the distance has no gradient, and the answer is 0.
    return contract.slope(surface, r) * (0.5 / np.maximum(np.sqrt(contract.inner(surface, r)), _TINY))


@contract.gap_slope.register(Distance)
def _(surface, q0, q1):
    # (sqrt(q1) - sqrt(q0))/(q1 - q0) = 1/(sqrt(q0) + sqrt(q1)), which has no bound in the middle, where no wall pushes
    # and what it is multiplied with is 0. There q1, the sum of q0 and a rise, may be below 0 by round-off.
    root1 = math.sqrt(select(q1 > 0.0, q1, 0.0))
    both = math.sqrt(q0) + root1
    slope = 1.0 / select(both > _MIDDLE, both, _MIDDLE)
    return surface.side * slope, -0.5 * surface.side * slope * slope / select(root1 > _MIDDLE, root1, _MIDDLE)


class ExactChord(Record):
    """Numbers whose `chord_guess` is exact, and whose gap is a distance up to round-off."""


contract.chord_improve.register(ExactChord, lambda surface, r, p, kappa: 0.0)
contract.chord_sweeps.register(ExactChord, lambda surface: 0)
contract.distance.register(ExactChord, lambda surface, r: contract.gap_of(surface, contract.inner(surface, r)))

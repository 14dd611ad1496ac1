"""Base classes of shapes: those with a squared distance as inner function, and those with an exact chord."""

import math

import numpy as np

from ...kernel.jit import select
from ...kernel.limits import TINY
from .. import contract

# Smaller roots of an inner function are replaced by this number: the cube of its inverse is finite.
_MIDDLE = 1e-100
# A flight from farther than the root of this many times the radius first goes to a wider surface near it.
_AFAR = 1024.0


class Distance(contract.Smooth):
    """A shape with a squared distance as its inner function q: phi = sqrt(q) - radius.

    It has the fields `radius` and `radius2`, its square, and gives `inner`, and `inner_gradient` or its own `gradient`.
    """

    def phi(self, r):
        return np.sqrt(self.inner(r)) - self.radius

    def gap_of(self, q):
        return self.side * (math.sqrt(q) - self.radius)

    def level_of(self, q):
        return self.side * (q - self.radius2)

    def clearance(self, r):
        return -self.gap_of(self.inner(r))

    def grown(self, radius):
        width = self.radius - self.side * radius
        return self._replace(radius=width, radius2=width * width)

    def near_radius2(self, q):
        """radius^2 or, from afar, that of a wider surface nearby: round-off of the level is that of the distance."""
        return select(q > _AFAR * self.radius2, q * (1.0 / _AFAR), self.radius2)

    def farthest_push(self):
        # The pole of 1/(1 + kappa H), where no eigenvalue of H is above 1
        return select(self.side > 0.0, math.inf, -1.0)

    def gradient(self, r):
        # Where q = 0 the distance has no gradient, and the answer is 0.
        return self.inner_gradient(r) * (0.5 / np.maximum(np.sqrt(self.inner(r)), TINY))

    def gap_slope(self, q0, q1):
        # (sqrt(q1) - sqrt(q0))/(q1 - q0) = 1/(sqrt(q0) + sqrt(q1)) has no bound in the middle, where no wall pushes and
        # its factor is 0. There q1, the sum of q0 and a rise, may be below 0 by round-off.
        root1 = math.sqrt(select(q1 > 0.0, q1, 0.0))
        both = math.sqrt(q0) + root1
        slope = 1.0 / select(both > _MIDDLE, both, _MIDDLE)
        return self.side * slope, -0.5 * self.side * slope * slope / select(root1 > _MIDDLE, root1, _MIDDLE)


class ExactChord(contract.Smooth):
    """A shape with an exact `chord_guess`, and with a gap that is a distance up to round-off."""

    def chord_improve(self, r, p, kappa):
        return 0.0

    chord_sweeps = 0

    def distance(self, r):
        return self.gap_of(self.inner(r))

"""The tip of a cone with balls inside: the parallel surface is a cone too; its tip is farther along the axis."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ...kernel.limits import TINY
from ...kernel.vector import Vec, dot, norm, square
from ..contract import Smooth
from ..frames import Unturned
from ..shapes.plane import PlaneNumbers
from ..shapes.quadratic import QuadricNumbers


class OfTip(Unturned):
    """A surface at the tip of a cone with balls inside."""

    if TYPE_CHECKING:
        body: Any

    holds_balls = True


class TipPlane(OfTip):
    """The plane through the tip, across the axis."""

    body: PlaneNumbers
    lift: float  # for a ball the tip is farther along the axis by this part of the radius

    def grown(self, radius):
        return self._replace(body=self.body._replace(offset=self.body.offset - radius * self.lift))


class Nappes(OfTip):
    """Both nappes of the cone: flights are those to the quadric `body`; phi, the inner function, is the distance."""

    body: QuadricNumbers
    axis: Vec
    sine: float  # of the half angle
    cosine: float

    def by_right_angles(self, axes):
        """Return the nappes with their axes along these axes of the scene, or their opposites."""
        return self._replace(body=self.body.by_right_angles(axes), axis=Vec(*(axes @ np.array(self.axis)).tolist()))

    def grown(self, radius):
        return self._replace(body=self.body._replace(center=self.body.center + (radius / self.sine) * self.axis))

    def phi(self, r):
        # Also for points below the tip: the plane is the wall there.
        d = r - self.body.center
        along = dot(d, self.axis)
        across2 = square(d - along * self.axis)
        return np.sqrt(across2) * self.cosine - along * self.sine

    def gradient(self, r):
        d = r - self.body.center
        across = d - dot(d, self.axis) * self.axis
        return (self.cosine / np.maximum(np.sqrt(square(across)), TINY)) * across - self.sine * self.axis

    distance = inner = end_inner = phi
    inner_gradient = gradient

    def unit_normal(self, r):
        n = self.gradient(r)
        return n / norm(n)

    def gap_of(self, q):
        return q

    level_of = gap_of

    def gap_slope(self, q0, q1):
        return 1.0, 0.0

    discrete_gradient, resting_gradient = Smooth.discrete_gradient, Smooth.resting_gradient
    step_normal = Smooth.step_normal
    difference, gap_scale, project = Smooth.difference, Smooth.gap_scale, Smooth.project

    def out_of(self, r):
        return -self.distance(r)

    def far(self, r):
        return -self.distance(r)

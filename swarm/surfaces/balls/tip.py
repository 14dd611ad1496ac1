"""The tip of a cone that balls are in: the parallel surface is a cone too, whose tip is farther along the axis."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ...kernel.vector import Vec, dot, square
from ..frames import Framed
from ..shapes.plane import PlaneNumbers
from ..shapes.quadratic import QuadricNumbers


class Unturned(Framed):
    """A surface, the field `body`, in the frame of the scene."""

    if TYPE_CHECKING:
        body: Any

    def same(self, given):
        """What is the same in both frames."""
        return given

    place_in = end_in = velocity_in = way_in = vector_in = gravity_in = same
    place_out = end_out = normal_out = vector_out = same

    holds_balls = True

    def flat_normal(self):
        return self.body.flat_normal()


class TipPlane(Unturned):
    """The plane through the tip, across the axis."""

    body: PlaneNumbers
    lift: float  # by which part of its radius the tip is farther along the axis for a ball

    def grown(self, radius):
        return self._replace(body=self.body._replace(offset=self.body.offset - radius * self.lift))


class Nappes(Unturned):
    """Both nappes of the cone."""

    body: QuadricNumbers
    axis: Vec
    sine: float  # of the half angle
    cosine: float

    def by_right_angles(self, axes):
        """The same where its own axes are these other axes of the scene, or their opposites."""
        return self._replace(body=self.body.by_right_angles(axes), axis=Vec(*(axes @ np.array(self.axis)).tolist()))

    def grown(self, radius):
        return self._replace(body=self.body._replace(center=self.body.center + (radius / self.sine) * self.axis))

    def phi(self, r):
        # Of points below the tip too: there the plane is the wall.
        d = r - self.body.center
        along = dot(d, self.axis)
        across2 = square(d - along * self.axis)
        return np.sqrt(across2) * self.cosine - along * self.sine

    def distance(self, r):
        return self.phi(r)

    def out_of(self, r):
        return -self.distance(r)

    def far(self, r):
        return -self.distance(r)

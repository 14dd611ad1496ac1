"""Paraboloid: phi = rho^2/(4 f) - z, a quadric with a linear term."""

import itertools
import math
from dataclasses import dataclass
from typing import Any

from ...common.checks import Vector
from ...common.validated import Length
from ..balls.parallel import Parallel
from ..rotation import Direction, rotated
from ..surface import UNBOUNDED, Box, HalfSpace, farthest
from .quadratic import QuadricNumbers, quadric_numbers
from .revolved import Revolved, tangents

# Slopes of the tangent planes that stand in for the bowl
_SLOPES = (0.5, 2.0)


@dataclass(frozen=True, repr=False)
class Paraboloid(Revolved, Parallel):
    """A bowl of revolution: the space in the bowl, which is open above, or the space below it.

    Args:
        focal_length: f > 0 [m]; the vertex has the radius of curvature 2 f.
        axis: three numbers, not all 0; from the vertex into the bowl.
        center: the vertex, three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Paraboloid(focal_length=0.25).phi([[0.0, 1.0], [0.0, 0.0], [1.0, 1.0]])
    array([-1.,  0.])
    """

    nouns = ("bowl", "paraboloid", "parabola", "parabola")
    focal_length: Length
    axis: Direction = (0.0, 0.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True

    def numbers(self) -> QuadricNumbers:
        a = 0.25 / self.focal_length
        return quadric_numbers(self.own_center(), (a, a, 0.0), (0.0, 0.0, -1.0), 0.0, self.side)

    def own_tightest(self) -> tuple[float, Vector | None]:
        return (math.inf, None) if self.is_solid() else (2.0 * self.focal_length, (0.0, 0.0, 0.0))

    def framed_alike(self, wall: Any) -> Any:
        return rotated(self.turn(), wall)

    def size(self) -> float:
        return 2.0 * self.focal_length

    def bounds(self) -> Box:
        return UNBOUNDED

    def half_spaces(self) -> list[HalfSpace]:
        # rho^2/(4 f) <= z is rho - z/s <= f s for every slope s
        f = self.focal_length
        planes = (tangents(self.direction(), self.center, -1.0 / s, f * s) for s in _SLOPES)
        return [] if self.is_solid() else list(itertools.chain.from_iterable(planes))

    def extent(self) -> float:
        return farthest(self.center) + self.size()

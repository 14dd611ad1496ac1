"""Cylinder: phi = (rho^2 - R^2)/(2 R), the distance to first order; a quadric, with a slab where it has caps."""

import math
from dataclasses import dataclass
from typing import Any

from ...common.checks import Vector
from ...common.validated import Length
from ...kernel.vector import vec
from .. import rotation as rotations
from ..balls.rounded import RoundCan
from ..balls.tube import tube_of
from ..surface import TILT, Box, HalfSpace, box_around, extents, farthest, side_sign
from .quadratic import QuadricNumbers, quadric_numbers
from .revolved import Revolved, tangents
from .slab import SlabNumbers, slab_numbers
from .solid import body


@dataclass(frozen=True, repr=False)
class Cylinder(Revolved):
    """A circular cylinder, endless or capped; its cavity or the space around the solid.

    Args:
        radius: R > 0 [m].
        axis: three numbers, not all 0.
        length: None (endless), or the distance > 0 [m] between two caps, half on each side of the centre.
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Cylinder(radius=0.5, length=2.0).phi([[0.5, 0.0], [0.0, 0.0], [0.0, 1.25]])
    array([0.  , 0.25])
    """

    nouns = ("cylinder", "cylinder", "circle", "disc")
    radius: Length
    axis: rotations.Direction = (0.0, 0.0, 1.0)
    length: Length | None = None
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    is_convex = True

    @property
    def has_edges(self) -> bool:  # type: ignore[override]
        return self.length is not None

    def numbers(self) -> QuadricNumbers:
        """Return the numbers of the endless cylinder in the frame where its axis is z."""
        a = 0.5 / self.radius
        return quadric_numbers(self.own_center(), (a, a, 0.0), (0.0,) * 3, 0.5 * self.radius, self.side)

    def _caps(self, length: float) -> SlabNumbers:
        return slab_numbers(self.direction(), 0.5 * length, self.center, side_sign(self.side))

    def walls(self) -> tuple[Any, ...]:
        around = super().walls()
        if self.length is None:
            return around
        parts = (*around, self._caps(self.length))
        return parts if self.side == "inside" else (body(parts, math.hypot(*self.center)),)

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        center, side = vec(self.own_center()), side_sign(self.side)
        if self.length is not None and self.is_solid():
            can = RoundCan(center, self.radius, 0.5 * self.length, 0.0)
            return (rotations.rotated(self.turn(), can),)
        around = rotations.rotated(self.turn(), tube_of(center, self.radius, side))
        return (around,) if self.length is None else (around, self._caps(self.length))

    def size(self) -> float:
        return self.radius if self.length is None else min(self.radius, 0.5 * self.length)

    def bounds(self) -> Box:
        half = math.inf if self.length is None else 0.5 * self.length
        around = extents(rotations.matrix(self.turn()), (self.radius, self.radius, 0.0))
        along = extents(rotations.matrix(self.turn()), (0.0, 0.0, half))
        x, y, z = (a + b for a, b in zip(around, along, strict=True))
        return box_around(self.center, (x, y, z), self.side)

    def half_spaces(self) -> list[HalfSpace]:
        return [] if self.is_solid() else tangents(self.direction(), self.center, 0.0, self.radius)

    def enclosed(self, across: int | None) -> float | None:
        section, half = math.pi * self.radius**2, math.inf if self.length is None else 0.5 * self.length
        if across is None:
            return None if self.length is None else section * self.length
        if self.is_upright(across):
            return section if abs(self.center[across]) < half else None
        lies = abs(self.direction()[across]) <= TILT and self.center[across] == 0.0
        return 2.0 * self.radius * self.length if self.length is not None and lies else None

    def extent(self) -> float:
        return farthest(self.center) + math.hypot(self.radius, 0.5 * (self.length or 0.0))

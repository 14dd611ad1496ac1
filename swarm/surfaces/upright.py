"""Walls that stand upright on a plane: their normals are in the plane up to round-off, and are corrected to be in it.

In a scene of two dimensions a wall that leans by round-off would send particles off the plane, and walls that disperse
particles increase the deviation at every impact.
"""

from typing import Any

from ..kernel.vector import Vec, dot
from .rotation import Rotated
from .surface import TILT


class Upright(Rotated):
    """A turned surface, with all normals in the plane across an axis of the scene, here x."""

    across = 0

    def vector_in(self, a):
        each = self.x * a.x, self.y * a.y, self.z * a.z
        return each[self.across - 2] + each[self.across - 1]

    def vector_out(self, a):
        parts = dot(self.x, a), dot(self.y, a), dot(self.z, a)
        return Vec(*(0.0 if k == self.across else part for k, part in enumerate(parts)))

    place_in = end_in = velocity_in = way_in = vector_in
    place_out = end_out = normal_out = vector_out


class UprightY(Upright):
    """A turned surface, with all normals in the plane across y."""

    across = 1


class UprightZ(Upright):
    """A turned surface, with all normals in the plane across z."""

    across = 2


_KINDS = Upright, UprightY, UprightZ


def upright(wall: Any, across: int | None) -> Any:
    """Return a wall, or its parts, upright on the plane across an axis; None: the scene has no plane."""
    if across is None:
        return wall
    if isinstance(wall, Rotated):
        return _KINDS[across](*wall)
    if not isinstance(wall, tuple) or isinstance(wall, Vec):
        return wall
    normal = getattr(wall, "normal", None)
    if isinstance(normal, Vec) and 0.0 < abs(normal[across]) <= TILT:
        wall = wall._replace(normal=Vec(*(0.0 if k == across else part for k, part in enumerate(normal))))  # type: ignore[attr-defined]
    parts = [upright(part, across) for part in wall]
    if all(new is old for new, old in zip(parts, wall, strict=True)):
        return wall
    return tuple(parts) if type(wall) is tuple else type(wall)(*parts)

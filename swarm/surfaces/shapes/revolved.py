"""Surfaces of revolution about an axis."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common.checks import Vector
from .. import rotation as rotations
from ..surface import HalfSpace, Surface, is_along, is_on_axis

# The number of tangent planes around an axis that replace a surface of revolution when a volume's bounds are sought.
_TANGENTS = 8


class Revolved(Surface):
    """A surface of revolution, which works in the frame in which its `axis` is z."""

    axis: Vector
    center: Vector

    def turn(self) -> rotations.Quaternion | None:
        """The rotation from that frame to the scene's."""
        return rotations.after(self.rotation, rotations.onto(self.axis))

    def direction(self) -> Vector:
        """The axis in the scene."""
        return rotations.turned(self.rotation, self.axis)

    def own_frame(self) -> tuple[NDArray[np.float64], dict[str, Any]]:
        return rotations.matrix(self.turn()), {"axis": (0.0, 0.0, 1.0)}

    def own_center(self) -> Vector:
        return rotations.turned_back(self.turn(), self.center)

    def is_unturned_by(self, axis: Vector, center: Vector) -> bool:
        return is_along(self.direction(), axis) and is_on_axis(self.center, axis, center)

    def is_upright(self, across: int) -> bool:
        """Whether the axis of revolution is along the axis `across` of the scene."""
        x, y, z = np.eye(3)[across].tolist()
        return is_along(self.direction(), (x, y, z))

    def walls(self) -> tuple[Any, ...]:
        return (rotations.rotated(self.turn(), self.numbers()),)


def tangents(axis: Vector, through: Vector, lean: float, offset: float) -> list[HalfSpace]:
    """Return half-spaces (u + lean axis).(r - through) <= offset for directions u all around a unit vector."""
    frame = rotations.matrix(rotations.onto(axis))
    found = []
    for angle in np.linspace(0.0, 2.0 * math.pi, _TANGENTS, endpoint=False):
        normal = rotations.product(frame, (math.cos(angle), math.sin(angle), lean))
        x, y, z = (normal / math.hypot(1.0, lean)).tolist()
        found.append(((x, y, z), offset / math.hypot(1.0, lean) + x * through[0] + y * through[1] + z * through[2]))
    return found

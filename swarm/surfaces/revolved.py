"""What surfaces of revolution have in common: an axis."""

from typing import Any

from ..checks import Vector
from . import base
from . import rotation as rotations


class Revolved(base.Surface):
    """A surface of revolution, which works in the frame in which its `axis` is z."""

    axis: Vector
    center: Vector

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "axis", rotations.unit("axis", self.axis))

    def turn(self) -> rotations.Quaternion | None:
        """From that frame to the scene's."""
        return rotations.after(self.rotation, rotations.onto(self.axis))

    def direction(self) -> Vector:
        """The axis in the scene."""
        return rotations.turned(self.rotation, self.axis)

    def own_center(self) -> Vector:
        return rotations.turned_back(self.turn(), self.center)

    def walls(self) -> tuple[Any, ...]:
        return (rotations.rotated(self.turn(), self.numbers()),)

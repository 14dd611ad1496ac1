"""Motions of led points and of walls: those that a user gives, and the poses of walls that follow."""

from .given import Led, Motion, Oscillation, Rotation, Sum, Translation, led, parts_of, unit_axis
from .wall import Guide, Path, Placed, Pose, WallMotion, parts_of_wall, pose, require_freedom, speed_at_start, table_of

__all__ = [
    "Guide", "Led", "Motion", "Oscillation", "Path", "Placed", "Pose", "Rotation", "Sum", "Translation", "WallMotion",
    "led", "parts_of", "parts_of_wall", "pose", "require_freedom", "speed_at_start", "table_of", "unit_axis",
]  # fmt: skip

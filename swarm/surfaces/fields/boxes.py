"""Boxes: many bricks, each at its place, with its widths and rotation."""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..shapes.box import Box
from ..surface import Surface
from .many import Many


@dataclass(frozen=True, repr=False, eq=False)
class Boxes(Many):
    """Many solid boxes, one surface; the space outside of all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, half_x, half_y, half_z
    and optionally q_w, q_x, q_y, q_z.

    Args:
        centers: (n, 3) [m], one row a box.
        half_widths: (n, 3) or three numbers for all, above 0 [m].
        rotations: None, or (n, 4), a quaternion (w, x, y, z) of any length for each, about its centre.
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next one.

    >>> Boxes([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], (0.25, 0.25, 0.25)).phi([[0.25, 0.5], [0.0, 0.0], [0.0, 0.0]])
    array([0.  , 0.25])
    """

    kind: ClassVar[type[Surface]] = Box
    centers: Any
    half_widths: Any
    rotations: Any = None
    side: str = "outside"

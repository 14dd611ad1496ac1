"""Boxes: many bricks, each at its place, with its widths and rotation."""

from dataclasses import dataclass
from typing import Any

from ...rows import bodies, quaternions, widths
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

    centers: Any
    half_widths: Any
    rotations: Any = None
    side: str = "outside"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "centers", bodies("centers", self.centers))
        object.__setattr__(self, "half_widths", widths("half_widths", self.half_widths, len(self)))
        if self.rotations is not None:
            object.__setattr__(self, "rotations", quaternions("rotations", self.rotations, len(self)))

    def solids(self) -> list[Surface]:
        turns = [None] * len(self) if self.rotations is None else self.rotations.tolist()
        each = zip(self.half_widths.tolist(), self.centers.tolist(), turns, strict=True)
        return [Box(half, center, self.side, rotation=turn) for half, center, turn in each]

"""Ellipsoids: many grains, each at its place, with its semi-axes and rotation."""

from dataclasses import dataclass
from typing import Any

from ...rows import bodies, quaternions, widths
from ..shapes.ellipsoid import Ellipsoid
from ..surface import Surface
from .many import Many


@dataclass(frozen=True, repr=False, eq=False)
class Ellipsoids(Many):
    """Many solid ellipsoids, one surface; the space outside of all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, a, b, c
    and optionally q_w, q_x, q_y, q_z.

    Args:
        centers: (n, 3) [m], one row an ellipsoid.
        semi_axes: (n, 3) or three numbers for all, above 0 [m].
        rotations: None, or (n, 4), a quaternion (w, x, y, z) of any length for each, about its centre.
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next one.

    >>> Ellipsoids([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], (0.25, 0.25, 0.5)).phi([[0.25, 1.0], [0.0, 0.0], [0.0, 0.5]])
    array([0., 0.])
    """

    centers: Any
    semi_axes: Any
    rotations: Any = None
    side: str = "outside"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "centers", bodies("centers", self.centers))
        object.__setattr__(self, "semi_axes", widths("semi_axes", self.semi_axes, len(self)))
        if self.rotations is not None:
            object.__setattr__(self, "rotations", quaternions("rotations", self.rotations, len(self)))

    def solids(self) -> list[Surface]:
        turns = [None] * len(self) if self.rotations is None else self.rotations.tolist()
        each = zip(self.semi_axes.tolist(), self.centers.tolist(), turns, strict=True)
        return [Ellipsoid(semi_axes, center, self.side, rotation=turn) for semi_axes, center, turn in each]

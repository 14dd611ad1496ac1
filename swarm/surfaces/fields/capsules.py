"""Capsules: many rods with round ends, each at its place, with its radius, length and axis."""

from dataclasses import dataclass
from typing import Any

from ...rows import bodies, directions, lengths
from ..shapes.capsule import Capsule
from ..surface import Surface
from .many import Many


@dataclass(frozen=True, repr=False, eq=False)
class Capsules(Many):
    """Many solid capsules, one surface; the space outside of all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, radius, length
    and optionally axis_x, axis_y, axis_z.

    Args:
        centers: (n, 3) [m], one row a capsule.
        radii: (n,) or one number for all, above 0 [m].
        lengths: of the straight parts, (n,) or one number for all, above 0 [m].
        axes: (n, 3) or three numbers for all, not all 0.
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next one.

    >>> Capsules([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0.25, 0.5).phi([[0.25], [0.0], [0.2]])
    array([0.])
    """

    centers: Any
    radii: Any
    lengths: Any
    axes: Any = (0.0, 0.0, 1.0)
    side: str = "outside"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "centers", bodies("centers", self.centers))
        object.__setattr__(self, "radii", lengths("radii", self.radii, len(self)))
        object.__setattr__(self, "lengths", lengths("lengths", self.lengths, len(self)))
        object.__setattr__(self, "axes", directions("axes", self.axes, len(self)))

    def solids(self) -> list[Surface]:
        each = zip(self.radii.tolist(), self.lengths.tolist(), self.axes.tolist(), self.centers.tolist(), strict=True)
        return [Capsule(radius, length, axis, center, self.side) for radius, length, axis, center in each]

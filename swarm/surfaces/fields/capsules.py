"""Capsules: many rods with round ends, each at its place, with its radius, length and axis."""

from dataclasses import dataclass
from typing import Any, ClassVar

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

    kind: ClassVar[type[Surface]] = Capsule
    centers: Any
    radii: Any
    lengths: Any
    axes: Any = (0.0, 0.0, 1.0)
    side: str = "outside"

"""Cylinders: many posts or rods, each at its place, with its radius and axis."""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..shapes.cylinder import Cylinder
from ..surface import Surface
from .many import Many


@dataclass(frozen=True, repr=False, eq=False)
class Cylinders(Many):
    """Many solid cylinders, endless or capped, one surface; the space outside of all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, radius
    and optionally axis_x, axis_y, axis_z, length.

    Args:
        centers: (n, 3) [m], one row a cylinder.
        radii: (n,) or one number for all, above 0 [m].
        axes: (n, 3) or three numbers for all, not all 0.
        lengths: None (endless), or (n,) or one number for all, the distances above 0 [m] between the caps.
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next one. One that is endless along no axis of the scene is in all cells.

    >>> Cylinders([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0.25).phi([[0.25], [0.0], [7.0]])
    array([0.])
    """

    kind: ClassVar[type[Surface]] = Cylinder
    centers: Any
    radii: Any
    axes: Any = (0.0, 0.0, 1.0)
    lengths: Any = None
    side: str = "outside"

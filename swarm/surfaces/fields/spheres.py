"""Spheres: many balls, each at its place and with its radius."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ...kernel.vector import vec
from ..shapes.sphere import Sphere, ball
from ..surface import Surface
from .many import Floats, Many, field_of
from .members import Members, aligned


@dataclass(frozen=True, repr=False, eq=False)
class Spheres(Many):
    """Many solid balls, one surface; the space outside of all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, radius.

    Args:
        centers: (n, 3) [m], one row a ball.
        radii: (n,) or one number for all, above 0 [m].
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next ball: see `python -m bench fields`; memory and time to build linear in n.

    >>> Spheres([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0.25).phi([[0.25, 0.6], [0.0, 0.0], [0.0, 0.0]])
    array([0.  , 0.15])
    """

    kind: ClassVar[type[Surface]] = Sphere
    centers: Any
    radii: Any
    side: str = "outside"

    def size(self) -> float:
        return float(self.radii.min())

    def extent(self) -> float:
        return float((np.abs(self.centers).max(axis=1) + self.radii).max())

    def corners(self) -> tuple[Floats, Floats]:
        return self.centers.T - self.radii, self.centers.T + self.radii

    @cached_property
    def members(self) -> Members:
        """What kernels take."""
        table = aligned(np.column_stack([self.centers, self.radii]))
        return field_of(ball(vec(table[0, :3]), table[0, 3]), table, self.corners, self.repeated)

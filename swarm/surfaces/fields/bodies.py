"""The fields of bodies by their kind: each body with its place, its size and its rotation or axis."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ...kernel.arrays import aligned_copy
from ...kernel.vector import vec
from ...state import Floats
from ..shapes.box import Box
from ..shapes.capsule import Capsule
from ..shapes.cylinder import Cylinder
from ..shapes.ellipsoid import Ellipsoid
from ..shapes.sphere import Sphere, ball, cavity
from ..surface import Surface
from .foam import Foam
from .many import ManyBodies, field_of
from .members import Members

# The number of points of a circle in a plane.
_CIRCLE = 97


@dataclass(frozen=True, repr=False, eq=False)
class Spheres(ManyBodies):
    """Many balls, one surface: the space outside all of them, or a foam of cavities.

    Solid ones may overlap one another, and reach through other walls. With side="inside" particles are in any of them,
    and pass from one into another where both overlap: bubbles of a foam, pores; the only surface of a scene.
    Particles with a radius meet a foam of at most 64 bubbles.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, radius.

    Args:
        centers: (n, 3) [m], one row a ball.
        radii: (n,) or one number for all, above 0 [m].
        side: "outside" or "inside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next ball: see `python -m bench fields`; memory and time to build linear in n.

    >>> Spheres([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0.25).phi([[0.25, 0.6], [0.0, 0.0], [0.0, 0.0]])
    array([0.  , 0.15])
    """

    nouns = ("bubble", "ball", "bubble", "disc")
    kind: ClassVar[type[Surface]] = Sphere
    may_be_foam: ClassVar[bool] = True
    centers: Any
    radii: Any
    side: str = "outside"

    def size(self) -> float:
        return float(self.radii.min())

    def extent(self) -> float:
        return float((np.abs(self.centers).max(axis=1) + self.radii).max())

    def corners(self) -> tuple[Floats, Floats]:
        return self.centers.T - self.radii, self.centers.T + self.radii

    def rooms_of_balls(self) -> tuple[Any, ...]:
        if not self.is_foam():
            return self.rooms
        rows = zip(self.centers.tolist(), self.radii.tolist(), strict=True)
        return tuple((Sphere(radius, center, "inside", **self.common()),) for center, radius in rows)

    def largest_ball(self) -> float:
        return float(self.radii.min()) if self.is_foam() else super().largest_ball()

    @cached_property
    def members(self) -> Members:
        field = self._field(None)
        return field if self.is_solid() else Foam(*field)

    def halves(self) -> Floats | None:
        return None if self.is_foam() else np.repeat(self.radii[:, None], 3, axis=1)

    def plane_curves(self, across: int) -> list[Floats]:
        angle = np.linspace(0.0, 2.0 * np.pi, _CIRCLE)
        circle = np.zeros((_CIRCLE, 3))
        circle[:, (across + 1) % 3], circle[:, (across + 2) % 3] = np.cos(angle), np.sin(angle)
        return [center + radius * circle for center, radius in zip(self.centers, self.radii, strict=True)]

    def _members_of_balls(self, largest: float) -> Members:
        return self._field(largest)

    def _field(self, largest: float | None) -> Members:
        table = aligned_copy(np.column_stack([self.centers, self.radii]))
        made = ball if self.is_solid() else cavity
        return field_of(made(vec(table[0, :3]), table[0, 3]), table, self.corners, self.repeated, largest)


@dataclass(frozen=True, repr=False, eq=False)
class Cylinders(ManyBodies):
    """Many solid cylinders, endless or capped, one surface; the space outside all of them.

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

    Cost: a grid of cells finds the next cylinder. One that is endless along no axis of the scene is in all cells.

    >>> Cylinders([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0.25).phi([[0.25], [0.0], [7.0]])
    array([0.])
    """

    nouns = ("cylinder", "peg", "cylinder", "peg")
    kind: ClassVar[type[Surface]] = Cylinder
    centers: Any
    radii: Any
    axes: Any = (0.0, 0.0, 1.0)
    lengths: Any = None
    side: str = "outside"

    @property
    def has_edges(self) -> bool:  # type: ignore[override]
        return self.lengths is not None

    def halves(self) -> Floats | None:
        return None if self.lengths is None else np.stack([self.radii, self.radii, 0.5 * self.lengths], axis=1)


@dataclass(frozen=True, repr=False, eq=False)
class Capsules(ManyBodies):
    """Many solid capsules, one surface; the space outside all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, radius, length
    and optionally axis_x, axis_y, axis_z.

    Args:
        centers: (n, 3) [m], one row a capsule.
        radii: (n,) or one number for all, above 0 [m].
        lengths: lengths of the straight parts, (n,) or one number for all, above 0 [m].
        axes: (n, 3) or three numbers for all, not all 0.
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next capsule.

    >>> Capsules([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0.25, 0.5).phi([[0.25], [0.0], [0.2]])
    array([0.])
    """

    nouns = ("capsule", "rod", "capsule", "rod")
    kind: ClassVar[type[Surface]] = Capsule
    centers: Any
    radii: Any
    lengths: Any
    axes: Any = (0.0, 0.0, 1.0)
    side: str = "outside"

    def halves(self) -> Floats:
        return np.stack([self.radii, self.radii, 0.5 * self.lengths + self.radii], axis=1)


@dataclass(frozen=True, repr=False, eq=False)
class Boxes(ManyBodies):
    """Many solid boxes, one surface; the space outside all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, half_x, half_y, half_z
    and optionally q_w, q_x, q_y, q_z.

    Args:
        centers: (n, 3) [m], one row a box.
        half_widths: (n, 3) or three numbers for all, above 0 [m].
        rotations: None, or for each, about its centre, a quaternion (w, x, y, z) of any length (n, 4) or the rows of a
            rotation matrix (n, 3, 3).
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next box.

    >>> Boxes([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], (0.25, 0.25, 0.25)).phi([[0.25, 0.5], [0.0, 0.0], [0.0, 0.0]])
    array([0.  , 0.25])
    """

    nouns = ("box", "block", "rectangle", "block")
    kind: ClassVar[type[Surface]] = Box
    centers: Any
    half_widths: Any
    rotations: Any = None
    side: str = "outside"

    has_edges = True

    def halves(self) -> Floats:
        return np.asarray(self.half_widths)


@dataclass(frozen=True, repr=False, eq=False)
class Ellipsoids(ManyBodies):
    """Many solid ellipsoids, one surface; the space outside all of them.

    They may overlap one another, and reach through other walls.

    In a scene file: the arguments, or from = "packing.csv" with the columns x, y, z, a, b, c
    and optionally q_w, q_x, q_y, q_z.

    Args:
        centers: (n, 3) [m], one row an ellipsoid.
        semi_axes: (n, 3) or three numbers for all, above 0 [m].
        rotations: None, or for each, about its centre, a quaternion (w, x, y, z) of any length (n, 4) or the rows of a
            rotation matrix (n, 3, 3).
        side: "outside".

    Raises:
        SceneError: an argument is out of its range.

    Cost: a grid of cells finds the next ellipsoid.

    >>> Ellipsoids([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], (0.25, 0.25, 0.5)).phi([[0.25, 1.0], [0.0, 0.0], [0.0, 0.5]])
    array([0., 0.])
    """

    nouns = ("ellipsoid", "egg", "ellipse", "oval")
    kind: ClassVar[type[Surface]] = Ellipsoid
    centers: Any
    semi_axes: Any
    rotations: Any = None
    side: str = "outside"

    def halves(self) -> Floats:
        return np.asarray(self.semi_axes)

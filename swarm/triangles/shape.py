"""A wall to draw: triangles, their area, edges, and curves at some heights."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..motion import WallMotion
from ..state import Floats
from ..surfaces.union import Place
from . import curves

# The number of heights at which levels are drawn, of which a shape has at least the second number, or else its own; and
# the triangles above which many bodies have no levels.
_LEVELS, _FEW, _MOST = 6, 3, 100_000
# Triangles with normals that differ from the vertical by less than this lie on a level.
_UPRIGHT = 1e-6


@dataclass(frozen=True)
class Shape:
    """The part of one surface that is a wall of the volume.

    Attributes:
        name: its number and kind, such as "0_ellipsoid"; for a part of a union "0_union_1_cylinder".
        surface: the number of the surface in the scene; place: the number of the part in the surface.
        motion: the motion of its own that a part of a union has; else None, and the shape moves with the surface.
        solid: whether particles are kept out of it.
        vertices, triangles, normals: (V, 3) [m], (T, 3), (V, 3).
        edges: curves (k, 3) [m]: creases, rims, and the ends of openings.
        height: the height of the ribbon of triangles in a two-dimensional scene [m]; else None.
        many: whether the shape shows many bodies.
        levels: its curves at some heights, which are the same for all shapes.
        members: for each triangle the number of its body, or of its triangle of a mesh; None where there is neither.
    """

    name: str
    solid: bool
    vertices: Floats
    triangles: NDArray[np.int64]
    normals: Floats
    edges: list[Floats]
    height: float | None = None
    surface: int = 0
    place: Place = ()
    motion: WallMotion | None = None
    many: bool = False
    levels: list[Floats] = field(default_factory=list)
    members: NDArray[np.int64] | None = None

    @property
    def wires(self) -> list[Floats]:
        """All of its curves: edges and levels."""
        return self.edges + self.levels

    def area(self) -> float:
        """The area of the triangles [m^2]; in a scene of two dimensions the length of the curves [m]."""
        return self._area

    @cached_property
    def _area(self) -> float:
        if self.height is not None:
            return float(sum(np.sqrt((np.diff(curve, axis=0) ** 2).sum(axis=1)).sum() for curve in self.edges))
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return float(0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).sum())

    def moved(self, turn: Floats, way: Floats) -> "Shape":
        """Return the shape moved so that its point at x comes to turn x + way."""
        placed = [[curve @ turn.T + way for curve in of] for of in (self.edges, self.levels)]
        return replace(self, vertices=self.vertices @ turn.T + way, normals=self.normals @ turn.T,
                       edges=placed[0], levels=placed[1])  # fmt: skip


def levelled(shapes: list[Shape]) -> list[Shape]:
    """Return the shapes with their levels, between the lowest and the highest point of all of them."""
    ends = [(shape.vertices[:, 2].min(), shape.vertices[:, 2].max()) for shape in shapes if len(shape.vertices)]
    if not ends:
        return shapes
    low, high = min(a for a, _b in ends), max(b for _a, b in ends)
    heights = np.linspace(low, high, _LEVELS + 2)[1:-1]
    return [
        shape if shape.many and len(shape.triangles) > _MOST else replace(shape, levels=_levels(shape, heights))
        for shape in shapes
    ]


def _levels(shape: Shape, heights: Floats) -> list[Floats]:
    """Return the curves at these heights, without walls that lie on one of them."""
    if not len(shape.vertices):
        return []
    low, high = shape.vertices[:, 2].min(), shape.vertices[:, 2].max()
    if ((low < heights) & (heights < high)).sum() < _FEW:
        heights = np.linspace(low, high, _LEVELS + 2)[1:-1]
    steep = np.abs(shape.normals[:, 2]) < 1.0 - _UPRIGHT
    return curves.levels(shape.vertices, shape.triangles[steep[shape.triangles].any(axis=1)], heights)

"""Walls that stand on an outline: `Polygon`, `Stadium`, and `Prism`, which has lids."""

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from ...common.checks import Vector
from ...common.validated import Length, NotNegative
from ...errors import SceneError
from ..rotation import Direction
from .outline import Outline
from .outlined import Outlined


def _rows(name: str, value: Any) -> tuple[tuple[float, ...], ...]:
    """Return `value` as the rows of an outline, without bulges that are 0."""
    return tuple(row if row[2] else row[:2] for row in Outline(name, value).rows)


@dataclass(frozen=True, repr=False)
class Polygon(Outlined):
    """Walls that stand on an outline of lines and arcs, endless along an axis: the space within, or around it.

    Any outline that does not cross itself: also one that is not convex. In the plane of a scene with `plane` it is a
    billiard table; in space a shaft.

    Args:
        vertices: rows (x, y) or (x, y, bulge) [m], at least three, or two and an arc. As in DXF the bulge of the side
            that begins at a vertex is tan(angle/4) of its arc: 0 a line, 1 a half circle; above 0 it turns to the left,
            and so bulges outwards where the vertices go round counter-clockwise. A ring with its first vertex
            repeated at its end, as shapely writes it, is the same outline.
        axis: across the outline; three numbers, not all 0. Seen from its tip x and y of the vertices are to the right
            and upwards: along x and y of the scene for z, along y and z for x, along z and x for y.
        center: the origin of the vertices, three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range, or the outline crosses itself.

    >>> Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]).phi([[0.5, 1.5], [1.5, 1.5], [0.0, 9.0]])
    array([-0.5,  0.5])
    """

    nouns = ("polygon", "polygonal column", "polygon", "polygon")
    vertices: Annotated[Any, _rows]
    axis: Direction = (0.0, 0.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    given: ClassVar[str] = "vertices"


@dataclass(frozen=True, repr=False)
class Stadium(Outlined):
    """Bunimovich's stadium: two half circles and two lines between them, endless along an axis.

    Args:
        radius: of the half circles, above 0 [m].
        length: of each line, along x of the outline's plane, 0 or more [m].
        axis: across the outline, as for `Polygon`.
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Stadium(radius=1.0, length=2.0).phi([[0.0, 3.0], [0.0, 0.0], [0.0, 0.0]])
    array([-1.,  1.])
    """

    nouns = ("stadium", "stadium column", "stadium", "stadium")
    radius: Length
    length: NotNegative
    axis: Direction = (0.0, 0.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def rows(self) -> Any:
        half, r = 0.5 * self.length, self.radius
        if half <= 1e-9 * r:
            return [(0.0, -r, 1.0), (0.0, r, 1.0)]
        return [(-half, -r), (half, -r, 1.0), (half, r), (-half, r, 1.0)]


@dataclass(frozen=True, repr=False)
class Prism(Outlined):
    """The space within an outline of lines and arcs, between two lids across its axis.

    Args:
        outline: rows (x, y) or (x, y, bulge) [m], as the vertices of `Polygon`.
        height: the distance between the lids, half on each side of the centre, above 0 [m].
        axis: across the outline, as for `Polygon`.
        center: three numbers [m].
        side: "inside".

    Raises:
        SceneError: an argument is out of its range, or the outline crosses itself.

    >>> Prism([(0, 0), (1, 0), (0, 1)], height=2.0).phi([[0.25], [0.25], [1.5]])
    array([0.5])
    """

    nouns = ("prism", "prism", "prism", "prism")
    outline: Annotated[Any, _rows]
    height: Length = field()
    axis: Direction = (0.0, 0.0, 1.0)
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side != "inside":
            raise SceneError(
                f'side must be "inside" for a Prism, got {self.side!r}; for a solid that reaches through its vessel '
                "use a Polygon, for a bounded one a union or a mesh"
            )

"""Points of surfaces, uniform in their area, or in their length in a plane.

A surface is pieces from each of which points can be drawn exactly. From spheres, tori, triangles and outlines they are
drawn as they are. Any other piece is a quadric or a plane: lines that are uniform and isotropic in a ball, or in a
plane in a disc, meet every piece of an area equally often (Crofton), however it is turned.
"""

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..kernel.vector import vec
from ..surfaces.facets.mesh import Mesh
from ..surfaces.fields.many import Many
from ..surfaces.outlines.outlined import Outlined
from ..surfaces.outlines.polygon import Prism
from ..surfaces.plane import along
from ..surfaces.rotation import matrix
from ..surfaces.shapes.capsule import Capsule
from ..surfaces.shapes.plane import PlaneNumbers
from ..surfaces.shapes.quadratic import QuadricNumbers
from ..surfaces.shapes.slab import SlabNumbers
from ..surfaces.shapes.solid import SolidNumbers
from ..surfaces.shapes.sphere import Sphere, SphereNumbers
from ..surfaces.shapes.torus import Torus
from ..surfaces.surface import Surface
from ..surfaces.union import Joined

Floats = NDArray[np.float64]
Random = np.random.Generator
Bounds = tuple[Floats, Floats]
Draw = Callable[[Random, int], Floats]
Placed = Callable[[Floats, Floats], Floats]


# A point that is drawn is as near to its surface, of its extent.
NEAR = 1e-10


class Piece(NamedTuple):
    """A part of a surface.

    Attributes:
        area: of what points are drawn from, so that those of pieces drawn in proportion to it are uniform in all.
        draw: so many points (3, n), NaN where a line meets nothing.
    """

    area: float
    draw: Draw


def pieces_of(surface: Surface, bounds: Bounds, across: int | None) -> list[Piece]:
    """The pieces of a surface, as far as they are within the bounds; in a plane the axis `across` it is given.

    Raises:
        SceneError: the pieces of this kind of surface are not known, or the surface is not bounded.
    """
    if isinstance(surface, Joined):
        # One that several rooms have is drawn once.
        parts = dict.fromkeys(surface.surfaces())
        return [_of_part(one, piece) for one in parts for piece in pieces_of(one, bounds, across)]
    if isinstance(surface, Many) and not isinstance(surface, (Mesh, Outlined)):
        return [part for one in surface.solids() for part in pieces_of(one, bounds, across)]
    found = list(_drawn_as_they_are(surface, bounds, across))
    return found or list(_of_lines(surface, bounds, across))


def _of_part(part: Surface, piece: Piece) -> Piece:
    """A piece of a part of a union as far as it is on that part: what goes on beyond it may be a wall of another."""

    def draw(random: Random, n: int) -> Floats:
        points = piece.draw(random, n)
        known = np.isfinite(points).all(axis=0)
        off = np.abs(distances(part, points[:, known])) > NEAR * part.extent()
        points[:, np.flatnonzero(known)[off]] = np.nan
        return points

    return piece._replace(draw=draw)


def distances(surface: Surface, points: Floats) -> Floats:
    """Distances of points from a surface to first order, above 0 outside."""
    slopes = np.sqrt((surface.gradient(points) ** 2).sum(axis=0))
    return np.asarray(surface.phi(points) / np.maximum(slopes, np.finfo(np.float64).tiny))


def points_of(pieces: list[Piece], random: Random, n: int) -> Floats:
    """So many points at most of pieces, uniform in their areas, in random order."""
    areas = np.array([piece.area for piece in pieces])
    counts = random.multinomial(n, areas / areas.sum()) if len(pieces) > 1 else np.array([n])
    drawn = [piece.draw(random, int(count)) for piece, count in zip(pieces, counts, strict=True) if count]
    points = np.concatenate(drawn, axis=1)
    if len(pieces) > 1:
        points = points[:, random.permutation(points.shape[1])]
    return points[:, np.isfinite(points).all(axis=0)]


def directions(random: Random, n: int) -> Floats:
    """Unit vectors uniform on the sphere, (3, n)."""
    normal = random.standard_normal((3, n))
    return np.asarray(normal / np.sqrt((normal**2).sum(axis=0)))


# --- As they are -----------------------------------------------------------------------------------------


def _drawn_as_they_are(surface: Surface, bounds: Bounds, across: int | None) -> Iterator[Piece]:
    if isinstance(surface, Outlined):
        yield from _of_outline(surface, bounds, across)
    elif across is not None:
        return
    elif isinstance(surface, Sphere):
        center, radius = np.array(surface.center)[:, None], surface.radius
        yield Piece(4.0 * math.pi * radius**2, lambda random, n: center + radius * directions(random, n))
    elif isinstance(surface, Capsule):
        yield from _of_capsule(surface)
    elif isinstance(surface, Torus):
        yield Piece(
            4.0 * math.pi**2 * surface.major_radius * surface.minor_radius,
            lambda random, n: _on_torus(surface, random, n),
        )
    elif isinstance(surface, Mesh):
        yield _of_triangles(np.asarray(surface.vertices), np.asarray(surface.triangles))


def _of_capsule(surface: Capsule) -> Iterator[Piece]:
    axis = np.array(surface.direction())[:, None]
    center, radius, length = np.array(surface.center)[:, None], surface.radius, surface.length
    frame = _frame(axis[:, 0])

    def ends(random: Random, n: int) -> Floats:
        out = directions(random, n)
        return np.asarray(center + radius * out + 0.5 * length * axis * np.sign((out * axis).sum(axis=0)))

    def around(random: Random, n: int) -> Floats:
        angle, along_it = 2.0 * math.pi * random.random(n), length * (random.random(n) - 0.5)
        return np.asarray(center + frame @ np.array([radius * np.cos(angle), radius * np.sin(angle), along_it]))

    yield Piece(4.0 * math.pi * radius**2, ends)
    yield Piece(2.0 * math.pi * radius * length, around)


def _on_torus(surface: Torus, random: Random, n: int) -> Floats:
    """Points of a torus: the nearer to its axis, the less area."""
    large, small = surface.major_radius, surface.minor_radius
    tube = np.empty(0)
    while len(tube) < n:
        trial = 2.0 * math.pi * random.random(2 * n + 16)
        tube = np.append(tube, trial[random.random(len(trial)) * (large + small) < large + small * np.cos(trial)])
    tube, around = tube[:n], 2.0 * math.pi * random.random(n)
    rho = large + small * np.cos(tube)
    points = np.array([rho * np.cos(around), rho * np.sin(around), small * np.sin(tube)])
    turn = np.eye(3) if surface.rotation is None else matrix(surface.rotation)
    return np.asarray(np.array(surface.center)[:, None] + turn @ points)


def _of_triangles(vertices: Floats, triangles: NDArray[Any]) -> Piece:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    areas = 0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))

    def draw(random: Random, n: int) -> Floats:
        k = random.choice(len(areas), n, p=areas / areas.sum())
        u, w = random.random((2, n))
        beyond = u + w > 1.0
        u, w = np.where(beyond, 1.0 - u, u)[:, None], np.where(beyond, 1.0 - w, w)[:, None]
        return np.asarray((a[k] + u * (b[k] - a[k]) + w * (c[k] - a[k])).T)

    return Piece(float(areas.sum()), draw)


def _of_outline(surface: Outlined, bounds: Bounds, across: int | None) -> Iterator[Piece]:
    """The sides of an outline and, of a prism, its lids."""
    frame = surface.frame
    corners = np.array([[bounds[i >> k & 1][k] for k in range(3)] for i in range(8)]).T
    heights = frame[:, 2] @ corners
    low, high = (0.0, 0.0) if across is not None else (float(heights.min()), float(heights.max()))
    middle = float(frame[:, 2] @ np.array(getattr(surface, "center", (0.0, 0.0, 0.0))))
    if isinstance(surface, Prism):
        low, high = max(low, middle - 0.5 * surface.height), min(high, middle + 0.5 * surface.height)
    rows = np.array(surface.boundary.rows, np.float64)
    width = 1.0 if across is not None else high - low

    def placed(flat: Floats, height: Floats) -> Floats:
        at = surface.placed(flat)
        return np.asarray(at + np.outer(frame[:, 2], height - frame[:, 2] @ at))

    for begin, end in zip(rows, np.roll(rows, -1, axis=0), strict=True):
        length, path = _side(begin, end)
        yield Piece(length * width, _on_side(path, placed, low, high))
    if isinstance(surface, Prism) and across is None:
        lows, highs = surface.boundary.corners()
        least, most = lows.min(axis=1), highs.max(axis=1)
        for height in (middle - 0.5 * surface.height, middle + 0.5 * surface.height):
            yield Piece(float(np.prod(most - least)), _on_lid(least[:, None], most[:, None], placed, height))


def _on_side(path: Callable[[Floats], Floats], placed: Placed, low: float, high: float) -> Draw:
    return lambda random, n: placed(path(random.random(n)), low + (high - low) * random.random(n))


def _on_lid(least: Floats, most: Floats, placed: Placed, height: float) -> Draw:
    return lambda random, n: placed(least + (most - least) * random.random((2, n)), np.full(n, height))


def _side(begin: Floats, end: Floats) -> tuple[float, Callable[[Floats], Floats]]:
    """The length of a side of an outline, a line or an arc, and its points at parts of it."""
    a, b, bulge = begin[:2], end[:2], float(begin[2])
    chord = float(np.hypot(*(b - a)))
    if bulge == 0.0:
        return chord, lambda part: a[:, None] + (b - a)[:, None] * part
    angle = 4.0 * math.atan(bulge)
    radius = chord / (2.0 * abs(math.sin(0.5 * angle)))
    # To the left of the chord where the arc turns to the left by less than a half turn.
    left = np.array([a[1] - b[1], b[0] - a[0]])
    center = 0.5 * (a + b) + left * (0.5 / math.tan(0.5 * angle))
    first = math.atan2(*(a - center)[::-1])
    return radius * abs(
        angle
    ), lambda part: center[:, None] + radius * np.array([np.cos(first + angle * part), np.sin(first + angle * part)])


def _frame(axis: Floats) -> Floats:
    """Three unit vectors across one another as columns, the last along the axis."""
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.sqrt((first**2).sum())
    return np.array([first, np.cross(axis, first), axis]).T


# --- By lines --------------------------------------------------------------------------------------------


def _of_lines(surface: Surface, bounds: Bounds, across: int | None) -> Iterator[Piece]:
    own = replace(surface, side="inside") if surface.is_solid() else surface  # type: ignore[call-arg]
    low, high = (np.array(corner, np.float64) for corner in own.bounds())
    low, high = np.maximum(low, bounds[0]), np.minimum(high, bounds[1])
    if not np.isfinite(high - low).all():
        raise SceneError(
            f"where must be bounded, got {surface!r:.200} in a scene that is open to infinity; give within=, a surface "
            "that bounds the part of it from which particles come"
        )
    if (high < low).any():
        return
    center, radius = 0.5 * (low + high)[:, None], 0.5 * float(np.sqrt(((high - low) ** 2).sum()))
    radius *= 1.0 + 1e-9
    for wall in _smooth(surface):
        levels = _levels_of(wall)
        if levels is None:
            raise SceneError(
                f"where must be a surface of which points can be drawn exactly, got {type(surface).__name__}; give one "
                "of spheres, cylinders, boxes, planes, quadrics, outlines or meshes, or volume=True"
            )
        roots = 1 if isinstance(wall, PlaneNumbers) else 2
        half = roots * (math.pi * radius if across is not None else 2.0 * math.pi * radius**2)
        yield Piece(half, functools.partial(_met, levels, roots, (center, radius, across)))


def _smooth(surface: Surface) -> list[Any]:
    """The smooth walls of a surface as records."""
    found = []
    for wall in surface.walls():
        found += list(wall.parts) if isinstance(wall, SolidNumbers) else [wall]
    return found


def _levels_of(wall: Any) -> Callable[[Floats], Floats] | None:
    """A polynomial of the second degree that is 0 on a wall, at points (3, n); None where it is not known."""
    body = getattr(wall, "body", wall)
    if isinstance(body, (SlabNumbers, SphereNumbers)):
        return lambda points: body.inner(vec(points)) - body.radius2
    if isinstance(body, (PlaneNumbers, QuadricNumbers)):
        return lambda points: wall.phi(vec(points))
    return None


def _met(
    levels: Callable[[Floats], Floats], roots: int, ball: tuple[Floats, float, int | None], random: Random, n: int
) -> Floats:
    """Where random lines through a ball, or a disc, meet a wall; of two places one of both, as a coin says."""
    center, radius, across = ball
    first, u = _lines(random, n, across)
    foot = center + radius * first
    before, here, after = (levels(foot + t * u) for t in (-radius, 0.0, radius))
    a, b = 0.5 * (before + after) - here, 0.5 * (after - before)
    if roots == 1:
        with np.errstate(all="ignore"):
            t = -here / b
    else:
        sign = np.where(random.random(n) < 0.5, 1.0, -1.0)
        with np.errstate(all="ignore"):
            root = np.sqrt(b * b - 4.0 * a * here)
            # The one that is not a difference, and the other one by the product of both.
            large = -0.5 * (b + np.copysign(root, b))
            size = np.abs(here) + np.abs(b) + np.abs(a)
            t = np.where(sign > 0.0, large / np.where(np.abs(a) > 1e-13 * size, a, np.nan), here / large)
    return np.asarray(np.where(np.abs(t) <= 1.0, foot + radius * t * u, np.nan))


def _lines(random: Random, n: int, across: int | None) -> tuple[Floats, Floats]:
    """Feet and directions of lines that are uniform and isotropic among those that meet the unit ball, or disc."""
    if across is not None:
        angle, offset = 2.0 * math.pi * random.random(n), 2.0 * random.random(n) - 1.0
        i, j = along(across)
        u, foot = np.zeros((3, n)), np.zeros((3, n))
        u[i], u[j] = np.cos(angle), np.sin(angle)
        foot[i], foot[j] = -offset * u[j], offset * u[i]
        return foot, u
    u = directions(random, n)
    other = directions(random, n)
    beside = other - (other * u).sum(axis=0) * u
    beside /= np.sqrt((beside**2).sum(axis=0))
    return np.sqrt(random.random(n)) * beside, u

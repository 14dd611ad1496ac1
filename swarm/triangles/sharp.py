"""A part of a surface as triangles with its edges sharp: each smooth wall by itself, cut by all others."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..kernel.vector import vec
from ..motion import Pose, pose
from ..state import Floats
from ..surfaces import Cone, Torus
from ..surfaces.facets.mesh import Mesh
from ..surfaces.fields.many import Many
from ..surfaces.outlines.outlined import Outlined
from ..surfaces.rotation import matrix
from ..surfaces.surface import Surface
from . import curves, given
from .cut import MOST_BODIES, Indices, SmoothSurface, cut, found_in
from .parts import Cover, Part

# Of the size of what is drawn, a step along edges of a mesh that others may cut.
_FINE = 200
# A wall of which this part of its box is seen is found again in the box of that, so often.
_SEEN, _AGAIN = 0.4, 3

Box = tuple[Floats, Floats]
# Points (V, 3) [m], triangles (T, 3), normals (V, 3); and its edges.
Walls = tuple[tuple[Floats, Indices, Floats], list[Floats]]


class _Placed(NamedTuple):
    """A part in the frame in which its surface is given, and the box of the scene in that frame."""

    part: Part
    pose: Pose
    frame: Floats  # columns are its axes
    low: Floats  # of the box along these
    high: Floats
    size: float  # of what is drawn [m]

    def level(self, wall: SmoothSurface, covers: list[Cover], others: list[SmoothSurface]) -> Any:
        """A function of points that is above 0 where the wall is taken away."""

        def above(points: Floats) -> Floats:
            outwards = self.side() * self.pose.turned(wall.normals(points).T).T
            found = self.part.level(self.pose.placed(points.T).T, outwards, self.size, covers)
            for other in others:
                found = np.maximum(found, other.distance(points))
            return np.asarray(found)

        return above

    def side(self) -> float:
        return -1.0 if self.part.surface.is_solid() else 1.0


def drawn(part: Part, box: Box, time: float) -> Walls:
    """The part of a scene in a box, at a time [s]."""
    if isinstance(part.surface, Mesh):
        return _facets(part, part.surface, box)
    surface, at = part.surface, pose(part.surface.motion, time)
    frame, own = _frame(surface)
    low, high = (np.array(corner) for corner in filled(own).bounds())
    corners = frame.T @ at.given(np.array(list(itertools.product(*zip(*box, strict=True)))).T)
    low, high = np.maximum(low, corners.min(axis=1)), np.minimum(high, corners.max(axis=1))
    placed = _Placed(part, at, frame, low, high, float((box[1] - box[0]).max()))
    points, triangles, normals, edges, first = (
        [np.empty((0, 3))],
        [np.empty((0, 3), np.int64)],
        [np.empty((0, 3))],
        [],
        0,
    )
    inwards = 1.0 if part.solid else -1.0
    for found, wall in _pieces(placed) if (low < high).all() else ():
        points.append(found.points)
        normal = given.without_gaps(wall.normals(found.points), found.triangles)
        triangles.append(first + _turned_to(found.points, found.triangles, inwards * normal))
        normals.append(inwards * normal)
        edges += curves.joined(found.points, found.rims)
        first += len(found.points)
    vertices, cells = np.concatenate(points), np.concatenate(triangles)
    if isinstance(surface, Outlined) and len(cells):
        level = placed.level(given.sides(surface), list(part.covers), [])
        for line in given.corners(surface, float(low[2]), float(high[2])):
            edges += curves.runs(line, level(line) <= 0.0)
    here = at.placed(vertices.T).T, cells, at.turned(np.concatenate(normals).T).T
    return here, [at.placed(edge.T).T for edge in edges]


def _facets(part: Part, surface: Mesh, box: Box) -> Walls:
    """The triangles of a mesh as they are, or what of them is a wall."""
    frame, (low, high) = matrix(surface.rotation), box
    placed = _Placed(part, pose(None, 0.0), frame, low, high, float((high - low).max()))
    points, triangles = surface.corners, surface.triangles
    edges = curves.joined(points, curves.creases(points, triangles))
    covers = _near(placed, points)
    if covers or part.doorways:
        wall = SmoothSurface(lambda points: np.zeros(len(points)), lambda points: surface.gradient(points.T).T)
        level = placed.level(wall, covers, [])
        fine = [curves.finer(edge, placed.size / _FINE) for edge in edges]
        edges = [run for edge in fine for run in curves.runs(edge, level(edge) <= 0.0)]
        points, triangles, rims = cut(wall, points, triangles, level)
        edges += curves.joined(points, rims)
    # Triangles go round the normals out of the mesh.
    return given.shaded(points, triangles if part.solid else triangles[:, ::-1]), edges


def _pieces(placed: _Placed) -> Iterator[tuple[Any, SmoothSurface]]:
    """The triangles of every smooth wall, cut, and the wall."""
    surface: Any = placed.part.surface
    walls, upright = smooth_walls(surface), isinstance(surface, Outlined)
    if isinstance(surface, Cone):
        # Of the plane through the apex only that point is a wall.
        walls = walls[-1:]
    if upright:
        points, triangles = given.upright(surface, float(placed.low[2]), float(placed.high[2]))
        # Moved onto themselves, they would stay where they are.
        wall = SmoothSurface(lambda points: np.zeros(len(points)), walls[0].gradient)
        level = placed.level(wall, _near(placed, points), [])
        yield cut(wall, points, triangles, level), wall
    for wall in walls[upright:]:
        others = [other for other in walls if other is not wall][: 1 if upright else None]
        low, high = placed.low, placed.high
        for _ in range(_AGAIN):
            points, triangles = _triangles(placed, wall, low, high)
            covers = _near(placed, points)
            bodies = sum(len(one.surface) for one in covers if isinstance(one.surface, Many))
            found = cut(wall, points, triangles, placed.level(wall, covers, others), min(bodies, MOST_BODIES))
            if not len(found.points):
                break
            seen = found.points @ placed.frame
            least, most = seen.min(axis=0), seen.max(axis=0)
            if (most - least).max() > _SEEN * (high - low).max():
                break
            low, high = np.maximum(low, least), np.minimum(high, most)
            room = 0.05 * (high - low).max()
            low, high = low - room, high + room
        if len(found.points):
            yield found, wall


def _near(placed: _Placed, points: Floats) -> list[Cover]:
    """The covers that may take away something of a wall with these points."""
    if not len(points):
        return []
    here = placed.pose.placed(points.T)
    room = 1e-3 * placed.size
    return [one for one in placed.part.covers if one.may_cover(here.min(axis=1) - room, here.max(axis=1) + room)]


def smooth_walls(surface: Surface) -> list[SmoothSurface]:
    """Every smooth wall of a surface; of a solid with edges those of what it fills."""
    if isinstance(surface, Outlined):
        return [given.sides(surface), *given.lids(surface)]
    whole = filled(surface)
    walls = whole.walls() if type(whole).phi is Surface.phi else (whole,)
    return [_smooth(wall) for wall in walls]


def filled(surface: Surface) -> Surface:
    """What a solid fills, as a cavity; a cavity itself."""
    if not surface.is_solid():
        return surface
    try:
        return replace(surface, side="inside")  # type: ignore[call-arg]
    except SceneError:
        return surface


def _smooth(wall: Any) -> SmoothSurface:
    if isinstance(wall, Surface):
        still = replace(wall, motion=None)
        return SmoothSurface(lambda points: still.phi(points.T), lambda points: still.gradient(points.T).T)

    def gradient(points: Floats) -> Floats:
        rows = vec(points.T)
        return np.stack(np.broadcast_arrays(*wall.gradient(rows), rows.x)[:3], axis=1)

    return SmoothSurface(lambda points: np.broadcast_to(wall.phi(vec(points.T)), len(points)), gradient)


def _frame(surface: Surface) -> tuple[Floats, Surface]:
    """A frame along the axes of a surface, the columns of a matrix, and the surface in that."""
    whole: Any = surface
    own: dict[str, Any] = {"motion": None, "mass": None, "inertia": None}
    frame = np.eye(3)
    if isinstance(whole, Outlined):
        frame = whole.frame
        own |= {"axis": (0.0, 0.0, 1.0)}
    elif hasattr(whole, "turn"):
        frame = matrix(whole.turn())
        own |= {"axis": (0.0, 0.0, 1.0)}
    elif whole.rotation is not None:
        frame = matrix(whole.rotation)
    if hasattr(whole, "center"):
        own |= {"rotation": None, "center": _in(frame, whole.center)}
    elif whole.rotation is not None:
        return np.eye(3), replace(whole, motion=None, mass=None, inertia=None)
    return frame, replace(whole, **own)


def _in(frame: Floats, point: Any) -> Any:
    return tuple((frame.T @ np.array(point)).tolist())


def _triangles(placed: _Placed, wall: SmoothSurface, low: Floats, high: Floats) -> tuple[Floats, Indices]:
    """Triangles on a smooth wall in a box."""
    surface, frame = placed.part.surface, placed.frame
    if isinstance(surface, Torus):
        return given.torus(surface)
    if isinstance(surface, Cone):
        return given.cone(surface, low, high, frame)
    return found_in(wall, low, high, frame, any(isinstance(one.surface, Many) for one in placed.part.covers))


def _turned_to(points: Floats, triangles: Indices, normals: Floats) -> NDArray[np.int64]:
    """Triangles whose corners go round their normals."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    wrong = (np.cross(b - a, c - a) * normals[triangles].sum(axis=1)).sum(axis=1) < 0.0
    return np.where(wrong[:, None], triangles[:, ::-1], triangles)

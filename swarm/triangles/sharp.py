"""A part of a surface as triangles with sharp edges: each smooth wall by itself, cut by all others."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..motion import Pose, pose
from ..state import Floats, Indices
from ..surfaces import Cone
from ..surfaces.facets.mending import components
from ..surfaces.facets.mesh import Mesh
from ..surfaces.rotation import matrix, normalized
from ..surfaces.surface import Surface
from . import curves
from .curves import neighbours
from .cut import MOST_BODIES, Cut, SmoothSurface, cut, found_in
from .parts import Cover, Part

# The steps in the size of the drawing along edges of a mesh that others may cut
_FINE = 200
# A point within the first distance of a cut, as a part of the size of a wall, is on the cut; within the second distance
# of a corner it is at the corner; the third number is that of moves to a corner.
_ON_A_CUT, _AT_A_CORNER, _MOVES = 1e-8, 1e-4, 4
# A wall that fills less than this part of its box is found again in a closer box, at most this many times.
_SEEN, _AGAIN = 0.4, 3

Box = tuple[Floats, Floats]
# Points (V, 3) [m], triangles (T, 3), normals (V, 3); edges; for a mesh the number of its triangle for each triangle.
Walls = tuple[tuple[Floats, Indices, Floats], list[Floats], Indices | None]


class _Placed(NamedTuple):
    """A part in the frame in which its surface is given, and the box of the scene in that frame."""

    part: Part
    pose: Pose
    frame: Floats  # columns are its axes
    low: Floats  # of the box along these
    high: Floats
    size: float  # of the drawing [m]

    def level(self, wall: SmoothSurface, covers: list[Cover], others: list[SmoothSurface]) -> Any:
        """Return a function of points that is above 0 where the wall is taken away."""

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
    """Return the triangles of the part of a scene in a box, at a time [s]."""
    if isinstance(part.surface, Mesh):
        return _facets(part, part.surface, box)
    surface, at = part.surface, pose(part.surface.motion, time)
    frame, own = _frame(surface)
    low, high = (np.array(corner) for corner in own.filled().bounds())
    corners = frame.T @ at.given(np.array(list(itertools.product(*zip(*box, strict=True)))).T)
    low, high = np.maximum(low, corners.min(axis=1)), np.minimum(high, corners.max(axis=1))
    placed = _Placed(part, at, frame, low, high, float((box[1] - box[0]).max()))
    points, normals, edges = [np.empty((0, 3))], [np.empty((0, 3))], list[Floats]()
    triangles, first = [np.empty((0, 3), np.int64)], 0
    inwards = 1.0 if part.solid else -1.0
    for found, wall in _pieces(placed) if (low < high).all() else ():
        points.append(found.points)
        normal = without_gaps(wall.normals(found.points), found.triangles)
        triangles.append(first + _turned_to(found.points, found.triangles, inwards * normal))
        normals.append(inwards * normal)
        edges += curves.joined(found.points, found.rims)
        first += len(found.points)
    vertices, cells = np.concatenate(points), np.concatenate(triangles)
    if len(cells):
        level = placed.level(SmoothSurface(*surface.level_sets()[0]), list(part.covers), [])
        for line in surface.corner_lines(float(low[2]), float(high[2])):
            edges += curves.runs(line, level(line) <= 0.0)
    here = at.placed(vertices.T).T, cells, at.turned(np.concatenate(normals).T).T
    return here, [at.placed(edge.T).T for edge in edges], None


def _facets(part: Part, surface: Mesh, box: Box) -> Walls:
    """Return the triangles of a mesh as they are, or the part of them that is a wall."""
    frame, (low, high) = matrix(surface.rotation), box
    placed = _Placed(part, pose(None, 0.0), frame, low, high, float((high - low).max()))
    points, triangles, numbers = surface.corners, surface.triangles, np.arange(len(surface.triangles))
    edges = curves.joined(points, curves.creases(points, triangles))
    covers = _near(placed, points)
    if covers or part.doorways:
        wall = SmoothSurface(lambda points: np.zeros(len(points)), lambda points: surface.gradient(points.T).T)
        level = placed.level(wall, covers, [])
        fine = [curves.finer(edge, placed.size / _FINE) for edge in edges]
        edges = [run for edge in fine for run in curves.runs(edge, level(edge) <= 0.0)]
        points, triangles, rims, numbers = cut(wall, points, triangles, level)
        edges += curves.joined(points, rims)
    if surface.open:
        return _both_sides(points, triangles), edges, np.tile(numbers, 2)
    # Triangles go round the normals out of the mesh.
    return shaded(points, triangles if part.solid else triangles[:, ::-1]), edges, numbers


def _both_sides(points: Floats, triangles: Indices) -> tuple[Floats, Indices, Floats]:
    """Return the triangles of sheets, each seen from both sides."""
    sides = [shaded(points, turned) for turned in (triangles, triangles[:, ::-1])]
    (here, cells, normals), (there, others, opposite) = sides
    return (
        np.concatenate([here, there]),
        np.concatenate([cells, others + len(here)]),
        np.concatenate([normals, opposite]),
    )


def _pieces(placed: _Placed) -> Iterator[tuple[Any, SmoothSurface]]:
    """Yield the triangles of every smooth wall, cut, and the wall."""
    surface: Any = placed.part.surface
    walls = [SmoothSurface(*one) for one in surface.level_sets()]
    upright = surface.upright(float(placed.low[2]), float(placed.high[2]))
    if isinstance(surface, Cone):
        # The plane through the apex is a wall at that point only.
        walls = walls[-1:]
    if upright is not None:
        points, triangles = upright
        # The points are on the wall already: phi = 0 leaves them where they are.
        wall = SmoothSurface(lambda points: np.zeros(len(points)), walls[0].gradient)
        level = placed.level(wall, _near(placed, points), [])
        yield cut(wall, points, triangles, level), wall
    for wall in walls[1:] if upright is not None else walls:
        others = [other for other in walls if other is not wall][: 1 if upright is not None else None]
        low, high = placed.low, placed.high
        for _ in range(_AGAIN):
            points, triangles = _triangles(placed, wall, low, high)
            covers = _near(placed, points)
            bodies = sum(one.surface.body_count() for one in covers)
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
            level = placed.level(wall, covers, others)
            yield _with_corners(found, wall, others, level), wall


def _with_corners(found: Cut, wall: SmoothSurface, others: list[SmoothSurface], level: Any) -> Cut:
    """Return a wall with its corners, where two others meet on it: a cut is straight within each triangle.

    An edge from one of the others to another one passes the corner; the gap between them is one more triangle.
    """
    size = float(np.ptp(found.points, axis=0).max())
    for one, other in itertools.combinations(others, 2):
        points, triangles, rims, origins = found
        walls = wall, one, other
        ends = np.unique(rims)
        ends = ends[np.max([np.abs(each.distance(points[ends])) for each in walls], axis=0) <= _AT_A_CORNER * size]
        if len(ends):
            points = points.copy()
            points[ends] = _crossing(walls, points[ends], _AT_A_CORNER * size)
        on_one, on_other = (np.abs(each.distance(points)) <= _ON_A_CUT * size for each in (one, other))
        first, second = rims.T
        turns = (on_one[first] & on_other[second]) | (on_other[first] & on_one[second])
        turns &= ~(on_one & on_other)[rims].any(axis=1)
        if turns.any():
            a, b = rims[turns].T
            middle, reach = 0.5 * (points[a] + points[b]), np.linalg.norm(points[b] - points[a], axis=1)
            corners = _crossing(walls, middle, reach)
            near = (corners != middle).any(axis=1) & (level(corners) <= _ON_A_CUT * size)
            number = len(points) + np.arange(np.count_nonzero(near))
            a, b, turns[turns] = a[near], b[near], near
            made = np.stack([a, number, b], axis=1)
            points, triangles = np.concatenate([points, corners[near]]), np.concatenate([triangles, made])
            rims = np.concatenate([rims[~turns], made[:, :2], made[:, 1:]])
            origins = np.concatenate([origins, np.full(len(made), -1)])
        found = Cut(points, triangles, rims, origins)
    return found


def _crossing(walls: tuple[SmoothSurface, ...], points: Floats, reach: Any) -> Floats:
    """Return the place near each point at which three walls cross; the point itself where it is beyond the reach."""
    places = points
    for _move in range(_MOVES):
        slopes = np.stack([each.gradient(places) for each in walls], axis=1)
        values = np.stack([each.phi(places) for each in walls], axis=1)
        places = places - (np.linalg.pinv(slopes) @ values[:, :, None])[:, :, 0]
    near = np.linalg.norm(places - points, axis=1) <= reach
    return np.where(near[:, None], places, points)


def _near(placed: _Placed, points: Floats) -> list[Cover]:
    """Return the covers that may take away a part of a wall with these points."""
    if not len(points):
        return []
    here = placed.pose.placed(points.T)
    room = 1e-3 * placed.size
    return [one for one in placed.part.covers if one.may_cover(here.min(axis=1) - room, here.max(axis=1) + room)]


def _frame(surface: Surface) -> tuple[Floats, Surface]:
    """Return a frame along the axes of a surface, the columns of a matrix, and the surface in that frame."""
    whole: Any = surface
    frame, own = whole.own_frame()
    own |= {"motion": None, "mass": None, "inertia": None}
    if hasattr(whole, "center"):
        own |= {"rotation": None, "center": tuple((frame.T @ np.array(whole.center)).tolist())}
    elif whole.rotation is not None:
        return np.eye(3), replace(whole, motion=None, mass=None, inertia=None)
    return frame, replace(whole, **own)


def _triangles(placed: _Placed, wall: SmoothSurface, low: Floats, high: Floats) -> tuple[Floats, Indices]:
    """Return triangles on a smooth wall in a box."""
    made = placed.part.surface.triangulated(low, high, placed.frame)
    return made or found_in(wall, low, high, placed.frame, any(one.surface.is_field for one in placed.part.covers))


def _turned_to(points: Floats, triangles: Indices, normals: Floats) -> NDArray[np.int64]:
    """Return the triangles with corners that go round their normals."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    wrong = (np.cross(b - a, c - a) * normals[triangles].sum(axis=1)).sum(axis=1) < 0.0
    return np.where(wrong[:, None], triangles[:, ::-1], triangles)


def without_gaps(normals: Floats, triangles: Indices) -> Floats:
    """Unit normals (V, 3) without gaps.

    A point without a normal, such as the apex of a cone, gets the mean normal of its triangles, normalised.
    """
    missing = np.asarray((normals == 0.0).all(axis=1))
    if not missing.any():
        return normals
    sums = np.zeros_like(normals)
    for k in range(3):
        np.add.at(sums, triangles[:, k], normals[triangles].sum(axis=1))
    return np.where(missing[:, None], normalized(sums, 1), normals)


def shaded(points: Floats, triangles: Indices) -> tuple[Floats, Indices, Floats]:
    """Return triangles with normals at their corners: a corner at an edge is one corner for each side of the edge."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    # Corners of two triangles at a point are one where these meet smoothly at a side.
    mine, other = neighbours(points, triangles)
    every = np.arange(3 * len(triangles)).reshape(-1, 3)
    pairs = [
        (every[mine, i], every[other, j])
        for i in range(3) for j in range(3)
    ]  # fmt: skip
    same = [triangles[mine, k // 3] == triangles[other, k % 3] for k in range(9)]
    first, second = (np.concatenate([pair[k][here] for pair, here in zip(pairs, same, strict=True)]) for k in (0, 1))
    corner = components(np.stack([first, second], axis=1), every.size)
    number = int(corner.max(initial=-1)) + 1
    made, normals = np.empty((number, 3)), np.zeros((number, 3))
    made[corner] = points[triangles.ravel()]
    np.add.at(normals, corner, np.repeat(normal, 3, axis=0))
    return made, corner.reshape(-1, 3), normalized(normals, 1)

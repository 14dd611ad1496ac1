"""Whether samples resolve the walls and the gaps of a mesh.

The signed distance is -t/2 in the middle of a wall of thickness t and rises by 1 to both sides. Where no sample is in
the wall, the spline through the samples may be above 0 in it: particles leak. By the largest value that the spline of
the distance from a plane takes on that plane, 0.3415 h for samples h apart (planes halfway between samples along an
axis), a flat wall is whole from t = 0.683 h on. Walls and gaps that alternate, each t thick, are a wave of the length
2 t, which samples resolve for t > h. RESOLVED adds a quarter to that for walls that are bent.

Not every thin place is a wall that leaks. Towards the edge of a wedge the thickness is 0, and an engraved letter is
thinner than samples need to be: such a part is lost and becomes round, as all edges do. So the part of the surface
around a thin place that joins its two sides decides. If this part is a disc, folded about a near edge, the surface
without the fold is still one piece. If no part joins the two sides, the wall continues. If the part is no disc (a wire,
a narrow bore, a grain), samples would cut or close a passage.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.extras import needed_by
from ...errors import SceneError
from ...kernel.limits import TINY
from ...state import Floats, Indices
from ..facets.mending import components, neighbours
from ..facets.mesh_files import Soup
from ..surface import shown

# The thickness that is resolved, in spacings.
RESOLVED = 1.25
# Points of the mesh at which its thickness is measured, for a square of the spacing; each triangle has at least one.
_DENSITY = 4.0
# The two sides of a wall are turned from each other by less than this: in a wedge that is as blunt as this, less than
# two spacings are thinner than RESOLVED.
_FACING = np.cos(np.radians(45.0))
# Sides that are turned by less than this do not meet in an edge, as far as a mesh shows.
_WEDGE = np.sin(np.radians(5.0))
# A fold that ends within this many spacings becomes round.
_ROUND = 2.0
# The surface is examined around the middle of a wedge as far as this part of the way to its edge.
_AROUND = 0.6
# Radii of the balls that are examined, relative to the radius that should do. If a ball crosses the three edges of a
# corner without the corner, the part of the surface in it has a hole, which is absent for another radius.
_BALLS = (1.0, 1.5)
# A part of a distance above its round-off.
_CLOSE = 1e-6
# Steps from a first ball to the one that touches both sides; none is needed where these are parallel.
_STEPS = 3
# Inverse powers of the plastic number: their multiples fill a square evenly.
_EVEN = np.array([0.7548776662466927, 0.5698402909980532])


class _Thin(NamedTuple):
    """Thin places: for each a point of the mesh and a point of the opposite side."""

    point: Floats
    other: Floats
    at: Indices  # the triangle of the point
    to: Indices  # the triangle of the point on the opposite side
    thickness: Floats
    gap: NDArray[np.bool_]  # whether it is a gap, not a wall


def require_resolved(path: Path, mesh: Soup, spacing: float) -> None:
    """Raise a `SceneError` where a wall or a gap is too thin for samples this far apart [m]."""
    normals, areas = _normals(mesh)
    thin = _thin_places(mesh, normals, areas, spacing)
    if not len(thin.point):
        return
    surface, first, enough = _Surface(mesh, normals, spacing), None, spacing
    # With a smaller spacing a fold that was short for the first spacing may be long.
    while (worst := _thinnest(thin, surface, enough)) is not None:
        first = worst if first is None else first
        enough = float(thin.thickness[worst]) / RESOLVED * (1.0 - _CLOSE)
    if first is not None:
        middle = 0.5 * (thin.point[first] + thin.other[first])
        raise SceneError(
            f"spacing must resolve the mesh {path}, got {spacing:g} m: a {'gap' if thin.gap[first] else 'wall'} of "
            f"{thin.thickness[first]:.3g} m at {shown(middle)} is thinner than {RESOLVED:g} spacings, so that samples "
            f"may miss it; spacing = {_down(enough):g} would do"
        )


def _down(value: float) -> float:
    """Return a number of three digits that is not above this one."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 2.0)
    return float(f"{np.floor(value / unit) * unit:.2e}")


def _thinnest(thin: _Thin, surface: "_Surface", spacing: float) -> int | None:
    """Return the thinnest place that samples this far apart do not resolve."""
    found = np.flatnonzero(thin.thickness < RESOLVED * spacing)
    # For each cell one place is enough: the place with the most parallel sides, as a wall has.
    facing = (surface.normals[thin.at[found]] * surface.normals[thin.to[found]]).sum(axis=1)
    found = found[np.argsort(facing, kind="stable")]
    cells = np.column_stack([np.floor(thin.point[found] / (_ROUND * spacing)), thin.gap[found]])
    found = found[np.unique(cells, axis=0, return_index=True)[1]]
    found = found[np.argsort(thin.thickness[found], kind="stable")]
    return next((int(i) for i in found if not surface.is_fold(thin, int(i), spacing)), None)


# --- Where it is thin ------------------------------------------------------------------------------------


def _normals(mesh: Soup) -> tuple[Floats, Floats]:
    """Return the unit normals (T, 3) and the areas (T,) of the triangles."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    twice = np.linalg.norm(normals, axis=1)
    return normals / np.maximum(twice, TINY)[:, None], 0.5 * twice


def _thin_places(mesh: Soup, normals: Floats, areas: Floats, spacing: float) -> _Thin:
    """Return the places where a ball that touches the mesh, as wide as a resolved wall, meets an opposite side."""
    counts = np.maximum(np.ceil(_DENSITY * areas / spacing**2), 1.0).astype(np.int64)
    at = np.repeat(np.arange(len(areas)), counts)
    # Across all triangles, not in each: small triangles have one point.
    u, v = ((np.arange(len(at))[:, None] + 0.5) * _EVEN % 1.0).T
    beyond = u + v > 1.0
    u, v = np.where(beyond, 1.0 - u, u)[:, None], np.where(beyond, 1.0 - v, v)[:, None]
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles[at]], 1, 0)
    points, found = a + u * (b - a) + v * (c - a), []
    for gap in (False, True):
        toward = normals[at] if gap else -normals[at]
        widest = np.full(len(at), 0.5 * RESOLVED * spacing)
        near, radius, other, to = _touching(mesh, normals, at, points, toward, widest)
        which = np.flatnonzero(near)
        radius, other, to = radius[which], other[which], to[which]
        for _ in range(_STEPS if len(which) else 0):
            near, *closer = _touching(mesh, normals, at[which], points[which], toward[which], radius)
            radius, to = np.where(near, closer[0], radius), np.where(near, closer[2], to)
            other = np.where(near[:, None], closer[1], other)
        found.append(_Thin(points[which], other, at[which], to, 2.0 * radius, np.full(len(which), gap)))
    return _Thin(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _touching(
    mesh: Soup, normals: Floats, at: Indices, points: Floats, toward: Floats, radius: Floats
) -> tuple[NDArray[np.bool_], Floats, Floats, Indices]:
    """Return whether balls that touch the mesh in points of these triangles meet a side that faces them.

    Return also the radius of the balls that just touch this side, the point and the triangle there.
    """
    with needed_by("from_mesh", "mesh"):
        import igl
    squares, to, other = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points + radius[:, None] * toward), mesh.vertices, mesh.triangles
    )
    way = other - points
    # |way|^2 = 2 r (way . toward): the ball through both points, with its centre along `toward`
    height = (way * toward).sum(axis=1)
    met = np.sqrt(squares) < radius * (1.0 - _CLOSE)
    touching = np.where(met, 0.5 * (way**2).sum(axis=1) / np.where(met & (height > 0.0), height, 1.0), radius)
    return met & ((normals[to] * normals[at]).sum(axis=1) < -_FACING), touching, other, to


# --- Whether it is a wall --------------------------------------------------------------------------------


class _Surface:
    """The mesh with its edges."""

    def __init__(self, mesh: Soup, normals: Floats, spacing: float) -> None:
        from scipy.spatial import KDTree

        self.mesh, self.normals = mesh, normals
        self.edges, self.sides = neighbours(mesh.triangles)
        start, end = np.moveaxis(mesh.vertices[self.edges], 1, 0)
        length = np.linalg.norm(end - start, axis=1)
        # Short edges are found by their middles, long ones by their boxes.
        self.half = 0.5 * spacing
        self.short, self.long = np.flatnonzero(length <= spacing), np.flatnonzero(length > spacing)
        self.middles = KDTree(0.5 * (start + end)[self.short])
        self.low, self.high = np.minimum(start, end)[self.long], np.maximum(start, end)[self.long]

    def is_fold(self, thin: _Thin, i: int, spacing: float) -> bool:
        """Whether the surface around a thin place is a disc that joins its two sides."""
        p, q, n, m = thin.point[i], thin.other[i], self.normals[thin.at[i]], self.normals[thin.to[i]]
        across = m - (m @ n) * n
        middle, reach = 0.5 * (p + q), _ROUND * spacing
        sine = float(np.linalg.norm(across))
        if sine > _WEDGE:
            # From p in its plane to the plane of q: the edge of the wedge
            way = -((p - q) @ m) / sine**2 * across
            reach = max(reach, _AROUND * float(np.linalg.norm(way)) + spacing)
            middle = middle + 0.5 * way
        return any(self._is_disc(middle, k * reach, int(thin.at[i]), int(thin.to[i])) for k in _BALLS)

    def _is_disc(self, centre: Floats, reach: float, first: int, last: int) -> bool:
        """Whether two triangles are in one part of the surface in a ball, and this part is a disc."""
        found = np.array(self.middles.query_ball_point(centre, reach + self.half), np.int64)
        crossed = ((self.low <= centre + reach) & (self.high >= centre - reach)).all(axis=1)
        near = np.concatenate([self.short[found], self.long[crossed]])
        start, end = np.moveaxis(self.mesh.vertices[self.edges[near]], 1, 0)
        way = end - start
        part = np.clip(((centre - start) * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), 1e-300), 0.0, 1.0)
        near = near[((start + part[:, None] * way - centre) ** 2).sum(axis=1) <= reach**2]
        triangles, sides = np.unique(self.sides[near], return_inverse=True)
        sides = sides.reshape(-1, 2)
        if not np.isin([first, last], triangles).all():
            return False
        label = components(sides, len(triangles))
        of_first, of_last = label[np.searchsorted(triangles, [first, last])]
        if of_first != of_last:
            return False
        edges = self.edges[near[label[sides[:, 0]] == of_first]]
        corners = self.mesh.vertices[np.unique(edges)]
        inside = np.count_nonzero(((corners - centre) ** 2).sum(axis=1) <= reach**2)
        # The pieces of triangles, edges and corners in a ball are convex: their numbers give Euler's characteristic.
        return bool(np.count_nonzero(label == of_first) - len(edges) + inside == 1)

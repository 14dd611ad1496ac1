"""The walls of a scene as shapes to draw, for any phi: triangles, their area, and the curves of a wire frame."""

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import contourpy
import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from ..motion import Pose, pose
from ..particles import Floats
from ..scene import Scene
from ..surfaces import Spheres
from ..surfaces.fields.many import Many
from ..surfaces.openings import are_open
from ..surfaces.rotation import matrix
from ..surfaces.surface import Surface

# Points along each side of the grid for the triangles. The area of a sphere is 0.07 % too small, of a box 0.6 %.
_POINTS = 48
# Planes across each axis whose intersections with the walls are the wire frame, and points along a side of each plane.
_PLANES, _FINE = 5, 160
# The outermost planes are this fraction of the width inside a surface, where they show rims and edges.
_END = 0.01
# Of each of many balls, the points along each side of its grid and of its circles; how many balls get these.
_COARSE, _MOST_WIRES = 10, 2_000
# Of each of many bodies of another kind, the points along each side of its grid.
_BODY = 16
# Cells of the grid beyond the walls, so that these are closed.
_MARGIN = 2.0
# An open volume is drawn to this many times the distance of the surfaces and particles.
_BEYOND = 1.2

Corners = tuple[Floats, Floats]


@dataclass(frozen=True)
class Shape:
    """The part of one surface that is a wall of the volume.

    Attributes:
        name: its number and kind, such as "0_ellipsoid".
        solid: whether particles are kept out of it.
        vertices, triangles, normals: (V, 3) [m], (T, 3), (V, 3).
        wires: curves (k, 3) [m].
    """

    name: str
    solid: bool
    vertices: Floats
    triangles: NDArray[np.int64]
    normals: Floats
    wires: list[Floats]

    def area(self) -> float:
        """Of the triangles [m^2]."""
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return float(0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).sum())


class Still(NamedTuple):
    """A scene at one time [s]."""

    scene: Scene
    time: float


def shapes_of(scene: Scene, positions: Floats, time: float = 0.0, most: float = math.inf) -> list[Shape]:
    """A shape for every surface at a time [s]; where the volume is open, as far as surfaces and particles (3, N) go.

    That of a surface of more than `most` bodies is empty.
    """
    still = Still(scene, time)
    box = _box(still, positions)
    coarse = _triangles(still, box)
    # On a grid around all of them the many bodies of a scene would be too small, and a grid around each too slow.
    grouped = {scene.owners_of_pieces[k] for group in scene.order.groups for k in group}
    shapes = []
    for i, surface in enumerate(scene.surfaces):
        name = f"{i}_{type(surface).__name__.lower()}"
        if isinstance(surface, Many) and len(surface) > most:
            shapes.append(Shape(name, True, np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3)), []))
            continue
        if isinstance(surface, Spheres):
            shapes.append(_placed(Shape(name, True, *_balls(surface)), scene.poses(time)[i]))
            continue
        if isinstance(surface, Many) or i in grouped:
            pose = scene.poses(time)[i]
            shapes.append(_placed(Shape(name, True, *_bodies(surface, _given(box, pose))), pose))
            continue
        own = _of_surface(still, i, *coarse)
        around = _around(own[0], box) if len(own[0]) else _near(surface, scene.poses(time)[i], box)
        # Again, on a grid around this surface only.
        vertices, triangles, normals = _of_surface(still, i, *_triangles(still, around))
        wires = _wires(still, i, vertices, box) if len(vertices) else []
        shapes.append(Shape(name, surface.is_solid(), vertices, triangles, normals, wires))
    return shapes


def since_start(scene: Scene, i: int, position: Floats, orientation: Floats) -> tuple[Floats, Floats]:
    """How surface i has turned and moved since the start: what was at x0 is at turn x0 + way.

    `position` and `orientation` are its observables at a frame, `wall_position` and `wall_orientation`.
    """
    # x1 = A1 A0^T (x0 - p0) + p1, with places p of the origin
    first = pose(scene.surfaces[i].motion, 0.0)
    turn = matrix(tuple(orientation)) @ first.turn.T
    return turn, position - turn @ first.position()


def _placed(shape: Shape, pose: Pose) -> Shape:
    """A shape where its surface is now."""
    vertices, normals = pose.placed(shape.vertices.T).T, pose.turned(shape.normals.T).T
    return replace(shape, vertices=vertices, normals=normals, wires=[pose.placed(wire.T).T for wire in shape.wires])


def _given(box: Corners, pose: Pose) -> Corners:
    """A box around a box of the scene in the frame in which a surface is given."""
    corners = pose.given(np.array(list(itertools.product(*zip(*box, strict=True)))).T)
    return corners.min(axis=1), corners.max(axis=1)


def _balls(spheres: Spheres) -> tuple[Floats, NDArray[np.int64], Floats, list[Floats]]:
    """Vertices, triangles, normals and wires of many balls: coarse, so that thousands can be drawn."""
    low, high = np.full(3, -1.3), np.full(3, 1.3)
    axis = np.linspace(-1.3, 1.3, _COARSE)
    distance = np.sqrt((np.array(np.meshgrid(axis, axis, axis, indexing="ij")) ** 2).sum(axis=0))
    spacing = tuple((high - low) / (_COARSE - 1.0))
    unit, triangles, _normals, _values = marching_cubes(distance, 1.0, spacing=spacing)
    unit = unit + low
    normals = unit / np.sqrt((unit**2).sum(axis=1))[:, None]
    center, radius = spheres.centers[:, None, :], spheres.radii[:, None, None]
    vertices = (center + radius * normals).reshape(-1, 3)
    first = len(unit) * np.arange(len(spheres))[:, None, None]
    angle = np.linspace(0.0, 2.0 * math.pi, 3 * _COARSE + 1)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    some = slice(None, None, max(1, len(spheres) // _MOST_WIRES))
    circles = [np.roll(circle, k, axis=1) for k in range(3)]
    wires = [c + r * one for c, r in zip(spheres.centers[some], spheres.radii[some], strict=True) for one in circles]
    return vertices, (triangles + first).reshape(-1, 3).astype(np.int64), np.tile(normals, (len(spheres), 1)), wires


def _bodies(surface: Surface, box: Corners) -> tuple[Floats, NDArray[np.int64], Floats, list[Floats]]:
    """The same of bodies of another kind, each on a grid of its own."""
    solids = surface.solids() if isinstance(surface, Many) else [surface]
    vertices, triangles, normals = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], [np.empty((0, 3))]
    wires: list[Floats] = []
    first = 0
    for solid in solids[:: max(1, len(solids) // _MOST_WIRES)]:
        low, high = (np.array(corner) for corner in replace(solid, side="inside").bounds())  # type: ignore[call-arg]
        low, high = _around(np.stack([np.maximum(low, box[0]), np.minimum(high, box[1])]), box)
        axes = [np.linspace(a, b, _BODY) for a, b in zip(low, high, strict=True)]
        gap = -solid.phi(np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)).reshape(3 * (_BODY,))
        if not (low < high).all() or not gap.min() < 0.0 < gap.max():
            continue
        spacing = tuple((high - low) / (_BODY - 1.0))
        points, faces, across, _values = marching_cubes(gap, 0.0, spacing=spacing)
        vertices.append(points + low)
        triangles.append(faces.astype(np.int64) + first)
        normals.append(across.astype(np.float64))
        first += len(points)
        for axis in range(3):
            u, v = (axes[k] for k in range(3) if k != axis)
            middle = 0.5 * (gap.take(_BODY // 2 - 1, axis) + gap.take(_BODY // 2, axis))
            lines = contourpy.contour_generator(u, v, middle.T).lines(0.0)
            wires += [np.insert(np.asarray(line), axis, 0.5 * (low + high)[axis], axis=1) for line in lines]
    return np.concatenate(vertices), np.concatenate(triangles), np.concatenate(normals), wires


def _box(scene: Still, positions: Floats) -> Corners:
    low, high = (np.array(corner) for corner in scene.scene.bounds(scene.time))
    reach = _BEYOND * max(scene.scene.extent(), float(np.abs(positions).max()))
    low, high = np.where(np.isfinite(low), low, -reach), np.where(np.isfinite(high), high, reach)
    margin = _MARGIN * (high - low) / (_POINTS - 1.0)
    return low - margin, high + margin


def _around(points: Floats, box: Corners) -> Corners:
    """The box of some points, a little larger, in the box of all."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 2.0 * _MARGIN * np.maximum(high - low, 0.1 * (high - low).max()) / (_POINTS - 1.0)
    return np.maximum(low - margin, box[0]), np.minimum(high + margin, box[1])


def _near(surface: Any, pose: Pose, box: Corners) -> Corners:
    """Where to look for a surface that is smaller than the cells of the coarse grid."""
    size = surface.size()
    if not math.isfinite(size) or not hasattr(surface, "center"):
        return box
    center, half = pose.placed(np.array(surface.center)[:, None])[:, 0], 4.0 * size
    return np.maximum(center - half, box[0]), np.minimum(center + half, box[1])


def _gap(scene: Still, points: Floats) -> Floats:
    """The largest gap of all surfaces at points (3, N): 0 on every wall. No particle is where phi is not a number."""
    with np.errstate(all="ignore"):
        gap = scene.scene.gaps(points, scene.time).max(axis=0)
    return np.asarray(np.where(np.isfinite(gap), gap, np.max(gap, where=np.isfinite(gap), initial=1.0)))


def _triangles(scene: Still, box: Corners) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Vertices, triangles and normals of all walls in a box."""
    low, high = box
    axes = [np.linspace(a, b, _POINTS) for a, b in zip(low, high, strict=True)]
    grid = np.array(np.meshgrid(*axes, indexing="ij"))
    gap = _gap(scene, grid.reshape(3, -1)).reshape(grid.shape[1:])
    if not gap.min() < 0.0 < gap.max():
        return np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3))
    spacing = tuple((high - low) / (_POINTS - 1.0))
    vertices, triangles, normals, _values = marching_cubes(gap, 0.0, spacing=spacing)
    return vertices + low, triangles.astype(np.int64), normals.astype(np.float64)


def _of_surface(
    scene: Still, i: int, vertices: Floats, triangles: NDArray[np.int64], normals: Floats
) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Those triangles that lie on surface i, with their vertices only."""
    if not len(triangles):
        return vertices, triangles, normals
    middles = vertices[triangles].mean(axis=1)
    kept, places = np.unique(triangles[_owner(scene, middles.T) == i], return_inverse=True)
    return vertices[kept], places.reshape(-1, 3), normals[kept]


def _owner(scene: Still, points: Floats) -> NDArray[np.int64]:
    """The surface that each of the points (3, N) near a wall lies on, -1 where that is open."""
    with np.errstate(all="ignore"):
        owner = np.asarray(np.nan_to_num(scene.scene.gaps(points, scene.time), nan=-np.inf).argmax(axis=0))
        for i, volumes in enumerate(scene.scene.volumes):
            owner[(owner == i) & are_open(volumes, points)] = -1
    return owner


def _wires(scene: Still, i: int, vertices: Floats, box: Corners) -> list[Floats]:
    """Where planes across the three axes cut surface i, from end to end."""
    first, last = vertices.min(axis=0), vertices.max(axis=0)
    low, high = _around(vertices, box)
    curves = []
    for axis in range(3):
        u, v = (k for k in range(3) if k != axis)
        across = np.linspace(low[u], high[u], _FINE), np.linspace(low[v], high[v], _FINE)
        for part in np.linspace(_END, 1.0 - _END, _PLANES):
            points = np.empty((3, _FINE, _FINE))
            points[axis] = first[axis] + part * (last[axis] - first[axis])
            points[u], points[v] = np.meshgrid(*across)
            gap = _gap(scene, points.reshape(3, -1)).reshape(_FINE, _FINE)
            for line in contourpy.contour_generator(*across, gap).lines(0.0):
                curve = np.insert(np.asarray(line), axis, points[axis, 0, 0], axis=1)
                curves += _runs(curve, _owner(scene, curve.T) == i)
    return curves


def _runs(curve: Floats, kept: NDArray[np.bool_]) -> list[Floats]:
    """The parts of a curve whose points are kept, two points or more each."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(np.int8)))
    return [curve[a:b] for a, b in ends.reshape(-1, 2) if b - a > 1]

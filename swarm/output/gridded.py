"""Walls of any phi as triangles and wires, found on grids: those of a scene on one, and of each of many bodies."""

import functools
import itertools
import math
from dataclasses import replace
from typing import Any

import contourpy
import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from ..motion import Pose
from ..scene import Scene
from ..state import Floats
from ..surfaces import Spheres
from ..surfaces.fields.many import Many
from ..surfaces.openings import are_open
from ..surfaces.surface import Surface
from .curves import runs
from .cut import Smooth, cut

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
# Of balls that are cavities, so many more; and what is no depth in another one, as a part of the size of all.
_FOAM, _ROUND_OFF = 100_000, 1e-9
# Cells of the grid beyond the walls, so that these are closed.
_MARGIN = 2.0
# An open volume is drawn to this many times the distance of the surfaces and particles.
_BEYOND = 1.2

Corners = tuple[Floats, Floats]
# Vertices (V, 3) [m], triangles (T, 3) and normals (V, 3).
Triangles = tuple[Floats, NDArray[np.int64], Floats]
NOTHING: Triangles = np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3))


def placed(pose: Pose, mesh: Triangles, wires: list[Floats]) -> tuple[Triangles, list[Floats]]:
    """A mesh and wires where their surface is now."""
    vertices, triangles, normals = mesh
    moved = pose.placed(vertices.T).T, triangles, pose.turned(normals.T).T
    return moved, [pose.placed(wire.T).T for wire in wires]


def given_box(box: Corners, pose: Pose) -> Corners:
    """A box around a box of the scene in the frame in which a surface is given."""
    corners = pose.given(np.array(list(itertools.product(*zip(*box, strict=True)))).T)
    return corners.min(axis=1), corners.max(axis=1)


def _axes(box: Corners, count: int) -> list[Floats]:
    return [np.linspace(low, high, count) for low, high in zip(*box, strict=True)]


def _mesh(values: Floats, box: Corners) -> Triangles:
    """The level 0 of values at the points of a grid in the box."""
    if not values.min() < 0.0 < values.max():
        return NOTHING
    low, high = box
    spacing = tuple((high - low) / (len(values) - 1.0))
    vertices, triangles, normals, _values = marching_cubes(values, 0.0, spacing=spacing)
    return vertices + low, triangles.astype(np.int64), normals.astype(np.float64)


def foam(spheres: Spheres) -> tuple[Triangles, list[Floats]]:
    """Many balls that are cavities, where these are in no other one."""
    (vertices, triangles, _normals), wires = balls(spheres, max(_COARSE, int((_FOAM / len(spheres)) ** 0.5)))
    size = float(np.ptp(vertices, axis=0).max())

    def level(points: Floats) -> Floats:
        """How deep a point of a ball is in another one, to first order."""
        return np.asarray(-spheres.phi(points.T) - _ROUND_OFF * size)

    # Points on a ball stay on it: between two of them no others are made that matter.
    wall = Smooth(lambda points: np.zeros(len(points)), lambda points: spheres.gradient(points.T).T)
    points, triangles, _rims = cut(wall, vertices, triangles, level)
    inwards = -wall.normals(points)
    return (points, triangles, inwards), [run for wire in wires for run in runs(wire, level(wire) <= 0.0)]


def balls(spheres: Spheres, count: int = _COARSE) -> tuple[Triangles, list[Floats]]:
    """Many balls: coarse, so that thousands can be drawn."""
    box = np.full(3, -1.3), np.full(3, 1.3)
    grid = np.array(np.meshgrid(*_axes(box, count), indexing="ij"))
    unit, triangles, _normals = _mesh(np.sqrt((grid**2).sum(axis=0)) - 1.0, box)
    normals = unit / np.sqrt((unit**2).sum(axis=1))[:, None]
    center, radius = spheres.centers[:, None, :], spheres.radii[:, None, None]
    vertices = (center + radius * normals).reshape(-1, 3)
    first = len(unit) * np.arange(len(spheres))[:, None, None]
    angle = np.linspace(0.0, 2.0 * math.pi, 3 * _COARSE + 1)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    some = slice(None, None, max(1, len(spheres) // _MOST_WIRES))
    circles = [np.roll(circle, k, axis=1) for k in range(3)]
    wires = [c + r * one for c, r in zip(spheres.centers[some], spheres.radii[some], strict=True) for one in circles]
    return (vertices, (triangles + first).reshape(-1, 3), np.tile(normals, (len(spheres), 1))), wires


def each_body(surface: Surface, box: Corners) -> tuple[Triangles, list[Floats]]:
    """Bodies of another kind, each on a grid of its own."""
    solids = surface.solids() if isinstance(surface, Many) else [surface]
    meshes: list[Triangles] = [NOTHING]
    wires: list[Floats] = []
    first = 0
    for solid in solids[:: max(1, len(solids) // _MOST_WIRES)]:
        low, high = (np.array(corner) for corner in replace(solid, side="inside").bounds())  # type: ignore[call-arg]
        low, high = own = _around(np.stack([np.maximum(low, box[0]), np.minimum(high, box[1])]), box)
        axes = _axes(own, _BODY)
        gap = -solid.phi(np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)).reshape(3 * (_BODY,))
        vertices, triangles, normals = _mesh(gap, own) if (low < high).all() else NOTHING
        if not len(vertices):
            continue
        meshes.append((vertices, triangles + first, normals))
        first += len(vertices)
        for axis in range(3):
            u, v = (axes[k] for k in range(3) if k != axis)
            middle = 0.5 * (gap.take(_BODY // 2 - 1, axis) + gap.take(_BODY // 2, axis))
            lines = contourpy.contour_generator(u, v, middle.T).lines(0.0)
            wires += [np.insert(np.asarray(line), axis, 0.5 * (low + high)[axis], axis=1) for line in lines]
    vertices, triangles, normals = (np.concatenate(parts) for parts in zip(*meshes, strict=True))
    return (vertices, triangles, normals), wires


def _around(points: Floats, box: Corners) -> Corners:
    """The box of some points, a little larger, in the box of all."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 2.0 * _MARGIN * np.maximum(high - low, 0.1 * (high - low).max()) / (_POINTS - 1.0)
    return np.maximum(low - margin, box[0]), np.minimum(high + margin, box[1])


class Grids:
    """The walls of a scene at one time [s], in a box around them and particles (3, N)."""

    def __init__(self, scene: Scene, positions: Floats, time: float) -> None:
        self._scene, self._time = scene, time
        low, high = (np.array(corner) for corner in scene.bounds(time))
        reach = _BEYOND * max(scene.extent(), float(np.abs(positions).max()))
        low, high = np.where(np.isfinite(low), low, -reach), np.where(np.isfinite(high), high, reach)
        margin = _MARGIN * (high - low) / (_POINTS - 1.0)
        self.box: Corners = low - margin, high + margin

    def drawn(self, i: int, pose: Pose) -> tuple[Triangles, list[Floats]]:
        """The part of surface i that is a wall, and its wires."""
        (found, *_rest), (low, high) = self._part(i, self._coarse), self.box
        surface: Any = self._scene.surfaces[i]
        around = self.box
        if len(found):
            around = _around(found, self.box)
        elif math.isfinite(surface.size()) and hasattr(surface, "center"):  # smaller than the cells of the coarse grid
            center, half = pose.placed(np.array(surface.center)[:, None])[:, 0], 4.0 * surface.size()
            around = np.maximum(center - half, low), np.minimum(center + half, high)
        # Again, on a grid around this surface only.
        mesh = self._part(i, self._all_in(around))
        return mesh, self._wires(i, mesh[0]) if len(mesh[0]) else []

    @functools.cached_property
    def _coarse(self) -> tuple[Triangles, NDArray[np.int64]]:
        return self._all_in(self.box)

    def _all_in(self, box: Corners) -> tuple[Triangles, NDArray[np.int64]]:
        """All walls in a box, and the surface that each triangle lies on."""
        grid = np.array(np.meshgrid(*_axes(box, _POINTS), indexing="ij"))
        mesh = _mesh(self._gap(grid.reshape(3, -1)).reshape(grid.shape[1:]), box)
        vertices, triangles, _normals = mesh
        middles = vertices[triangles].mean(axis=1).T
        return mesh, self._owner(middles) if len(triangles) else np.empty(0, np.int64)

    def _part(self, i: int, found: tuple[Triangles, NDArray[np.int64]]) -> Triangles:
        """The triangles that lie on surface i, with their vertices only."""
        (vertices, triangles, normals), owner = found
        kept, places = np.unique(triangles[owner == i], return_inverse=True)
        return vertices[kept], places.reshape(-1, 3), normals[kept]

    def _gap(self, points: Floats) -> Floats:
        """The largest gap of all surfaces at points (3, N): 0 on every wall. No particle is where phi is no number."""
        with np.errstate(all="ignore"):
            gap = self._scene.gaps(points, self._time).max(axis=0)
        return np.asarray(np.where(np.isfinite(gap), gap, np.max(gap, where=np.isfinite(gap), initial=1.0)))

    def _owner(self, points: Floats) -> NDArray[np.int64]:
        """The surface that each of the points (3, N) near a wall lies on, -1 where that is open."""
        with np.errstate(all="ignore"):
            gaps = self._scene.gaps(points, self._time)
            owner = np.asarray(np.nan_to_num(gaps, nan=-np.inf).argmax(axis=0))
            for i, volumes in enumerate(self._scene.volumes):
                owner[(owner == i) & are_open(volumes, points, self._time)] = -1
        return owner

    def _wires(self, i: int, vertices: Floats) -> list[Floats]:
        """The curves in which planes across the three axes cut surface i, from end to end."""
        first, last = vertices.min(axis=0), vertices.max(axis=0)
        low, high = _around(vertices, self.box)
        curves = []
        for axis in range(3):
            u, v = (k for k in range(3) if k != axis)
            across = np.linspace(low[u], high[u], _FINE), np.linspace(low[v], high[v], _FINE)
            for part in np.linspace(_END, 1.0 - _END, _PLANES):
                points = np.empty((3, _FINE, _FINE))
                points[axis] = first[axis] + part * (last[axis] - first[axis])
                points[u], points[v] = np.meshgrid(*across)
                gap = self._gap(points.reshape(3, -1)).reshape(_FINE, _FINE)
                for line in contourpy.contour_generator(*across, gap).lines(0.0):
                    curve = np.insert(np.asarray(line), axis, points[axis, 0, 0], axis=1)
                    curves += runs(curve, self._owner(curve.T) == i)
        return curves

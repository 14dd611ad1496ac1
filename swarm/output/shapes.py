"""The walls of a scene as shapes to draw, for any phi: triangles, their area, and the curves of a wire frame."""

import functools
import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import contourpy
import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from .. import surfaces
from ..motion import Pose, WallMotion, pose
from ..particles import Floats
from ..scene import Scene
from ..surfaces import Spheres
from ..surfaces.fields.many import Many
from ..surfaces.openings import are_open
from ..surfaces.outlines.outlined import Outlined
from ..surfaces.rotation import matrix
from ..surfaces.surface import Surface
from ..surfaces.union import Joined, Place
from . import sharp
from .curves import runs
from .named import name_of
from .parts import parts_of
from .planar import PlaneWalls

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
# Vertices (V, 3) [m], triangles (T, 3) and normals (V, 3).
Mesh = tuple[Floats, NDArray[np.int64], Floats]
_NOTHING: Mesh = np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3))


@dataclass(frozen=True)
class Shape:
    """The part of one surface that is a wall of the volume.

    Attributes:
        name: its number and kind, such as "0_ellipsoid"; of a part of a union, "0_union_1_cylinder".
        surface: the number of the surface in the scene; place: of a part in that.
        motion: of a part of a union its own; else None, and it moves with the surface.
        solid: whether particles are kept out of it.
        vertices, triangles, normals: (V, 3) [m], (T, 3), (V, 3).
        wires: curves (k, 3) [m].
        height: of the ribbon that the triangles are, in a scene of two dimensions [m]; else None.
    """

    name: str
    solid: bool
    vertices: Floats
    triangles: NDArray[np.int64]
    normals: Floats
    wires: list[Floats]
    height: float | None = None
    surface: int = 0
    place: Place = ()
    motion: WallMotion | None = None

    def area(self) -> float:
        """Of the triangles [m^2]; in a scene of two dimensions the length of the curves [m]."""
        if self.height is not None:
            return float(sum(np.sqrt((np.diff(curve, axis=0) ** 2).sum(axis=1)).sum() for curve in self.wires))
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return float(0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).sum())


def shapes_of(scene: Scene, positions: Floats, time: float = 0.0, most: float = math.inf) -> list[Shape]:
    """A shape for every surface at a time [s]; where the volume is open, as far as surfaces and particles (3, N) go.

    That of a surface of more than `most` bodies is empty.
    """
    if scene.plane is not None:
        return _shapes_in_plane(scene, positions, time, most)
    walls = _Walls(scene, positions, time)
    # On a grid around all of them the many bodies of a scene would be too small, and a grid around each too slow.
    grouped = {scene.owners_of_pieces[k] for group in scene.order.groups for k in group}
    sharp_ones = _sharp(scene, walls.box, time)
    shapes = []
    for i, (surface, at) in enumerate(zip(scene.surfaces, scene.poses(time), strict=True)):
        bodies = bodies_of(surface) or int(i in grouped)
        mesh, wires = _NOTHING, list[Floats]()
        if not bodies and sharp_ones:
            shapes += sharp_ones[i]
            continue
        if not surface.is_there(time):
            pass
        elif isinstance(surface, surfaces.Mesh):
            mesh, wires = surface.drawn()
        elif bodies <= most and isinstance(surface, Spheres):
            mesh, wires = _placed(at, *_balls(surface))
        elif bodies and bodies <= most:
            mesh, wires = _placed(at, *_bodies(surface, _given(walls.box, at)))
        elif not bodies:
            mesh, wires = walls.drawn(i, at)
        name = name_of(scene, i)
        shapes.append(Shape(name, bodies > 0 or surface.is_solid(), *mesh, wires, surface=i))
    return shapes


def bodies_of(surface: Surface) -> int:
    """The number of bodies of a surface of many, else 0."""
    return len(surface) if isinstance(surface, Many) and not isinstance(surface, Outlined) else 0


def _sharp(scene: Scene, box: Corners, time: float) -> dict[int, list[Shape]]:
    """The shapes of every surface, those of each part of unions, where one has parts or an outline; else none."""
    if not any(isinstance(surface, (Joined, Outlined)) for surface in scene.surfaces):
        return {}
    found: dict[int, list[Shape]] = {}
    for part in parts_of(scene, time):
        whole = scene.surfaces[part.owner]
        if not bodies_of(whole):
            there = part.surface.is_there(time)
            mesh, wires = sharp.drawn(part, box, time) if there else (_NOTHING, [])
            motion = part.surface.motion if part.place else None
            shape = Shape(
                name_of(scene, part.owner, part.place), part.solid, *mesh, wires, None, part.owner, part.place, motion
            )  # fmt: skip
            found.setdefault(part.owner, []).append(shape)
    return found


def _shapes_in_plane(scene: Scene, positions: Floats, time: float, most: float) -> list[Shape]:
    walls, shapes = PlaneWalls(scene, positions, time), []
    grouped = {scene.owners_of_pieces[k] for group in scene.order.groups for k in group}
    parts = parts_of(scene, time) if any(isinstance(surface, Joined) for surface in scene.surfaces) else []
    for i, (surface, at) in enumerate(zip(scene.surfaces, scene.poses(time), strict=True)):
        bodies = bodies_of(surface) or int(i in grouped)
        name, solid = name_of(scene, i), bodies > 0 or surface.is_solid()
        if parts and not bodies:
            for part in (one for one in parts if one.owner == i):
                wires = walls.of_part(part) if part.surface.is_there(time) else []
                drawn = *walls.strip(wires), wires, walls.height
                name, motion = name_of(scene, i, part.place), part.surface.motion if part.place else None
                shapes.append(Shape(name, part.solid, *drawn, i, part.place, motion))
            continue
        wires = walls.curves(i, at, bodies) if bodies <= most and surface.is_there(time) else []
        shapes.append(Shape(name, solid, *walls.strip(wires), wires, walls.height, i))
    return shapes


def since_start(scene: Scene, shape: Shape, time: float, places: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """The turn and the way of a shape since the start: its point that was at x0 is at turn x0 + way.

    `places` are the observables at a frame, `wall_position` and `wall_orientation`, and `time` is that of it [s].
    """
    # x1 = A1 A0^T (x0 - p0) + p1, with places p of the origin
    if shape.motion is not None:
        first, last = pose(shape.motion, 0.0), pose(shape.motion, time)
        turn = last.turn @ first.turn.T
        return turn, last.position() - turn @ first.position()
    first = pose(scene.surfaces[shape.surface].motion, 0.0)
    position, orientation = (of_all[shape.surface] for of_all in places)
    turn = matrix(tuple(orientation)) @ first.turn.T
    return turn, position - turn @ first.position()


def _placed(pose: Pose, mesh: Mesh, wires: list[Floats]) -> tuple[Mesh, list[Floats]]:
    """A mesh and wires where their surface is now."""
    vertices, triangles, normals = mesh
    moved = pose.placed(vertices.T).T, triangles, pose.turned(normals.T).T
    return moved, [pose.placed(wire.T).T for wire in wires]


def _given(box: Corners, pose: Pose) -> Corners:
    """A box around a box of the scene in the frame in which a surface is given."""
    corners = pose.given(np.array(list(itertools.product(*zip(*box, strict=True)))).T)
    return corners.min(axis=1), corners.max(axis=1)


def _axes(box: Corners, count: int) -> list[Floats]:
    return [np.linspace(low, high, count) for low, high in zip(*box, strict=True)]


def _mesh(values: Floats, box: Corners) -> Mesh:
    """The level 0 of values at the points of a grid in the box."""
    if not values.min() < 0.0 < values.max():
        return _NOTHING
    low, high = box
    spacing = tuple((high - low) / (len(values) - 1.0))
    vertices, triangles, normals, _values = marching_cubes(values, 0.0, spacing=spacing)
    return vertices + low, triangles.astype(np.int64), normals.astype(np.float64)


def _balls(spheres: Spheres) -> tuple[Mesh, list[Floats]]:
    """Many balls: coarse, so that thousands can be drawn."""
    box = np.full(3, -1.3), np.full(3, 1.3)
    grid = np.array(np.meshgrid(*_axes(box, _COARSE), indexing="ij"))
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


def _bodies(surface: Surface, box: Corners) -> tuple[Mesh, list[Floats]]:
    """Bodies of another kind, each on a grid of its own."""
    solids = surface.solids() if isinstance(surface, Many) else [surface]
    meshes: list[Mesh] = [_NOTHING]
    wires: list[Floats] = []
    first = 0
    for solid in solids[:: max(1, len(solids) // _MOST_WIRES)]:
        low, high = (np.array(corner) for corner in replace(solid, side="inside").bounds())  # type: ignore[call-arg]
        low, high = own = _around(np.stack([np.maximum(low, box[0]), np.minimum(high, box[1])]), box)
        axes = _axes(own, _BODY)
        gap = -solid.phi(np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)).reshape(3 * (_BODY,))
        vertices, triangles, normals = _mesh(gap, own) if (low < high).all() else _NOTHING
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


class _Walls:
    """The walls of a scene at one time [s], in a box around them and particles (3, N)."""

    def __init__(self, scene: Scene, positions: Floats, time: float) -> None:
        self._scene, self._time = scene, time
        low, high = (np.array(corner) for corner in scene.bounds(time))
        reach = _BEYOND * max(scene.extent(), float(np.abs(positions).max()))
        low, high = np.where(np.isfinite(low), low, -reach), np.where(np.isfinite(high), high, reach)
        margin = _MARGIN * (high - low) / (_POINTS - 1.0)
        self.box: Corners = low - margin, high + margin

    def drawn(self, i: int, pose: Pose) -> tuple[Mesh, list[Floats]]:
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
    def _coarse(self) -> tuple[Mesh, NDArray[np.int64]]:
        return self._all_in(self.box)

    def _all_in(self, box: Corners) -> tuple[Mesh, NDArray[np.int64]]:
        """All walls in a box, and the surface that each triangle lies on."""
        grid = np.array(np.meshgrid(*_axes(box, _POINTS), indexing="ij"))
        mesh = _mesh(self._gap(grid.reshape(3, -1)).reshape(grid.shape[1:]), box)
        vertices, triangles, _normals = mesh
        middles = vertices[triangles].mean(axis=1).T
        return mesh, self._owner(middles) if len(triangles) else np.empty(0, np.int64)

    def _part(self, i: int, found: tuple[Mesh, NDArray[np.int64]]) -> Mesh:
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

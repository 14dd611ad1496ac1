"""The walls of a scene as shapes to draw, for any phi: triangles, their area, and the curves of a wire frame."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..motion import WallMotion, pose
from ..scene import Scene
from ..state import Floats
from ..surfaces import Spheres
from ..surfaces.facets.mesh import Mesh
from ..surfaces.fields.many import Many
from ..surfaces.outlines.outlined import Outlined
from ..surfaces.rotation import matrix
from ..surfaces.surface import Surface
from ..surfaces.union import Joined, Place
from . import sharp
from .gridded import NOTHING, Corners, Grids, balls, each_body, foam, given_box, placed
from .named import name_of
from .parts import parts_of
from .planar import PlaneWalls
from .solids import is_of_solids


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


def those_there(positions: Floats) -> Floats:
    """The positions (3, N) of particles that are there, not NaN; the origin if nobody is."""
    there = ~np.isnan(positions[0])
    if there.all():
        return positions
    return positions[:, there] if there.any() else np.zeros((3, 1))


def shapes_of(scene: Scene, positions: Floats, time: float = 0.0, most: float = math.inf) -> list[Shape]:
    """A shape for every surface at a time [s]; where the volume is open, as far as surfaces and particles (3, N) go.

    That of a field of more than `most` solids is empty: see solids.py.
    """
    positions = those_there(positions)
    if scene.plane is not None:
        return _shapes_in_plane(scene, positions, time, most)
    walls = Grids(scene, positions, time)
    # On a grid around all of them the many bodies of a scene would be too small, and a grid around each too slow.
    grouped = {scene.owners_of_pieces[k] for group in scene.order.groups for k in group}
    sharp_ones = _sharp(scene, walls.box, time)
    shapes = []
    for i, (surface, at) in enumerate(zip(scene.surfaces, scene.poses(time), strict=True)):
        bodies = bodies_of(surface) or int(i in grouped)
        mesh, wires = NOTHING, list[Floats]()
        if not bodies and sharp_ones:
            shapes += sharp_ones[i]
            continue
        if not surface.is_there(time) or (bodies > most and is_of_solids(surface)):
            pass
        elif isinstance(surface, Spheres):
            mesh, wires = placed(at, *(foam(surface) if surface.is_foam() else balls(surface)))
        elif bodies:
            mesh, wires = placed(at, *each_body(surface, given_box(walls.box, at)))
        else:
            mesh, wires = walls.drawn(i, at)
        name = name_of(scene, i)
        solid = surface.is_solid() or i in grouped
        shapes.append(Shape(name, solid, *mesh, wires, surface=i))
    return shapes


def bodies_of(surface: Surface) -> int:
    """The number of bodies of a surface of many, else 0."""
    return len(surface) if isinstance(surface, Many) and not isinstance(surface, Outlined) else 0


def _sharp(scene: Scene, box: Corners, time: float) -> dict[int, list[Shape]]:
    """The shapes of every surface, those of each part of unions, where one has parts, triangles or an outline."""
    if not any(isinstance(surface, (Joined, Mesh, Outlined)) for surface in scene.surfaces):
        return {}
    found: dict[int, list[Shape]] = {}
    for part in parts_of(scene, time):
        whole = scene.surfaces[part.owner]
        if not bodies_of(whole):
            there = part.surface.is_there(time)
            mesh, wires = sharp.drawn(part, box, time) if there else (NOTHING, [])
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
        name, solid = name_of(scene, i), surface.is_solid() or i in grouped
        if parts and not bodies:
            for part in (one for one in parts if one.owner == i):
                wires = walls.of_part(part) if part.surface.is_there(time) else []
                drawn = *walls.strip(wires), wires, walls.height
                name, motion = name_of(scene, i, part.place), part.surface.motion if part.place else None
                shapes.append(Shape(name, part.solid, *drawn, i, part.place, motion))
            continue
        left_out = not surface.is_there(time) or (bodies > most and is_of_solids(surface))
        wires = [] if left_out else walls.curves(i, at, bodies)
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

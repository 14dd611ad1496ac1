"""The walls of a scene as shapes to draw, for any phi."""

import itertools
import math

import numpy as np

from ..motion import pose
from ..scene import Scene
from ..state import Floats
from ..surfaces import Spheres
from ..surfaces.rotation import matrix
from ..words.named import name_of
from . import sharp
from .gridded import NOTHING, Corners, balls, box_around, each_body, foam, given_box, placed
from .parts import parts_of
from .planar import PlaneWalls
from .shape import Shape, levelled


def those_there(positions: Floats) -> Floats:
    """Return the positions (3, N) that are not NaN; the origin if there are no such positions."""
    there = ~np.isnan(positions[0])
    if len(there) and there.all():
        return positions
    return positions[:, there] if there.any() else np.zeros((3, 1))


def shapes_of(scene: Scene, positions: Floats, time: float = 0.0, most: float = math.inf) -> list[Shape]:
    """Return the shapes of every surface at a time [s]; an open volume ends where surfaces and particles (3, N) end.

    The shape of a field of more than `most` solids is empty: see solids.py.
    """
    positions = those_there(positions)
    if scene.plane is not None:
        return _shapes_in_plane(scene, positions, time, most)
    box = box_around(scene, positions, time)
    # Each of the many bodies of a scene has a grid of its own.
    grouped = _grouped(scene)
    found = list[Shape]()
    sharp_ones = _sharp(scene, box, time)
    for i, (surface, at) in enumerate(zip(scene.surfaces, scene.poses(time), strict=True)):
        bodies = surface.body_count() or int(i in grouped)
        if not bodies:
            found += sharp_ones[i]
            continue
        mesh, numbers = NOTHING, np.empty(0, np.int64)
        if not surface.is_there(time) or (bodies > most and surface.halves() is not None):
            pass
        elif isinstance(surface, Spheres):
            mesh, numbers = foam(surface) if surface.is_foam() else balls(surface)
        else:
            mesh, numbers = each_body(surface, given_box(box, at))
        solid = surface.is_solid() or i in grouped
        found.append(Shape(name_of(scene, i), solid, *placed(at, mesh), [], surface=i, many=True, members=numbers))
    return levelled(found)


def cell_of(scene: Scene) -> list[Shape]:
    """Return the edges of the cell of a period, from the origin on, where a scene has no walls around its particles."""
    period = scene.period
    if period is None or None in period or scene.plane or not all(one.is_solid() for one in scene.surfaces):
        return []
    lengths = np.array(period, np.float64)
    edges = []
    for axis in range(3):
        for signs in itertools.product((0.0, 1.0), repeat=2):
            ends = np.insert(np.tile(np.array(signs), (2, 1)), axis, (0.0, 1.0), axis=1) * lengths
            edges.append(ends)
    return [Shape("cell", False, *NOTHING, edges)]


def _grouped(scene: Scene) -> set[int]:
    """Return the listed solids that are fields."""
    compiled = scene.compiled()
    return {compiled.pieces.owners[k] for group in compiled.order.groups for k in group}


def _sharp(scene: Scene, box: Corners, time: float) -> dict[int, list[Shape]]:
    """Return the shapes of every surface without those of many bodies; for a union those of each part."""
    found: dict[int, list[Shape]] = {}
    for part in parts_of(scene, time):
        whole = scene.surfaces[part.owner]
        if not whole.body_count():
            there = part.surface.is_there(time)
            mesh, edges, numbers = sharp.drawn(part, box, time) if there else (NOTHING, [], None)
            motion = part.surface.motion if part.place else None
            shape = Shape(
                name_of(scene, part.owner, part.place), part.solid, *mesh, edges, None, part.owner, part.place, motion,
                members=numbers,
            )  # fmt: skip
            found.setdefault(part.owner, []).append(shape)
    return found


def _shapes_in_plane(scene: Scene, positions: Floats, time: float, most: float) -> list[Shape]:
    if not scene.surfaces:
        return []
    walls, shapes = PlaneWalls(scene, positions, time), []
    grouped = _grouped(scene)
    parts = parts_of(scene, time) if any(surface.parts for surface in scene.surfaces) else []
    for i, (surface, at) in enumerate(zip(scene.surfaces, scene.poses(time), strict=True)):
        bodies = surface.body_count() or int(i in grouped)
        name, solid = name_of(scene, i), surface.is_solid() or i in grouped
        if parts and not bodies:
            for part in (one for one in parts if one.owner == i):
                wires = walls.of_part(part) if part.surface.is_there(time) else []
                drawn = *walls.strip(wires), wires, walls.height
                name, motion = name_of(scene, i, part.place), part.surface.motion if part.place else None
                shapes.append(Shape(name, part.solid, *drawn, i, part.place, motion))
            continue
        left_out = not surface.is_there(time) or (bodies > most and surface.halves() is not None)
        wires = [] if left_out else walls.curves(i, at, bodies)
        shapes.append(Shape(name, solid, *walls.strip(wires), wires, walls.height, i))
    return shapes


def since_start(scene: Scene, shape: Shape, time: float, places: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return the turn and the way of a shape since the start: its point that was at x0 is at turn x0 + way.

    `places` are the observables `wall_position` and `wall_orientation` at a frame, and `time` is the frame's time [s].
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

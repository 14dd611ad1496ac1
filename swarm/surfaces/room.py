"""A room, the intersection of the admissible sides of surfaces: its bounds, and whether it has a volume."""

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..state import Floats
from .instant import box_of, gaps_of, gradient_of, has_room, planes_of
from .surface import UNBOUNDED, Box, HalfSpace, Surface

Room = tuple[Surface, ...]

# An unbounded room is searched for a point up to this multiple of the extent of its surfaces.
_REACH = 2.0
# Where planes leave the volume open, their polyhedron is cut off at this multiple of the extent of the scene.
_FAR = 1e6
# If that cuts the volume, the volume is bounded again at this distance, with the round-off of a vertex there.
_FARTHEST, _ROUND_OFF = 1e15, 1e-14
# Determinants of three normals: below the first the planes meet in a flat corner, below the second in none.
_FLAT, _PARALLEL = 1e-12, 1e-15
# The number of triples of planes that are intersected at once.
_TRIPLES = 4096


def room_bounds(room: Sequence[Surface], time: float = 0.0, within: Box = UNBOUNDED) -> tuple[Floats, Floats]:
    """Return the corners of a box around the part of a room `within` a box at a time [s], infinite where it is open."""
    boxes = np.array([*(box_of(surface, time) for surface in room), within])
    low, high = boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)
    planes = [plane for surface in room for plane in planes_of(surface, surface.half_spaces(), time)]
    return polyhedron_bounds(planes, low, high) if planes else (low, high)


def lasting(room: Sequence[Surface]) -> tuple[Surface, ...]:
    """Return the surfaces of a room that are always present."""
    return tuple(surface for surface in room if surface.present is None)


def may_have_volume(room: Room) -> bool:
    """Whether the bounds of a room leave it a volume."""
    low, high = _ends(lasting(room))
    return bool((low < high).all())


def has_volume(room: Room) -> bool:
    """Whether a room has a point inside."""
    room = lasting(room)
    low, high = _ends(room)
    if not room:
        return True
    return bool((low < high).all()) and has_room(
        low[:, None],
        high[:, None],
        lambda points: gaps_of(room, points, 0.0),
        lambda i, points: gradient_of(room[i : i + 1], points),
    )


def union_bounds(rooms: Iterable[Room]) -> Box:
    """Return the corners of the box around rooms."""
    low, high = zip(*map(room_bounds, rooms), strict=True)
    return tuple(np.min(low, axis=0).tolist()), tuple(np.max(high, axis=0).tolist())


def _ends(room: Room) -> tuple[Floats, Floats]:
    """Return the corners of the box in which a room is searched for a point."""
    low, high = room_bounds(room)
    reach = _REACH * max((surface.extent() for surface in room), default=0.0) or 1.0
    return np.maximum(low, -reach), np.minimum(high, reach)


# --- The polyhedron of half-spaces -----------------------------------------------------------------------


def polyhedron_bounds(planes: list[HalfSpace], low: Any, high: Any) -> tuple[Any, Any]:
    """Return bounds of the intersection of half-spaces with a box, from its vertices."""
    finite = [abs(v) for v in (*low, *high) if math.isfinite(v)] + [abs(offset) for _normal, offset in planes]
    scale = max(finite, default=0.0) or 1.0
    new_low, new_high, is_open, is_flat = _closed_bounds(planes, low, high, _FAR * scale, _FLAT, 1e-9)
    if not (is_open or is_flat):
        return new_low, new_high
    far_low, far_high, is_open, _is_flat = _closed_bounds(planes, low, high, _FARTHEST * scale, 0.0, _ROUND_OFF)
    if is_open:
        return new_low, new_high
    # Closed, but flat and far away, as a cone of half angle near pi/2: the bounds are as accurate as vertices there.
    rough = _ROUND_OFF * max(np.abs(far_low).max(), np.abs(far_high).max()) / scale * (far_high - far_low)
    return np.maximum(low, far_low - rough), np.minimum(high, far_high + rough)


def _solutions(matrices: Any, sides: Any) -> tuple[Any, Any]:
    """Return the solutions of (n, 3, 3) linear systems with right sides (n, 3), and |det|, by elimination with pivots.

    `fill` scales its points by the bounds that follow from them, and the last bit of LAPACK depends on the processor.
    Cramer's rule has too few digits for a cone of half angle near pi/2.
    """
    rows, every = np.concatenate([matrices, sides[:, :, None]], axis=2), np.arange(len(sides))
    with np.errstate(all="ignore"):  # a singular matrix has no solution
        for k in range(2):
            pivot = k + np.abs(rows[:, k:, k]).argmax(axis=1)
            rows[every, k], rows[every, pivot] = rows[every, pivot], rows[every, k]
            for i in range(k + 1, 3):
                rows[:, i] -= (rows[:, i, k] / rows[:, k, k])[:, None] * rows[:, k]
        z = rows[:, 2, 3] / rows[:, 2, 2]
        y = (rows[:, 1, 3] - rows[:, 1, 2] * z) / rows[:, 1, 1]
        x = (rows[:, 0, 3] - rows[:, 0, 1] * y - rows[:, 0, 2] * z) / rows[:, 0, 0]
        return np.stack([x, y, z], axis=1), np.abs(rows[:, 0, 0] * rows[:, 1, 1] * rows[:, 2, 2])


def _closed_bounds(
    planes: list[HalfSpace], low: Any, high: Any, far: float, flattest: float, tolerance: float
) -> tuple[Any, Any, bool, bool]:
    """Return bounds from vertices in a far box, whether the box cuts the volume, and whether a vertex was too flat."""
    box_low, box_high = np.maximum(low, -far), np.minimum(high, far)
    normals = np.vstack([[normal for normal, _offset in planes], np.eye(3), -np.eye(3)])
    offsets = np.concatenate([[offset for _normal, offset in planes], box_high, -box_low])
    is_flat = False
    found_low, found_high = np.full(3, math.inf), np.full(3, -math.inf)
    triples = itertools.combinations(range(len(offsets)), 3)
    while some := list(itertools.islice(triples, _TRIPLES)):
        index = np.array(some)
        vertices, flat = _solutions(normals[index], offsets[index])
        is_flat = is_flat or bool(((flat <= flattest) & (flat > _PARALLEL)).any())
        vertices = vertices[flat > flattest]
        # Vertices that are not finite are left out too: their planes are parallel up to a component of 1e-300.
        vertices = vertices[np.abs(vertices).max(axis=1, initial=0.0) <= 2.0 * far]
        room = tolerance * (np.abs(offsets) + np.abs(vertices).max(axis=1, initial=0.0)[:, None])
        vertices = vertices[(vertices @ normals.T <= offsets + room).all(axis=1)]
        found_low = np.minimum(found_low, vertices.min(axis=0, initial=math.inf))
        found_high = np.maximum(found_high, vertices.max(axis=0, initial=-math.inf))
    if not (found_low <= found_high).all():
        return np.zeros(3), np.zeros(3), False, is_flat
    new_low, new_high = np.maximum(low, found_low), np.minimum(high, found_high)
    open_low, open_high = found_low <= -0.5 * far, found_high >= 0.5 * far
    new_low, new_high = np.where(open_low, low, new_low), np.where(open_high, high, new_high)
    return new_low, new_high, bool(open_low.any() or open_high.any()), is_flat

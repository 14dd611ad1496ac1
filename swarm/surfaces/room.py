"""A room, the intersection of the admissible sides of surfaces: its bounds, its gaps, and whether it has a volume."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .instant import box_of, gaps_of, gradient_of, has_room, planes_of
from .polyhedron import polyhedron_bounds
from .surface import UNBOUNDED, Box, Surface

Floats = NDArray[np.float64]
Room = tuple[Surface, ...]

# Of the extent, how far a room without end is searched for a point in it.
_REACH = 2.0


def room_bounds(room: Sequence[Surface], time: float = 0.0, within: Box = UNBOUNDED) -> tuple[Floats, Floats]:
    """The corners of a box around what of a room is `within` another box at a time [s], infinite where it is open."""
    boxes = np.array([*(box_of(surface, time) for surface in room), within])
    low, high = boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)
    planes = [plane for surface in room for plane in planes_of(surface, surface.half_spaces(), time)]
    return polyhedron_bounds(planes, low, high) if planes else (low, high)


def lasting(room: Sequence[Surface]) -> tuple[Surface, ...]:
    """The surfaces of a room that are always there."""
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


def _ends(room: Room) -> tuple[Floats, Floats]:
    """The corners of the box in which a room is searched for a point."""
    low, high = room_bounds(room)
    reach = _REACH * max((surface.extent() for surface in room), default=0.0) or 1.0
    return np.maximum(low, -reach), np.minimum(high, reach)

"""A room, the intersection of the admissible sides of surfaces: its bounds, its gaps, and whether it has a volume."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .instant import box_of, has_room, planes_of, side_of
from .polyhedron import polyhedron_bounds
from .surface import UNBOUNDED, Surface

Floats = NDArray[np.float64]
Room = tuple[Surface, ...]

# Of the extent, how far a room without end is searched for a point in it.
_REACH = 2.0


def room_bounds(room: Sequence[Surface], time: float = 0.0) -> tuple[Floats, Floats]:
    """The corners of a box around a room at a time [s], infinite where it is open."""
    boxes = np.array([box_of(surface, time) for surface in room] or [UNBOUNDED])
    low, high = boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)
    planes = [plane for surface in room for plane in planes_of(surface, surface.half_spaces(), time)]
    return polyhedron_bounds(planes, low, high) if planes else (low, high)


def room_gaps(room: Sequence[Surface], points: Floats, time: float = 0.0) -> Floats:
    """The gap of every surface of a room at points (3, N)."""
    return np.array([side_of(surface) * surface.phi(points, time) for surface in room])


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
    gaps, gradients = _gaps_of(room), _gradients_of(room)
    return not room or (bool((low < high).all()) and has_room(low[:, None], high[:, None], gaps, gradients))


def _ends(room: Room) -> tuple[Floats, Floats]:
    """The corners of the box in which a room is searched for a point."""
    low, high = room_bounds(room)
    reach = _REACH * max((surface.extent() for surface in room), default=0.0) or 1.0
    return np.maximum(low, -reach), np.minimum(high, reach)


def _gaps_of(room: Room) -> Callable[[Floats], Floats]:
    return lambda points: room_gaps(room, points)


def _gradients_of(room: Room) -> Callable[[int, Floats], Floats]:
    return lambda i, points: side_of(room[i]) * room[i].gradient(points)

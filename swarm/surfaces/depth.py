"""How deep a point is in any wall of some."""

import numpy as np

from ..kernel.jit import select
from .walls import Field


def penetration(walls, r):
    """Largest distance outside, max(g, 0)/|grad g|, over all walls."""
    deepest = 0.0
    for _number, wall in reversed(walls.shared()):
        distance = wall.members.deepest_in_cell(r) if isinstance(wall, Field) else wall.distance(r)
        deepest = select(distance > deepest, distance, deepest)
    for rooms in walls.joined():
        distance = _out_of_all(rooms, r)
        deepest = select(distance > deepest, distance, deepest)
    return deepest


def _out_of_all(rooms, r):
    """Distance outside of the nearest room of a union."""
    least = np.inf
    for room in rooms:
        farthest = 0.0
        for _number, wall, _gentle in room:
            distance = wall.distance(r)
            farthest = select(distance > farthest, distance, farthest)
        least = select(farthest < least, farthest, least)
    return least

"""The walls of a scene with unions, from a description."""

import math
from collections.abc import Sequence

import numpy as np

from ..kernel.vector import Vec, norm
from .moving import Marched, Strided
from .surface import Surface
from .walls import Walls

# Of the extent of a union, the slack of its rooms.
_SLACK = 1e-13
# Places at which it is asked how steep a level is, and moves of each onto its wall.
_PLACES, _MOVES = 64, 4


def with_rooms(walls: Walls, unions: Sequence[Sequence[Sequence[Surface]]]) -> Walls:
    """The walls of a scene of which the last are those of unions: of each its rooms, and of these the surfaces."""
    if not unions:
        return walls
    gentle = tuple(tuple(tuple(g for one in room for g in _gentle(one)) for room in rooms) for rooms in unions)
    extent = max(surface.extent() for rooms in unions for room in rooms for surface in room)
    if isinstance(walls, Strided):
        # Lanes take the safe steps of walls that hold every particle.
        walls = Marched(*walls)
    return walls._replace(unions=gentle, slack=_SLACK * (extent or 1.0))


def _gentle(surface: Surface) -> list[float]:
    """1/the steepness of the level of each wall of a surface, at its steepest place."""
    random, reach = np.random.default_rng(0), surface.extent() or 1.0
    points = reach * random.uniform(-1.0, 1.0, (3, _PLACES))
    found = []
    with np.errstate(all="ignore"):
        for wall in surface.walls():
            places = points
            for _move in range(_MOVES):
                slope = np.array(np.broadcast_arrays(*wall.gradient(Vec(*places)), places[0])[:3])
                places = places - wall.phi(Vec(*places)) / (slope**2).sum(axis=0) * slope
            slopes = [float(norm(wall.inner_gradient(Vec(*place)))) for place in places.T if np.isfinite(place).all()]
            steepest = max((slope for slope in slopes if slope < math.inf), default=1.0)
            found.append(1.0 / steepest if steepest > 0.0 else 1.0)
    return found

"""The walls of a scene with unions, from a description."""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...kernel.vector import Vec, norm
from ..in_motion.moving import Marched, Strided
from ..surface import Surface, slopes_of
from ..walls import Walls

# The slack of rooms, as a part of the extent of their union.
_SLACK = 1e-13
# Where rooms touch, a particle that meets a wall is placed this multiple of the slack inside it.
_INSET = 3.0
# A place is on a wall up to this distance from it, relative to the extent. Two walls touch if this number of places on
# one wall are on the other one.
_TOUCHES, _SOME = 1e-12, 3
# The places at which the steepness of a level is evaluated, and the moves of each onto its wall.
_PLACES, _MOVES = 64, 4


def with_rooms(walls: Walls, unions: Sequence[Sequence[Sequence[Surface]]]) -> Walls:
    """Return the walls of a scene, of which the last are those of unions, with rooms; `unions` gives their surfaces."""
    if not unions:
        return walls
    gentle = tuple(tuple(tuple(g for one in room for g in _gentle(one)) for room in rooms) for rooms in unions)
    extent = max(surface.extent() for rooms in unions for room in rooms for surface in room)
    if isinstance(walls, Strided):
        # Lanes take safe steps only to walls that hold every particle.
        walls = Marched(*walls)
    slack = _SLACK * (extent or 1.0)
    touch = any(_wall_between(*pair) for rooms in unions for pair in itertools.combinations(rooms, 2))
    inset = _INSET * slack if touch else None
    return walls._replace(unions=gentle, slack=slack, inset=inset)


def _wall_between(one: Sequence[Surface], other: Sequence[Surface]) -> bool:
    extent = max(surface.extent() for surface in (*one, *other)) or 1.0
    for surface in one:
        for wall in surface.walls():
            places = np.array(_places_on(wall, surface.extent()))
            there = Vec(*places)
            with np.errstate(all="ignore"):
                n = wall.side * slopes_of(wall, there)
                for mate in (mate for neighbour in other for mate in neighbour.walls()):
                    m = mate.side * slopes_of(mate, there)
                    size = np.sqrt((m**2).sum(axis=0))
                    on_it = np.abs(mate.phi(there)) <= _TOUCHES * extent * size
                    opposite = (n * m).sum(axis=0) < -0.999999 * size * np.sqrt((n**2).sum(axis=0))
                    if (on_it & opposite).sum() >= _SOME:
                        return True
    return False


def _places_on(wall: Any, extent: float) -> Any:
    """Return places on a wall (3, N)."""
    places = (extent or 1.0) * np.random.default_rng(0).uniform(-1.0, 1.0, (3, _PLACES))
    with np.errstate(all="ignore"):
        for _move in range(_MOVES):
            slope = slopes_of(wall, Vec(*places))
            places = places - wall.phi(Vec(*places)) / (slope**2).sum(axis=0) * slope
    return places


def _gentle(surface: Surface) -> list[float]:
    """Return 1/the steepness of the level of each wall of a surface, at its steepest place."""
    found = []
    with np.errstate(all="ignore"):
        for wall in surface.walls():
            places = _places_on(wall, surface.extent())
            slopes = [float(norm(wall.inner_gradient(Vec(*place)))) for place in places.T if np.isfinite(place).all()]
            steepest = max((slope for slope in slopes if slope < math.inf), default=1.0)
            found.append(1.0 / steepest if steepest > 0.0 else 1.0)
    return found

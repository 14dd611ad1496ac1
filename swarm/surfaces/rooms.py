"""Unions among the walls of a scene: each a union of rooms, and a room the intersection of the sides of its walls.

A particle is in the rooms that hold it, to a small distance, `Walls.slack`. Its flight leaves a union where it leaves
the last of these, unless it is inside of another one there by more than that: then it goes on, in the next pass. So
rooms that touch without overlapping stay apart, and no round-off lets a particle out at an edge.

What is asked here of the rooms of a union is given them as `Walls.joined` does: for each room its walls, as (number,
wall, 1/the steepness of its level).
"""

import math
from collections.abc import Sequence

import numpy as np

from ..kernel.gravity import displacement
from ..kernel.jit import select
from ..kernel.vector import Vec, norm
from .surface import Surface
from .walls import Walls

# A flight goes on into a room that it is inside of by so many times the slack.
_INSIDE = 4.0
# Of the extent of a union, the slack of its rooms.
_SLACK = 1e-13
# Places at which it is asked how steep a level is, and moves of each onto its wall.
_PLACES, _MOVES = 64, 4


# --- From a description ----------------------------------------------------------------------------------


def with_rooms(walls: Walls, unions: Sequence[Sequence[Sequence[Surface]]]) -> Walls:
    """The walls of a scene of which the last are those of unions: of each its rooms, and of these the surfaces."""
    if not unions:
        return walls
    gentle = tuple(tuple(tuple(g for one in room for g in _gentle(one)) for room in rooms) for rooms in unions)
    extent = max(surface.extent() for rooms in unions for room in rooms for surface in room)
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


# --- In kernels ------------------------------------------------------------------------------------------


def gaps_in(rooms, r):
    """How far a point is outside of each room, about: a length, below 0 inside."""
    return tuple(gap_in(room, r) for room in rooms)


def gap_in(room, r):
    """The same of one room."""
    farthest = -math.inf
    for _number, wall, gentle in reversed(room):
        here = wall.level_of(wall.inner(r)) * gentle
        farthest = select(here <= farthest, farthest, here)
    return farthest


def least_of(gaps):
    """The least of some gaps."""
    least = math.inf
    for gap in reversed(gaps):
        least = select(gap <= least, gap, least)
    return least


def held_by(walls, gaps):
    """Which rooms hold a point, by its gaps: the nearest one at least."""
    least = least_of(gaps)
    return tuple((gap <= walls.slack) | (gap == least) for gap in gaps)


def is_inside_any(walls, gaps):
    """Whether a flight goes on in a room, by its gaps there."""
    found = False
    for gap in reversed(gaps):
        found = (gap < -_INSIDE * walls.slack) | found
    return found


def leaving(walls, rooms, leaves, gravity, flight, stops):
    """When a flight (r, v) leaves a union: (time, wall or -1).

    `leaves` are the times when it leaves each room, with the wall, or -1 where what comes after is not known yet. Where
    it goes on in another room there the wall is -1, unless it `stops`.
    """
    r, v = flight
    held = held_by(walls, gaps_in(rooms, r))
    last, wall = -math.inf, -1.0
    for holds, (time, number) in zip(reversed(held), reversed(leaves), strict=True):
        later = holds & (time > last)
        last, wall = select(later, time, last), select(later, number, wall)
    if stops:
        return last, wall
    there = r + displacement(gravity, v, last)
    return last, select(is_inside_any(walls, gaps_in(rooms, there)), -1.0, wall)

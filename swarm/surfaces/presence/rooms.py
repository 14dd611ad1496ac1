"""Unions among the walls of a scene: each a union of rooms, and a room the intersection of the sides of its walls.

A particle is in every room that contains it to within a small distance, `Walls.slack`. Its flight leaves a union where
it leaves the last of these rooms. If it is inside another room there, by a few times that distance, it continues in
the next pass. So rooms that touch without overlapping stay apart, and no round-off lets a particle out at an edge.

The functions take the rooms of a union in the form of `Walls.joined`: for each room its walls, as (number, wall, 1/the
steepness of its level).
"""

import math
from typing import Any

from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import select
from ...kernel.vector import square
from .absence import BEYOND, FLIES, Absence, lie_on_each_other

# A flight continues in another room if it is inside it by more than this multiple of the slack.
_INSIDE = 4.0
# In unions of up to this number of walls a flight crosses several rooms in one pass. For two balls an impact then takes
# 6.1 ns, in place of 6.7. For a box, a tube and a box, with eight walls and few doorways, it is 18 in place of 14.
_AT_ONCE = 4
# A particle that passes an open wall continues from this multiple of the slack behind it, where it is in one room.
_THROUGH = 2.0
# Walls nearer than this multiple of the slack touch a particle. A room that does not hold it counts as one with the
# second number of walls, more than any room has.
_TOUCH, _OUT = 1024.0, 1e6


def gaps_in(rooms, r, t=0.0):
    """Return about how far a point is outside each room after a time [s]: lengths [m], below 0 inside."""
    return tuple(gap_in(room, r, t) for room in rooms)


def gap_in(room, r, t=0.0):
    """Return about how far a point is outside one room after a time [s] [m]."""
    farthest = -math.inf
    for _number, wall, gentle in reversed(room):
        then = wall.later(t)
        here = then.level_of(then.inner(r)) * gentle
        farthest = select(here <= farthest, farthest, here)
    return farthest


def least_of(gaps):
    """Return the least of some gaps."""
    least = math.inf
    for gap in reversed(gaps):
        least = select(gap <= least, gap, least)
    return least


def held_by(walls, gaps):
    """Return which rooms contain a point with these gaps: at least the nearest one."""
    held: Any = ()
    least, nearest = least_of(gaps), False
    for gap in gaps:
        is_nearest = (gap == least) & (not nearest)
        nearest = is_nearest | nearest
        # Where rooms touch, a particle at the wall between two rooms is in one of them only.
        most = walls.slack if walls.inset is None else -walls.slack
        held = (*held, (gap <= most) | is_nearest)
    return held


def is_inside(walls, gap):
    """Whether a flight continues in a room, by its gap there."""
    return gap < -_INSIDE * walls.slack


def is_inside_any(walls, gaps):
    """Whether a flight continues in any room, by its gaps there."""
    found = False
    for gap in reversed(gaps):
        found = is_inside(walls, gap) | found
    return found


def leaving(walls, rooms, leaves, gravity, flight, stops):
    """Return when a flight (r, v) leaves a union: (time, wall or -1).

    `leaves` has for each room (the time at which the flight leaves it, the wall, or -1 if it surely stays inside until
    then). If the flight continues in another room the wall is -1, unless it `stops`.
    """
    r, v = flight
    held = held_by(walls, gaps_in(rooms, r))
    last, wall = -math.inf, -1.0
    for holds, (time, number) in zip(reversed(held), reversed(leaves), strict=True):
        later = holds & (time > last)
        last, wall = select(later, time, last), select(later, number, wall)
    if stops:
        return last, wall
    few = sum(map(len, rooms)) <= _AT_ONCE
    exits = tuple(_leaves_once(room) for room in rooms) if gravity is None and few else ()
    if exits and all(one is not False for one in exits):
        for _other in rooms[1:]:
            last, wall = _through(walls, rooms, leaves, exits, (r, v), (last, wall))
        return last, wall
    there = r + displacement(gravity, v, last)
    return last, select(is_inside_any(walls, gaps_in(rooms, there, last)), -1.0, wall)


def _leaves_once(room):
    """Whether a flight that enters a room leaves it by the first hits with its walls that are found at the start."""
    once = True
    for _number, wall, _gentle in room:
        once = False if once is False or wall.leaves_once is False else once & wall.leaves_once
    return once


def _through(walls, rooms, leaves, exits, flight, left):
    """Return when a flight (r, v) that leaves a room leaves the other rooms there: (time, wall).

    The times of walls that are left once are known. If none of these is later, the flight continues in the next pass.
    """
    (r, v), (time, wall) = flight, left
    last, number, inside = time, wall, False
    gaps = gaps_in(rooms, r + v * time, time)
    for gap, once, (leaves_at, at) in zip(reversed(gaps), reversed(exits), reversed(leaves), strict=True):
        here = is_inside(walls, gap)
        later = here & once & (leaves_at > last)
        last, number = select(later, leaves_at, last), select(later, at, number)
        inside = here | inside
    return last, select(inside & (not (last > time)), -1.0, number)


def at_the_end(walls, gravity, v, remaining, hit):
    """Return the `Hit`, at the end of the frame if later by round-off: no particle ends beyond a wall it touches."""
    late, w = hit.time - remaining, accelerated(gravity, v, remaining)
    soon = (hit.wall >= 0.0) & (late > 0.0) & (late * late * square(w) <= walls.slack * walls.slack)
    return hit._replace(time=select(soon, remaining, hit.time))


def inside_of(walls, number, r):
    """Return the place r, moved a little inside the wall with this number if it is the wall of a room."""
    is_of_room = number >= walls.joined()[0][0][0][0]
    return r - select(is_of_room, walls.inset, 0.0) * walls.unit_normal(number, r)


def owner_of(walls, rooms, r):
    """Return the number of the room of the walls near a point: with the fewest walls there, then the deepest."""
    owner, fewest, deepest = 0, math.inf, math.inf
    for k, room in enumerate(rooms):
        gap, touching = gap_in(room, r), 0.0
        for _number, wall, gentle in room:
            near = wall.level_of(wall.inner(r)) * gentle >= -_TOUCH * walls.slack
            touching += select(near, 1.0, 0.0)
        touching = select(gap > walls.slack, _OUT, touching)
        better = (touching < fewest) | ((touching == fewest) & (gap < deepest))
        owner, fewest, deepest = (
            select(better, k, owner),
            select(better, touching, fewest),
            select(better, gap, deepest),
        )
    return owner


# --- Particles on walls ----------------------------------------------------------------------------------


class Rooms(Absence):
    """The rooms of a union: a wall is absent in another room, and outside its own.

    Edges between rooms are re-entrant: a particle that slides from one room into another flies there. Where walls of
    two rooms lie on each other, as the floors of two boxes side by side, it continues along the wall of the other room.
    """

    rooms: Any

    def is_of(self, wall):
        found = False
        for room in self.rooms:
            found = is_of_room(room, wall) | found
        return found

    def takes(self, walls, wall, r, near, depth):
        least, gaps, found = depth * walls.slack, gaps_in(self.rooms, r), False
        for k, room in enumerate(self.rooms):
            beyond = gaps[k] > least
            for j, gap in enumerate(gaps):
                beyond = beyond | (gap < -least) if j != k else beyond
            found = (is_of_room(room, wall) & beyond) | found
        return found

    def wall_after(self, walls, wall, r, near):
        """Return a wall of another room that lies on this one, if the particle is inside no other room."""
        found, flies = -1.0, False
        for room in self.rooms:
            if not is_of_room(room, wall):
                gap = gap_in(room, r)
                flies = flies or gap < -FLIES * walls.slack
                if gap <= BEYOND * walls.slack:
                    for other, _wall, _gentle in room:
                        found = other if lie_on_each_other(walls, wall, other, r) else found
        return -1.0 if flies else found


def is_of_room(room, wall):
    """Whether a wall is one of a room."""
    return (wall >= room[0][0]) & (wall <= room[-1][0])


def depth_behind(walls):
    """Return how deep inside the next room particles continue after they pass an open wall [m]."""
    return _THROUGH * walls.slack if walls.inset is None else walls.inset


def other_side(walls, wall, r):
    """Return the place on the other side of a wall, from a place on it."""
    return walls.project(wall, r) + depth_behind(walls) * walls.unit_normal(wall, r)


def leads_on(walls, wall, r):
    """Whether another room of its union is on the other side of a wall, at a place on it."""
    found = False
    for rooms in walls.joined():
        gaps = gaps_in(rooms, other_side(walls, wall, r))
        for k, room in enumerate(rooms):
            for j, gap in enumerate(gaps):
                found = (is_of_room(room, wall) & (gap <= walls.slack)) | found if j != k else found
    return found

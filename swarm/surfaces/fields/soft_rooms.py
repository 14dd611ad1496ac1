"""A union of several rooms as one wall: the distance outside all rooms, for soft walls, into which points go.

The gap of a room is the largest gap of its walls; for a point beyond several of them the root of the sum of the
squares, as of separate springs. The gap of the union is the least of its rooms: in a doorway there is no wall, and
behind an edge between two rooms the nearer one pushes a point back.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ...kernel.jit import outlined, select
from ...kernel.record import Record
from ...kernel.vector import ZERO, either
from ..balls.joined_rooms import JoinedRooms
from ..presence.joined import with_rooms
from ..surface import LAWS
from ..time_of_impact import flights
from ..walls import Walls, all_walls
from .members import SignedDistance
from .one_wall import OneWall

# The common arguments of all parts of a union that is one wall, besides their openings.
IN_COMMON = *LAWS, "motion", "present"


class RoomsTogether(Record):
    """The rooms of a union as the members of `OneWall`."""

    walls: Walls

    @outlined
    def foot(self, tree, r):
        """Return the `SignedDistance` of a point."""
        gap, normal = math.inf, ZERO
        for rooms in self.walls.joined():
            for room in rooms:
                deepest, steep, squares, sums = -math.inf, ZERO, 0.0, ZERO
                for _number, wall, _gentle in room:
                    q = wall.inner(r)
                    one, (slope, _bend) = wall.gap_of(q), wall.gap_slope(q, q)
                    n = slope * wall.inner_gradient(r)
                    deeper, depth = one > deepest, select(one > 0.0, one, 0.0)
                    deepest, steep = select(deeper, one, deepest), either(deeper, n, steep)
                    squares, sums = squares + depth * depth, either(one > 0.0, sums + depth * n, sums)
                away = math.sqrt(squares)
                is_out = away > 0.0
                deepest = select(is_out, away, deepest)
                steep = either(is_out, sums * (1.0 / select(is_out, away, 1.0)), steep)
                nearer = deepest < gap
                gap, normal = select(nearer, deepest, gap), either(nearer, steep, normal)
        return SignedDistance(gap, normal)

    @outlined
    def field_hit(self, gravity, r, v):
        """Return the `Hit` where a flight leaves the last of the rooms that hold it, or continues in another one."""
        return flights.first_hit(self.walls, gravity, r, v)

    def loosened(self, reach):
        """Return the same rooms: they have no tables."""
        return self


@dataclass(frozen=True, repr=False)
class SoftRooms(JoinedRooms):
    """A union of several rooms for points that go into its wall."""

    is_one_wall = True

    def walls(self) -> tuple[Any, ...]:
        return (self._whole,)

    @cached_property
    def _whole(self) -> OneWall:
        whole = all_walls(one for room in self.rooms_of for one in room)
        return OneWall(RoomsTogether(with_rooms(whole, [self.rooms_of])), None)


def soft_rooms(union: Any) -> SoftRooms:
    """Return a union of several rooms as one wall, with the common arguments of all of its parts."""
    one = union.rooms[0][0]
    return SoftRooms(rooms_of=union.rooms, **{name: getattr(one, name) for name in IN_COMMON})

"""Boundaries of patches: fields of walls each of which is there on a part of itself only, as the facets of a mesh.

A field of `Patched` members is flown to as any field: `field_hit` gives the first hit that is on a patch. What slides
on a wall of it goes on, where its patch ends, on the wall that `wall_after` says, or flies. What has no edges but the
re-entrant ones between parts is a union, rooms.py.
"""

from typing import Any

from ...kernel.record import Record
from .absence import Absence


class Patched(Record):
    """What a field gives of its walls where each is there on its patch only. See also `fields.members.Members`.

    `list_in_cell` and its like name the walls with a patch that may be near a point. What slides on another wall
    meets one by `crossing.arrival`, which asks whether it `is_there`.
    """

    def is_there(self, number, r, near):
        """Whether the patch of a wall reaches to a place on it, or nearer to it than `near`."""
        raise NotImplementedError

    def whole(self, number):
        """A wall without its edges."""
        return self.wall(number)  # type: ignore[attr-defined]

    def is_ahead(self, number, start, end, near):
        """Whether what goes from one place to another may come through the patch of a wall.

        No place on its way is farther from the end than `near`.
        """
        return True

    def wall_after(self, number, r, near):
        """The wall on which what slides on this one goes on beyond the end of its patch at r; -1: it flies."""
        return -1.0

    def goes_on(self, number, other):
        """Whether another wall joins this one smoothly where it ends: what slides on this one does not meet it."""
        return False


class Patches(Absence):
    """A field of `Patched` walls among the walls of a scene: a wall is absent beyond its patch."""

    first: float  # the number of the first of its walls
    members: Any

    def is_of(self, wall):
        return (wall >= self.first) & (wall < self.first + self.members.count())

    def takes(self, walls, wall, r, near, depth):
        return self.is_of(wall) & (not self.members.is_there(wall - self.first, r, depth * near))

    def wall_after(self, walls, wall, r, near):
        after = self.members.wall_after(wall - self.first, r, near)
        return self.first + after if after >= 0.0 else -1.0

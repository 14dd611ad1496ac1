"""Boundaries of patches: fields of walls each of which is present on a part of itself only, as the facets of a mesh.

A flight to a field of `Patched` members is as to any field: `field_hit` returns the first hit on a patch. A particle
that slides on a wall of it passes, where the patch ends, to the wall that `wall_after` returns, or flies. A solid
with only the re-entrant edges between parts is a union, rooms.py.
"""

from typing import Any

from ...kernel.record import Record
from .absence import Absence


class Patched(Record):
    """The methods of a field with walls each of which is present on its patch only. See also `fields.members.Members`.

    `list_in_cell` and the like list the walls with a patch that may be near a point. A particle that slides on another
    wall meets one by `crossing.arrival`, which calls `is_there`.
    """

    def is_there(self, number, r, near):
        """Whether the patch of a wall reaches to within `near` of a place on it."""
        raise NotImplementedError

    def whole(self, number):
        """Return a wall without its edges."""
        return self.wall(number)  # type: ignore[attr-defined]

    def is_ahead(self, number, start, end, near):
        """Whether a move between two places may come through the patch of a wall.

        No place on the way is farther from the end than `near`.
        """
        return True

    def wall_after(self, number, r, near):
        """Return the wall to which a particle that slides on this one passes at the end of its patch; -1: it flies."""
        return -1.0

    def goes_on(self, number, other):
        """Whether another wall continues this one smoothly: a particle that slides on this one does not meet it."""
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

"""Walls as a contact step takes them: of a field the member that is met, of a union the room, and lowered if centred.

A centred step begins in State I, on the level surface of phi through its start, and ends on it: there the gap is 0.
"""

from typing import Any

from ..kernel.jit import select
from .contract import Smooth
from .frames import Unturned
from .presence.doors import Ajar
from .presence.rooms import is_of_room
from .walls import Field


class Lowered(Unturned):
    """A wall with a gap that is less by `level`; flights meet the wall itself."""

    body: Any
    level: float

    # A chord from the wall may have a closed form that one from a level does not have.
    chord_guess, chord_improve, chord_sweeps = Smooth.chord_guess, Smooth.chord_improve, Smooth.chord_sweeps

    def gap_of(self, q):
        return self.body.gap_of(q) - self.level

    def level_of(self, q):
        return self.gap_of(q)


def as_met(walls, number):
    """The walls that a contact with this one may be one with: of fields and unions no other bodies, and no other rooms.

    Of each field one member is in its place, that with this number, which others do not reach.
    """
    each: Any = ()
    for first, wall in walls.shared():
        if isinstance(wall, Field):
            here = (number >= first) & (number < first + wall.count())
            each = (*each, Ajar(wall.members.wall(number - first), select(here, 1.0, 0.0)))
        else:
            each = (*each, wall)
    for rooms in walls.joined():
        for room in rooms:
            here = select(is_of_room(room, number), 1.0, 0.0)
            each = (*each, *(Ajar(wall, here) for _number, wall, _gentle in room))
    return walls.alone(each)


def lowered(walls, number, r):
    """All walls, that with this number lowered to the point r."""
    levels = (select(number == k, wall.gap_of(wall.inner(r)), 0.0) for k, wall in enumerate(walls.each))
    return walls._replace(each=tuple(map(Lowered, walls.each, levels)))

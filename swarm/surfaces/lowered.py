"""Walls in a contact step: a member for its field, a room for its union, and lowered if the step is centred.

A centred step begins in State I, on the level surface of phi through its start, and ends on it: the gap is 0 there.
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

    # A chord from the wall may have a closed form where one from a level has none.
    chord_guess, chord_improve, chord_sweeps = Smooth.chord_guess, Smooth.chord_improve, Smooth.chord_sweeps

    def gap_of(self, q):
        return self.body.gap_of(q) - self.level

    def level_of(self, q):
        return self.gap_of(q)


def as_met(walls, number):
    """Return the walls that a contact with wall `number` may involve: no other bodies of fields, and no other rooms.

    Each field is replaced by one member, that with this number, which other walls do not reach.
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
    """Return all walls, with wall `number` lowered to the point r."""
    levels = (select(number == k, wall.gap_of(wall.inner(r)), 0.0) for k, wall in enumerate(walls.each))
    return walls._replace(each=tuple(map(Lowered, walls.each, levels)))

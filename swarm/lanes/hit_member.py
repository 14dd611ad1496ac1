"""The body of a field that each lane has met: its numbers in rows of lanes, so that contacts with bodies vectorise.

A contact writes to the lanes. The compiler cannot prove that a table of numbers that it reads does not overlap the
lanes, and then it does not vectorise: 13 of the 29 ns of a pass. So these rows are on the stack.
"""

from typing import Any

import numpy as np

from ..kernel.arrays import copy_row, index, scratch
from ..kernel.jit import select
from ..kernel.record import Record
from ..surfaces.fields.members import gathered, width
from ..surfaces.in_motion.moving import Carried
from ..surfaces.walls import Field, Walls
from .table import STRIDE


class Picked(Record):
    """A field reduced to the body that was met."""

    body: Any
    number: float

    def count(self):
        """The number of its walls."""
        return self.number

    def wall(self, number):
        """The body that was met."""
        return self.body


def _fields(walls):
    """The fields of a scene with their numbers; () if walls move, as each contact then looks at all bodies."""
    return () if isinstance(walls, Carried) else walls.fields()


def picks(method, walls):
    """Allocate the rows of a body in each lane for every field, or () if a contact looks at all bodies."""
    if method.looks_around:
        return ()
    return tuple(scratch((STRIDE, width(field.members.like)), np.float64) for _number, field in _fields(walls))


def pick(walls, lanes, picked, live):
    """Copy the numbers of the body that each lane has met; any body of a field that the lane has not met."""
    for (before, field), rows in zip(_fields(walls) if picked else (), picked, strict=True):
        members, last = field.members, field.count() - 1.0
        for i in range(index(live)):
            wall = lanes.wall[i] - before
            m = index(int(select(wall < 0.0, 0.0, select(wall > last, last, wall))))
            copy_row(rows, i, members.table, m, width(members.like))


def of_lane(walls, picked, i):
    """Return the walls of a scene for the contact of one lane."""
    if not picked:
        return walls
    fields = (
        Field(Picked(gathered(field.members.as_met(), rows, i, 0), field.count()))
        for (_number, field), rows in zip(_fields(walls), picked, strict=True)
    )
    return Walls((*fields, *walls.others().each))

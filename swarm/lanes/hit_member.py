"""The body of a field that each lane has met: its numbers in rows of lanes, so that contacts with bodies vectorise.

A contact writes into the lanes. The compiler cannot prove that a table of numbers that it reads does not overlap the
lanes, and vectorises nothing: 13 of the 29 ns of a pass. So these rows are on the stack.
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
    """A field of which one body matters."""

    body: Any
    number: float

    def count(self):
        """The number of its walls."""
        return self.number

    def wall(self, number):
        """The one that matters."""
        return self.body


def _fields(walls):
    """The fields of a scene, with their numbers. Of walls that move each contact looks at all."""
    return () if isinstance(walls, Carried) else walls.fields()


def picks(method, walls):
    """Room for the numbers of a body in each lane, of every field, or () if a contact looks at all bodies."""
    if method.looks_around:
        return ()
    return tuple(scratch((STRIDE, width(field.members.like)), np.float64) for _number, field in _fields(walls))


def pick(walls, lanes, picked, live):
    """The numbers of the body that each lane has met; of any where it has met none of this field."""
    for (before, field), rows in zip(_fields(walls) if picked else (), picked, strict=True):
        members, last = field.members, field.count() - 1.0
        for i in range(index(live)):
            wall = lanes.wall[i] - before
            m = index(int(select(wall < 0.0, 0.0, select(wall > last, last, wall))))
            copy_row(rows, i, members.table, m, width(members.like))


def of_lane(walls, picked, i):
    """The walls of a scene for the contact of one lane."""
    if not picked:
        return walls
    fields = (
        Field(Picked(gathered(field.members.as_met(), rows, i, 0), field.count()))
        for (_number, field), rows in zip(_fields(walls), picked, strict=True)
    )
    return Walls((*fields, *walls.others().each))

"""The body of a field that each lane has met: its numbers in rows of lanes, so that contacts with bodies vectorise.

A contact writes into the lanes. Of numbers that it looks up in a table the compiler cannot tell that they are none of
what it writes, and it vectorises nothing: 13 of the 29 ns of a pass. These rows are on the stack.
"""

from typing import Any

import numpy as np

from ..kernel.jit import by_type, copy_row, index, scratch, select
from ..kernel.record import Record
from ..surfaces.fields.members import gathered, width
from ..surfaces.fold import Field, count
from .arrays import STRIDE


class Picked(Record):
    """A field of which one body matters."""

    body: Any
    number: float

    def count(self):
        """How many walls it has."""
        return self.number

    def wall(self, number):
        """The one that matters."""
        return self.body


@by_type
def picks(chain):
    """Room for the numbers of a body in each lane, of every field of a chain."""
    return


@picks.register(Field)
def _(chain):
    return scratch((STRIDE, width(chain.first.like)), np.float64), picks(chain.rest)


@by_type
def pick(chain, before, lanes, picked, live):
    """The numbers of the body that each lane has met; of any where it has met none of this field."""


@pick.register(Field)
def _(chain, before, lanes, picked, live):
    members, (rows, others) = chain.first, picked
    last = count(members) - 1.0
    for i in range(index(live)):
        wall = lanes.wall[i] - before
        m = index(int(select(wall < 0.0, 0.0, select(wall > last, last, wall))))
        copy_row(rows, i, members.table, m, width(members.like))
    pick(chain.rest, before + count(members), lanes, others, live)


@by_type
def of_lane(chain, picked, i):
    """The walls of a scene for the contact of one lane."""
    return chain


@of_lane.register(Field)
def _(chain, picked, i):
    rows, others = picked
    body = gathered(chain.first.like, rows, i, 0)
    return Field(Picked(body, count(chain.first)), of_lane(chain.rest, others, i))

"""The walls of a scene near a point: all that are in no field, and of a field those in the cell of the point."""

import math

from ..kernel.jit import outlined
from .fold import Field, count, each, length


def count_near(chain, r):
    """How many walls are near a point."""
    if isinstance(chain, Field):
        return chain.first.count_in_cell(r) + count_near(chain.rest, r)
    return length(chain)


@outlined
def list_near(chain, k, before, r, into):
    """The numbers of the walls near a point into into[k:], of a chain that has so many walls before it."""
    if isinstance(chain, Field):
        listed = chain.first.list_in_cell(k, before, r, into)
        list_near(chain.rest, k + listed, before + count(chain.first), r, into)
    else:
        for i in range(length(chain)):
            into[k + i] = before + i


def until_others(chain, r, v):
    """When a straight flight may meet a wall that is not near its start."""
    soonest = math.inf
    for link in reversed(each(chain)):
        if isinstance(link, Field):
            soonest = min(link.first.until_next_cell(r, v), soonest)
    return soonest

"""The walls of a scene near a point: all that are in no field, and of a field those in the cell of the point."""

import math

from ..kernel.jit import by_type, by_type_outlined
from .fold import Chain, Field, count, length


@by_type
def count_near(chain, r):
    """How many walls are near a point."""
    return length(chain)


@count_near.register(Field)
def _(chain, r):
    return count_in_cell(chain.first, r) + count_near(chain.rest, r)


@by_type_outlined
def list_near(chain, k, before, r, into):
    """The numbers of the walls near a point into into[k:], of a chain that has so many walls before it."""


@list_near.register(Field)
def _(chain, k, before, r, into):
    listed = list_in_cell(chain.first, k, before, r, into)
    list_near(chain.rest, k + listed, before + count(chain.first), r, into)


@list_near.register(Chain)
def _(chain, k, before, r, into):
    for i in range(length(chain)):
        into[k + i] = before + i


@by_type
def until_others(chain, r, v):
    """When a straight flight may meet a wall that is not near its start."""
    return math.inf


@until_others.register(Field)
def _(chain, r, v):
    return min(until_next_cell(chain.first, r, v), until_others(chain.rest, r, v))


@by_type
def count_in_cell(members, r):
    """How many walls of a field are near a point."""
    raise NotImplementedError


@by_type
def list_in_cell(members, k, before, r, into):
    """Their numbers into into[k:], and how many they are."""
    raise NotImplementedError


@by_type
def one_in_cell(members, k, r):
    """The number of one of them."""
    raise NotImplementedError


@by_type_outlined
def deepest_in_cell(members, r):
    """The largest distance outside of the admissible side of any of them."""
    raise NotImplementedError


@by_type
def until_next_cell(members, r, v):
    """When a straight flight may meet another one."""
    raise NotImplementedError

"""The walls of a scene near a point: all that are in no field, and of a field those in the cell of the point."""

import math

from ..kernel.jit import outlined


def count_near(walls, r):
    """How many walls are near a point."""
    near = walls.others().length()
    for _number, field in reversed(walls.fields()):
        near = field.members.count_in_cell(r) + near
    return near


@outlined
def list_near(walls, r, into):
    """The numbers of the walls near a point into `into`."""
    k = 0
    for number, field in walls.fields():
        k += field.members.list_in_cell(k, number, r, into)
    before = walls.count_in_fields()
    for i in range(walls.others().length()):
        into[k + i] = before + i


def until_others(walls, r, v):
    """When a straight flight may meet a wall that is not near its start."""
    soonest = math.inf
    for _number, field in reversed(walls.fields()):
        soonest = min(field.members.until_next_cell(r, v), soonest)
    return soonest

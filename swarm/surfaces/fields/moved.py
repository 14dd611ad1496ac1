"""A field that moves, as one: its grid and its bodies are asked in its own frame.

In uniform translation a flight is straight, or falls as it does, in that frame too. In any other motion its place in a
cell has bounds by its speed there and a bound of its acceleration, as `relative.py` has them.
"""

import math

from ...kernel.jit import outlined
from .. import flights, fold, near
from ..posed import Drifting, Posed
from .grid import cell_of, until_next

# The bounds of a flight in its cell hold for at most so many times its length, after so many trials.
_CLOSE, _TRIALS = 2.0, 8

# --- At one instant --------------------------------------------------------------------------------------


@fold.outside_of_any.register(Posed)
def _(members, wall, r):
    return fold.outside_of_any(members.body, wall, members.own_place(r))


near.count_in_cell.register(Posed, lambda members, r: near.count_in_cell(members.body, members.own_place(r)))
near.one_in_cell.register(Posed, lambda members, k, r: near.one_in_cell(members.body, k, members.own_place(r)))


@near.list_in_cell.register(Posed)
def _(members, k, before, r, into):
    return near.list_in_cell(members.body, k, before, members.own_place(r), into)


near.deepest_in_cell.register(Posed, lambda members, r: near.deepest_in_cell(members.body, members.own_place(r)))

# --- Flight ----------------------------------------------------------------------------------------------


@flights.field_hit.register(Drifting)
def _(members, gravity, r, v):
    return flights.field_hit(members.body, gravity, *members.own_flight(r, v))


@near.until_next_cell.register(Drifting)
def _(members, r, v):
    return near.until_next_cell(members.body, *members.own_flight(r, v))


@outlined
def until_next_in_frame(grid, seen, longest):
    """A time up to the longest during which a particle, seen in the frame of a field, is surely near its cell."""
    cell, time, within = cell_of(grid, seen.r), 0.0, longest
    # The bound of the acceleration grows with the time that it holds for.
    for _k in range(_TRIALS):
        until = until_next(seen.bounds(within), grid, cell, seen.r, seen.v)
        time = max(time, min(until, within))
        if not _CLOSE * time < within:
            break
        within = math.sqrt(time * within)
    return time

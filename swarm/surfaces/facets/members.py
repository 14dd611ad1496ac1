"""The facets of a mesh as kernels take them: which is met first, and which are near."""

import math

from ...kernel.arrays import index
from ...kernel.gravity import accelerated, displacement
from ...kernel.jit import outlined
from .. import flights
from ..fields.grid import cell_of, until_next
from ..fields.members import Members, member
from .cells import here_in, passes, until_out
from .room import FULL, KIND, room_of

# So many cells and blocks of cells are crossed before a flight is said to be free so far.
_MOST = 4000


class Facets(Members):
    """The facets of a mesh: walls on one side, each between its edges; their grid is `Cells`."""

    def field_hit(self, gravity, r, v):
        return _first_hit(self, gravity, r, v)


@outlined
def _first_hit(facets, gravity, r, v):
    """The first hit, from cell to cell, or how far the flight is surely free."""
    cells, t = facets.grid, 0.0
    place, pace = r, v
    for _cell in range(_MOST):
        cell = cell_of(cells, place)
        if cell.inside:
            number = index(cell.number)
            until = t + until_out(gravity, cells, cell.place, room_of(cells.room, number), place, pace)
            if cells.room[number, KIND] == FULL:
                here = here_in(gravity, cells, cell.place, place, pace, until - t)
                found = hit_in(facets, gravity, (r, v), (number, t), here)
                if found.wall >= 0.0:
                    return found
        else:
            until = t + until_next(gravity, cells, cell, place, pace)
        if not until < math.inf:
            return flights.NEVER
        t, place, pace = until, r + displacement(gravity, v, until), accelerated(gravity, v, until)
    return flights.Hit(t, -1.0)


def hit_in(facets, gravity, flight, cell, here):
    """The first hit in a cell with this number of a flight (r, v), which leaves it `here.span` after `cell[1]`."""
    (r, v), (number, begin) = flight, cell
    found, cells = flights.Hit(begin + here.span, -1.0), facets.grid
    for k in range(cells.first[number], cells.first[number + index(1)]):
        if passes(cells, index(k), here):
            m = cells.entries[k]
            time, _hits = flights.hit(gravity, member(facets, index(m)), r, v)
            if time < found.time:
                found = flights.Hit(time, float(m))
    return found

"""The facets of a mesh as kernels take them: which is met first, and which are near."""

import math

import numpy as np

from ...kernel.arrays import index
from ...kernel.gravity import accelerated, as_vector, displacement
from ...kernel.jit import kernel, outlined, select
from ...kernel.vector import Vec, column, dot, put, square
from .. import flights
from ..fields.grid import cell_of, until_next
from ..fields.members import Members, member
from .cells import until_out

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
            leap = cells.leap[index(cell.number)]
            until = t + until_out(gravity, cells, cell.place, abs(float(leap)), place, pace)
            if leap == 0:
                found = _hit_in(facets, gravity, r, v, index(cell.number), until)
                if found.wall >= 0.0:
                    return found
        else:
            until = t + until_next(gravity, cells, cell, place, pace)
        if not until < math.inf:
            return flights.NEVER
        t, place, pace = until, r + displacement(gravity, v, until), accelerated(gravity, v, until)
    return flights.Hit(t, -1.0)


def _hit_in(facets, gravity, r, v, number, until):
    """The first hit with a facet in a cell, which the flight leaves then."""
    found, cells = flights.Hit(until, -1.0), facets.grid
    for k in range(cells.first[number], cells.first[number + index(1)]):
        m = index(cells.entries[k])
        if _may_hit(facets, gravity, r, v, m, until):
            time, _hits = flights.hit(gravity, member(facets, m), r, v)
            if time < found.time:
                found = flights.Hit(time, float(m))
    return found


def _may_hit(facets, gravity, r, v, m, until):
    """Whether a flight comes through the plane of a facet until then: most do not, and the edges are not looked up."""
    table = facets.table
    normal = Vec(table[m, 0], table[m, 1], table[m, 2])
    depth, rate = dot(normal, r) - table[m, 3], dot(normal, v)
    if gravity is None:
        return (rate > 0.0) & (depth <= facets.like.room.value) & (depth + rate * until >= 0.0)
    bend = 0.5 * dot(normal, as_vector(gravity))
    rises = select(bend < 0.0, rate > 0.0, depth + (rate + bend * until) * until >= 0.0)
    return (depth <= facets.like.room.value) & rises

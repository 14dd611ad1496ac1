"""Which points are in a body of a field: asked of the bodies in a point's cell only."""

from ...kernel.arrays import index
from ...kernel.jit import kernel
from ...kernel.vector import column
from .grid import cell_of
from .members import member


@kernel
def within(members, points, found):
    """Whether each of the points (3, N) is in any body, into `found`; on its surface it is not."""
    grid = members.grid
    for i in range(points.shape[1]):
        r = column(points, 0, i)
        cell, inside = index(cell_of(grid, r).number), False
        for k in range(grid.first[cell], grid.first[cell + index(1)]):
            inside = inside or member(members, index(grid.entries[k])).phi(r) < 0.0
        found[i] = inside

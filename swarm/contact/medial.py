"""Steps that lead through the middle of a solid, or of the wall between two parts of a cavity, to the other side.

In the middle the nearest side changes, and a soft wall pushes a point on, out of the side opposite to its entry.
Along a straight path through the wall the depth first grows and later falls, without work of the wall.
"""

from ..kernel.jit import select
from ..kernel.vector import dot
from .laws import of_wall

# The cosine of normals that are opposite, up to the bend between them: two sides of one wall. In the edge
# of a solid, however sharp it usually is, a point turns from one side to another by less.
_OPPOSITE = -0.9
# As a fraction of the way to the middle of a solid: a round solid has its middle at one point, which few paths meet.
_DEEP = 0.5


def passes(before, after, wall, way, turned, half_widths):
    """Whether a step leads through the middle of this wall.

    `before` and `after` are the walls and the place at both ends of the step, `way` is its displacement relative to the
    wall [m], `turned` the change of velocity in the step times its length [m], `half_widths` are those of solids.
    """
    (walls0, r0), (walls1, r1) = before, after
    n0, n1 = walls0.unit_normal(wall, r0), walls1.unit_normal(wall, r1)
    d0, d1 = walls0.distance(wall, r0), walls1.distance(wall, r1)
    deeper, back = dot(way, n0), -dot(way, n1)
    bent = deeper + back
    # The place where the tangents of the depth meet
    depth = d0 + deeper * (d1 - d0 + back) / select(bent > 0.0, bent, 1.0)
    # A wall that turns the point by itself changes its way more than its own shape does.
    by_shape = (deeper >= 0.0) & (back >= 0.0) & (bent > 0.5 * dot(turned, n0 + n1)) & (depth > 0.0)
    return by_shape & ((dot(n0, n1) < _OPPOSITE) | (depth > _DEEP * of_wall(half_widths, wall)))

"""Ways in which walls are absent at places on them: beyond a patch, in another room of a union, in an opening.

Each is an `Absence`, and kernels test all of them by `is_absent`. The depth of a place in the volume of an absence
is given in units of `near`, a distance that is round-off.
"""

from ...kernel.record import Record
from ...kernel.vector import cross, dot, square

# Depths: sliding particles fly from the first on at the start of a step; a step is cut at the second, and must be at
# the third. A step that is cut ends between the first two, to round-off. An opening begins at the last, outside it.
FLIES, CUT, BEYOND, OPEN = 1.0, 2.0, 4.0, -1.0
# The sine of the angle between walls that lie on each other.
_PARALLEL = 1e-7


class Absence(Record):
    """A way in which some walls are absent."""

    def is_of(self, wall):
        """Whether the wall with this number may be absent in this way."""
        raise NotImplementedError

    def takes(self, walls, wall, r, near, depth):
        """Whether a wall is absent at a place on it, deeper than `depth` times `near`."""
        raise NotImplementedError

    def wall_after(self, walls, wall, r, near):
        """Return the wall to which particles that slide on this one pass where it is absent; -1: they fly."""
        return -1.0


def is_absent(ways, walls, wall, r, near, depth):
    """Whether a wall is absent at a place on it in any of the `ways`, deeper than `depth` times `near`."""
    found = False
    for way in ways:
        found = way.takes(walls, wall, r, near, depth) | found
    return found


def face_alike(walls, wall, other, r):
    """Whether the normals of two walls are the same at a place."""
    n, m = walls.unit_normal(wall, r), walls.unit_normal(other, r)
    return dot(n, m) > 0.0 and square(cross(n, m)) <= _PARALLEL * _PARALLEL


def lie_on_each_other(walls, wall, other, r):
    """Whether two walls of unions coincide at a place on the first one, and face the same way."""
    return (
        face_alike(walls, wall, other, r)
        and abs(walls.distance(other, r) - walls.distance(wall, r)) <= BEYOND * walls.slack
    )


def are_one(walls, wall, other, r):
    """Whether two walls are one for a particle at a place: the same, or of two rooms and coincident there."""
    if wall == other:
        return True
    return len(walls.unions) > 0 and other >= 0.0 and lie_on_each_other(walls, wall, other, r)

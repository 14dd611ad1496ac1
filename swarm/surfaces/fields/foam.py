"""Many cavities as one vessel: a foam, or pores. A particle is in any of them, and its flight leaves the last one."""

import math

from ...kernel.arrays import index
from ...kernel.gravity import displacement
from ...kernel.grid import cell_of, entries_at, until_next
from ...kernel.jit import outlined
from ...kernel.limits import ON_FOAM
from ...kernel.vector import Vec, absolute, total
from ..presence.patched import Patched
from ..time_of_impact import flights
from .members import Members, SignedDistance, member, nearest_body

# A flight that continues in another cavity is inside it by this multiple of round-off.
_INSIDE = 4.0
# The most parts of a flight that are followed before it is reported as free up to there.
_MOST_PARTS = 1000


class Foam(Members, Patched):
    """Cavities; a place in any of them is admissible; the wall of each is present where it is in no other."""

    @outlined
    def field_hit(self, gravity, r, v):
        """Return when a flight leaves the last of the cavities that hold it, or its cell, or enters another cavity."""
        first, stop = entries_at(self.grid, r)
        nearest, slack = _nearest(self, r), ON_FOAM * total(absolute(r))
        last, wall = -1.0, -1.0
        for k in range(first, stop):
            m = self.grid.entries[k]
            cavity = member(self, index(m))
            if cavity.distance(r) <= slack or float(m) == nearest[0]:
                time, _found = flights.hit(gravity, cavity, r, v)
                if time > last:
                    last, wall = time, float(m)
        until = until_next(gravity, self.grid, cell_of(self.grid, r), r, v)
        if wall < 0.0 or last >= until:
            return flights.Hit(until, -1.0)
        if _is_in_other(self, wall, r + displacement(gravity, v, last), _INSIDE * slack):
            return flights.Hit(last, -1.0)
        return flights.Hit(last, wall)

    def other_hit(self, number, r, v, until):
        # A chord of a cavity is inside the cavity.
        return flights.NEVER if number >= 0.0 else _end(self, r, v, until)

    def is_in_another(self, number, r):
        return _nearest(self, r)[1] > 0.0

    def deepest_in_cell(self, r):
        """Return the distance outside the nearest cavity."""
        return _nearest(self, r)[1]

    @outlined
    def foot(self, tree, r):
        """Return the `SignedDistance` outside the nearest cavity, which may be one of another cell."""
        gap, which = nearest_body(self, r)
        if not gap < math.inf:
            return SignedDistance(-math.inf, Vec(1.0, 0.0, 0.0))
        return SignedDistance(gap, member(self, index(which - 1)).gradient(r))

    # The wall near a point is that of the cavity in which the point is deepest.

    def count_in_cell(self, r):
        return 1 - int(self.is_gone())

    def list_in_cell(self, k, before, r, into):
        count = self.count_in_cell(r)
        for i in range(count):
            into[k + i] = before + _nearest(self, r)[0]
        return count

    def one_in_cell(self, k, r):
        return _nearest(self, r)[0]

    def is_there(self, number, r, near):
        return not _is_in_other(self, number, r, near)


@outlined
def _nearest(foam, r):
    """Return the cavity of the cell in which a point is deepest, or that is nearest, and the distance outside it."""
    if foam.is_gone():
        return 0.0, -math.inf
    first, stop = entries_at(foam.grid, r)
    which, least = 0.0, math.inf
    for k in range(first, stop):
        m = foam.grid.entries[k]
        distance = member(foam, index(m)).distance(r)
        if distance < least:
            which, least = float(m), distance
    return which, least


@outlined
def _is_in_other(foam, number, r, near):
    """Whether a point is inside a cavity other than `number`, by more than `near`."""
    first, stop = entries_at(foam.grid, r)
    for k in range(first, stop):
        m = foam.grid.entries[k]
        if float(m) != number and member(foam, index(m)).distance(r) < -near:
            return True
    return False


@outlined
def _end(foam, r, v, until):
    """Return the `Hit` where a straight flight leaves the foam; the wall is -1 if it is free until `until`."""
    t = 0.0
    for _part in range(_MOST_PARTS):
        hit = foam.field_hit(None, r + t * v, v)
        t += hit.time
        if hit.wall >= 0.0 or not t < until:
            return flights.Hit(t, hit.wall)
    return flights.Hit(t, -1.0)

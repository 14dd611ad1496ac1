"""Contact points that pass openings: those that have are outside of the walls, meet none of them, and may come back."""

from typing import Any

from ...contact.absence import lets_through
from ...kernel.jit import outlined
from ...kernel.record import Record

# Where a contact point is: it has passed an opening, and that of a wall that ends and is not back through one.
OUT, BEHIND = 1, 2


class Passages(Record):
    """The openings of the walls, and the contact points outside of these."""

    openings: Any  # each `Opened` of the walls
    free: Any  # (K, n) int8, whether a contact point has passed one: 0, or OUT or BEHIND
    escape_time: Any  # (n,) when all those of a body had [s], NaN of bodies that are inside

    def takes(self, walls, wall, c, near):
        """Whether a wall is open at a place on it."""
        return lets_through(self.openings, walls, wall, c, near)


@outlined
def look_back(contacts, i):
    """At the end of a step: points that have come back meet the walls, and a body with all points out ends."""
    touching, pace, passages = contacts.touching, contacts.pace, contacts.passages
    number, out = pace.body[i], 0
    for k in range(touching.points):
        if contacts.is_free(k, i) and contacts.is_back(k, i):
            passages.free[k, number] = 0
        out += contacts.is_free(k, i)
    if out == touching.points and out > 0:
        passages.escape_time[number] = contacts.rule.end - pace.remaining[i]
        pace.remaining[i] = 0.0

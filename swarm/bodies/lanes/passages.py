"""Contact points that pass openings: outside of the walls they meet no wall, and they may come back."""

from typing import Any

from ...contact.absence import lets_through
from ...kernel.jit import outlined
from ...kernel.record import Record

# The states of a contact point that has passed an opening. BEHIND: the wall has edges, and the point has not come back.
OUT, BEHIND = 1, 2


class Passages(Record):
    """The openings of the walls, and the contact points outside of the walls."""

    openings: Any  # each `Opened` of the walls
    free: Any  # (K, n) int8, whether a contact point has passed an opening: 0, OUT or BEHIND
    escape_time: Any  # (n,) when all contact points of a body had passed [s], NaN of bodies inside

    def takes(self, walls, wall, c, near):
        """Whether a wall is open at a place on it."""
        return lets_through(self.openings, walls, wall, c, near)


@outlined
def look_back(contacts, i):
    """At the end of a step, let points that are back meet walls again, and end bodies with all points outside."""
    touching, pace, passages = contacts.touching, contacts.pace, contacts.passages
    number, out = pace.body[i], 0
    for k in range(touching.points):
        if contacts.is_free(k, i) and contacts.is_back(k, i):
            passages.free[k, number] = 0
        out += contacts.is_free(k, i)
    if out == touching.points and out > 0:
        passages.escape_time[number] = contacts.rule.end - pace.remaining[i]
        pace.remaining[i] = 0.0

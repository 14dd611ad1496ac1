"""The watchers of the particles of one thread: engines report impacts and flights to each of them.

An engine calls `hit` for each impact and `flown` for each flight. Lanes call the forms of the log, the counts and the
counters for all lanes of a pass at once. A run without watchers compiles none of this code.
"""

from typing import Any, NamedTuple


class Followed(NamedTuple):
    """The arrays that counters write to: the arrays of the particles, and the log, or None."""

    state: Any
    log: Any


class Watchers(NamedTuple):
    """The watchers of a run; each is None if the run has none of its kind."""

    log: Any = None  # `log.Log` of impacts
    counts: Any = None  # `counts.Counts` of impacts
    counters: Any = None  # `counters.Counters`

    def of_impacts(self):
        """The watchers of impacts."""
        return tuple(one for one in (self.log, self.counts) if one is not None)

    def with_slip(self, laws, now, struck, touch=None):
        """Return a `log.Struck` with its slip, if slips are logged; `now` are the walls at that time."""
        return struck if self.log is None else self.log.with_slip(laws, now, struck, touch)

    def hit(self, image, struck):
        """Report an impact, a `log.Struck`; `image` has the cells of the particles of a periodic scene."""
        for one in self.of_impacts():
            one.hit(image, struck)

    def flown(self, gravity, state, particle, flight):
        """Report a flight within one cell, a `crossings.Flown`."""
        if self.counters is not None:
            self.counters.look_at(gravity, Followed(state, self.log), particle, flight)

"""The turns of particles from kernel to kernel of a frame, and the end of turns in which no time passes."""

import numpy as np
from numpy.typing import NDArray

from ..common.status import Status
from ..contact.events import ARRIVED, FLYING
from ..lanes.lane_arrays import Halted
from ..lanes.share import Draws
from ..state import Contacts
from .watch import Watch

# The most turns of a particle from kernel to kernel in which no time passes. A wedge, a cusp and a chatter stay in the
# kernel of flights; ordinary contacts take two or three such turns.
MOST = 1000
# The turn of the first look at particles for which no time passes: few frames have this number of turns.
_FIRST = 10
# (status, particle, the particles that a halt left in the lanes)
End = tuple[int, int, Halted | None]


class Turns:
    """The turns of the kernels of a thread for the particles that it has drawn."""

    def __init__(self, phase: NDArray[np.int8], contacts: Contacts | None, draws: Draws, drawn: int) -> None:
        self._phase, self._contacts, self._draws, self._drawn = phase, contacts, draws, drawn
        self._count = 0
        self._particles, self._left = np.empty(0, np.int64), np.empty(0)

    def end(self, watch: Watch) -> End | None:
        """Return the end of the turns, by a halt or a particle for which no time passes; None if they go on.

        A turn counts as a pass for a halt, as many turns may have few passes each.
        """
        if watch.is_over(self._count):
            return int(Status.INTERRUPTED), 0, None
        self._count += 1
        if self._count % MOST == _FIRST and (still := self._still()).size:
            return int(Status.TIMELESS), int(still.min()), None
        return None

    def _still(self) -> NDArray[np.int64]:
        """Return the particles for which no time has passed since the last call, in `MOST` turns.

        In each turn every particle that has not arrived goes from one kernel to another, so no kernel can count the
        turns of a particle.
        """
        assert self._contacts is not None
        size, drawn = self._draws.size, self._draws.mine[: self._drawn]
        mine: NDArray[np.int64] = np.add.outer(drawn * size, np.arange(size)).ravel()
        mine = mine[mine < len(self._phase)]
        mine = mine[(self._phase[mine] != FLYING) & (self._phase[mine] != ARRIVED)]
        remaining = self._contacts.remaining[mine]
        _both, now, then = np.intersect1d(mine, self._particles, return_indices=True)
        still: NDArray[np.int64] = mine[now[remaining[now] == self._left[then]]]
        self._particles, self._left = mine, remaining
        return still


def left_behind(before: Halted, phase: NDArray[np.int8], now: list[Halted]) -> Halted:
    """Return the particles that halts left in lanes: those of `now`, and those of `before` that no lane has taken."""
    picked_up = np.concatenate([np.flatnonzero(phase != FLYING), *(remaining.particle for remaining in now)])
    waiting = ~np.isin(before.particle, picked_up)
    parts = [Halted(before.particle[waiting], before.rows[:, waiting]), *now]
    particle = np.concatenate([part.particle for part in parts])
    order = np.argsort(particle)
    rows = np.concatenate([part.rows for part in parts], axis=1)[:, order]
    return Halted(particle[order], np.ascontiguousarray(rows))

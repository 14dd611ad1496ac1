"""The turns that particles take from kernel to kernel of a frame, and those in which no time passes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.events import ARRIVED, FLYING
from ..lanes.arrays import Draws

# So often a particle may go from one kernel to another without time passing. A wedge, a cusp and a chatter stay in the
# kernel of flights; ordinary contacts take two or three such turns.
MOST = 1000


class Turns:
    """How often the kernels of a thread have been called in turn for the particles that it has drawn."""

    def __init__(self, phase: NDArray[np.int8], left: NDArray[np.float64], draws: Draws, drawn: int) -> None:
        self._phase, self._left, self._draws, self._drawn = phase, left, draws, drawn
        self.count = 0
        self._particles, self._before = np.empty(0, np.int64), np.empty(0)

    def stuck(self) -> int | None:
        """Count a turn; a particle for which no time has passed in `MOST` of them or more, if there is one.

        In each turn every particle that has not arrived goes from one kernel to another. Looked at after every MOST
        turns: nothing in a kernel, and no number of a particle, counts them.
        """
        self.count += 1
        if self.count % MOST:
            return None
        size = self._draws.size
        mine = (self._draws.mine[: self._drawn, None] * size + np.arange(size)).ravel()
        mine = mine[mine < len(self._phase)]
        mine = mine[(self._phase[mine] != FLYING) & (self._phase[mine] != ARRIVED)]
        left: NDArray[Any] = self._left[mine]
        _both, now, then = np.intersect1d(mine, self._particles, return_indices=True)
        still = now[left[now] == self._before[then]]
        self._particles, self._before = mine, left
        return int(mine[still].min()) if len(still) else None

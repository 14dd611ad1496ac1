"""When the kernels of a frame return: after how many passes, and how many the caller's thread may compute."""

import math
import time

import numpy as np

from ..lanes.block import NEVER
from ..lanes.table import LANES

# Flights of the caller's thread in its first frame, compiled and in plain Python, after which it is free again: 0.1 s
# or so of dear ones. Then their number is doubled as long as they take less than the second time [s], and halved where
# they take more than the first: whatever a flight costs, a short frame never meets them.
_FLIGHTS, _PLAIN_FLIGHTS, _LONG, _SHORT = 1 << 16, 1 << 10, 0.05, 0.025


class Watch:
    """The halt of the kernels of a frame.

    Python hands a signal to the main thread alone, between two of its instructions. So a thread that may be this one
    computes for a few passes only, in which no other thread halts it. Then it leaves the frame to others and watches
    them.
    (Rejected: a thread that halts it in time. It would learn of a signal only by a descriptor, which asyncio uses.)

    Attributes:
        passes: (1,) what kernels ask: after so many passes they return.
    """

    def __init__(self, particles: int) -> None:
        lanes = min(LANES, particles)
        self.passes = np.full(1, NEVER)
        self._asked, self._latest, self._plain = NEVER, math.inf, False
        self._alone = {False: _FLIGHTS // lanes, True: _PLAIN_FLIGHTS // lanes}

    def halt(self, passes: int = 0) -> None:
        """Make every kernel call of this frame return after so many passes.

        Of two halts the sooner one counts, also if a signal or another thread sets the second at the same time: NumPy
        compares and writes without releasing the interpreter's lock.
        """
        self._asked = min(self._asked, passes)
        np.minimum(self.passes, passes, out=self.passes)

    def begin(self, latest: float, helps: bool, plain: bool) -> None:
        """Kernels begin, halted at the time `latest` [s of time.monotonic].

        `helps`: the caller's thread computes; `plain`: in plain Python.
        """
        self._latest, self._plain = latest, plain
        self._reset()
        if helps:
            np.minimum(self.passes, self._alone[plain], out=self.passes)

    def is_over(self, turns: int) -> bool:
        """Whether a thread that has called kernels so often ends: many calls of a few passes each are passes too."""
        if time.monotonic() >= self._latest:
            self.halt()
        return bool(turns >= self.passes[0])

    def is_freed(self, seconds: float) -> bool:
        """Whether kernels have returned after so many seconds only since the caller's thread is to be free."""
        alone = self._alone[self._plain]
        if self._asked <= alone:
            return False
        if seconds < _SHORT:
            self._alone[self._plain] = 2 * alone
        elif seconds > _LONG:
            self._alone[self._plain] = max(1, alone // 2)
        return True

    def end(self) -> None:
        """The frame is done, or cut short."""
        self._asked = NEVER
        self._reset()

    def _reset(self) -> None:
        """Halted as was asked, also by a signal that comes just now."""
        self.passes[0] = NEVER
        np.minimum(self.passes, self._asked, out=self.passes)

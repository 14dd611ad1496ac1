"""The halt of the kernels of a frame after a number of passes, and the share of the caller's thread."""

import math
import threading
import time

import numpy as np

from ..lanes.block import NEVER
from ..lanes.table import LANES

# The flights of the caller's thread in its first frame, compiled and in plain Python, after which it is free: 0.1 s of
# expensive flights. Then their number is doubled if they take less than `_SHORT`, and halved if they take more than
# `_LONG` [s]: so a short frame ends before its thread has done this number, whatever a flight costs.
_FLIGHTS, _PLAIN_FLIGHTS, _LONG, _SHORT = 1 << 16, 1 << 10, 0.05, 0.025
# A guard looks every `_GLANCE` whether the caller's thread has computed for longer than `_FREED` [s]. It begins when
# the run is `_YOUNG` old [s], as its start takes a tenth of the shortest runs, and ends after `_IDLE` looks at an idle
# thread.
_GLANCE, _FREED, _YOUNG, _IDLE = 0.1, 0.25, 0.1, 10


class Watch:
    """The halt of the kernels of a frame.

    Python handles a signal only in the main thread, between two of its instructions. So the caller's thread, which may
    be the main thread, computes only a few passes, leaves the frame to other threads, and waits for them. If these
    passes take longer than in the frames before, for instance where particles come to rest on moving walls, a guard
    frees the caller's thread: the guard is a thread that looks at the clock.
    (Rejected: a thread that receives signals. It needs the wakeup descriptor, which asyncio uses.)

    Attributes:
        passes: (1,) the number of passes after which kernels return.
    """

    def __init__(self, particles: int) -> None:
        lanes = min(LANES, particles)
        self.passes = np.array([NEVER])
        self._asked, self._latest, self._plain = NEVER, math.inf, False
        self._alone = {False: _FLIGHTS // lanes, True: _PLAIN_FLIGHTS // lanes}
        # The time at which the caller's thread began to compute, infinite if it does not, and its first such time [s].
        self._since, self._born = math.inf, math.inf
        self._guard: threading.Thread | None = None

    def halt(self, passes: int = 0) -> None:
        """Make every kernel call of this frame return after a number of passes.

        Of two halts the sooner one counts, also if a signal or another thread sets one at the same time, as NumPy
        compares and writes without releasing the interpreter's lock.
        """
        self._asked = min(self._asked, passes)
        np.minimum(self.passes, passes, out=self.passes)

    def begin(self, latest: float, helps: bool, plain: bool) -> None:
        """Set the halt before kernels begin.

        Args:
            latest: the time at which kernels are halted [s of time.monotonic].
            helps: whether the caller's thread computes too.
            plain: whether kernels run in plain Python.
        """
        self._latest, self._plain = latest, plain
        self._reset()
        if helps:
            np.minimum(self.passes, self._alone[plain], out=self.passes)
            self._since = time.perf_counter()
            self._born = min(self._born, self._since)
            if self._guard is None and self._since - self._born > _YOUNG:
                self._guard = threading.Thread(target=self._free_in_time, name="swarm guard", daemon=True)
                self._guard.start()

    def is_over(self, turns: int) -> bool:
        """Whether a thread ends after a number of calls of kernels, which count as passes."""
        if time.monotonic() >= self._latest:
            self.halt()
        return bool(turns >= self.passes[0])

    def is_freed(self, seconds: float) -> bool:
        """Whether kernels returned, after some seconds, only to free the caller's thread."""
        alone = self._alone[self._plain]
        if self._asked <= alone:
            return False
        if seconds < _SHORT:
            self._alone[self._plain] = 2 * alone
        elif seconds > _LONG:
            self._alone[self._plain] = max(1, alone // 2)
        return True

    def _free_in_time(self) -> None:
        """Free the caller's thread if it computes for too long, or beyond the time at which kernels are halted."""
        idle = 0
        while idle < _IDLE:
            time.sleep(_GLANCE)
            since = self._since
            idle = idle + 1 if since == math.inf else 0
            is_late = time.perf_counter() - since > _FREED or (since < math.inf and time.monotonic() >= self._latest)
            # A halt by `halt` is left as it is.
            if is_late and self._asked == NEVER:
                np.minimum(self.passes, 0, out=self.passes)
        self._guard = None

    def end(self) -> None:
        """Reset the halt after a frame, which is done or cut short."""
        self._asked = NEVER
        self._reset()

    def _reset(self) -> None:
        """Set the halt of `halt`, also if a signal calls it at this moment."""
        self._since = math.inf
        self.passes[0] = NEVER
        np.minimum(self.passes, self._asked, out=self.passes)

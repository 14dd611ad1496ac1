"""The common part of the three engines of a run: of particles, of bodies, of walls that react."""

import math
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..methods.base import Method
from ..scene import Scene
from ..state import State
from . import failures
from .tiers import Tier
from .watch import Watch

# A particle this many times the scene's extent away from the origin has escaped from an open scene.
_FAR = 100.0
# Beyond this part of the scene's size a particle outside rigid walls is an error; round-off is 1e-15 of it.
_OUTSIDE = 1e-9
# The caller's thread looks for an interrupt so often [s].
_GLANCE = 0.1
Arrays = dict[str, NDArray[Any]]
T = TypeVar("T")


class BaseRun:
    """A run from frame to frame: its state, and the threads that advance and observe it, which end with this context.

    Args:
        scene, method: what is run.
        n: how many particles, or bodies.
        pool: the threads.
        tier: of the kernels.
        first: the number of the first particle, or body, in the whole run.

    Attributes:
        state: what files take of a frame.
    """

    state: State

    def __init__(
        self, scene: Scene, method: Method, n: int, pool: ThreadPoolExecutor, tier: Tier, first: int = 0
    ) -> None:
        self._scene, self._method, self._first = scene, method, first
        self._owners, self._parts = scene.owners(), scene.parts_of_rows()
        self._deepest = _OUTSIDE * scene.finite_size() if method.is_rigid() else math.inf
        # In a scene without walls no particle escapes: it has only balls in free space.
        self._far = _FAR * scene.extent() if scene.surfaces and scene.is_open() else math.inf
        self._pool, self._tier, self._watch = pool, tier, Watch(n)
        self._cut_short = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.halt()
        self._pool.shutdown(wait=True)

    def halt(self, passes: int = 0) -> None:
        """Make every kernel call of this frame return after so many passes, or events; 0: at once.

        It ends when `advance` returns.
        """
        self._watch.halt(passes)

    # --- What each engine does ---------------------------------------------------------------------------

    def advance(self, span: float, moment: float, writing: float = 0.0, latest: float = math.inf) -> bool:
        """Advance all by `span`, in the method's unit, to a moment [s], and observe them: whether the frame is done.

        It is not if `halt` was called, at the time `latest` [s of time.monotonic], or when the time for plain Python
        is used up. The next call then continues the frame, with the same bits as without the halt. `writing` is the
        time to write a frame [s].

        Raises:
            RunError: a step failed.
        """
        raise NotImplementedError

    def observe(self) -> None:
        """Observe the start."""
        raise NotImplementedError

    def calls(self) -> Iterable[tuple[Any, tuple[Any, ...]]]:
        """Every kernel of a frame, with arguments of the types that it is called with from now on."""
        raise NotImplementedError

    def share_done(self, span: float) -> float:
        """The share of a frame that was cut short that is done, on average over the particles, or bodies."""
        raise NotImplementedError

    def seen(self) -> dict[str, Any]:
        """The observables of the last frame."""
        raise NotImplementedError

    def chunk_sums(self) -> NDArray[np.float64]:
        """The sums over each chunk of the last frame, from which those of shards are joined."""
        raise NotImplementedError

    def arrays(self) -> Arrays:
        """The arrays that `restore` needs for the same bits, not copied; to be called between calls of `advance`."""
        raise NotImplementedError

    # --- What they share ---------------------------------------------------------------------------------

    def restore(self, arrays: Arrays, cut_short: bool) -> None:
        """Take the state of the run that gave these `arrays`: at a frame, or within one if it was `cut_short`."""
        for name, array in self.arrays().items():
            np.copyto(array, arrays[name], casting="no")
        self._cut_short = cut_short

    def require_admissible(self, seen: dict[str, Any], moment: float) -> None:
        """Raise a RunError that names the first particle whose state is not finite, or that is outside rigid walls."""
        failures.require_admissible(self._scene, self._seen_state(), seen, self._deepest, moment, self._first)

    def _seen_state(self) -> State:
        """The state as observers of the last frame know it."""
        return self.state

    def _called(self, kernel: Any, calls: Iterable[tuple[Any, ...]], latest: float) -> list[Any]:
        """The results of a kernel of this tier for each of these arguments, in a thread each, halted at `latest`."""
        chosen = self._tier.kernel(kernel)
        shares = [self._pool.submit(chosen, *arguments) for arguments in calls]
        return [result_of(share, latest, self.halt) for share in shares]

    def _choose_tier(self) -> None:
        """Take the tier of the next calls."""
        self._tier.choose(self.calls())

    def _limit(self, latest: float) -> float:
        """When kernels return at the latest [s of time.monotonic]: plain Python has little time, and may have none."""
        if self._tier.is_plain and self._tier.remaining <= 0.0:
            self._choose_tier()
        return min(latest, time.monotonic() + self._tier.remaining) if self._tier.is_plain else latest


def result_of(share: "Future[T]", latest: float, halt: Callable[[], None]) -> T:
    """The result of a thread, which is halted at `latest` [s of time.monotonic].

    In many short waits: Python takes up a signal between two of them, and one that comes just before a long wait (or to
    another thread) would be seen at its end only.
    """
    while True:
        try:
            return share.result(min(_GLANCE, max(0.0, latest - time.monotonic())))
        except TimeoutError:
            if time.monotonic() >= latest:
                halt()
                latest = math.inf

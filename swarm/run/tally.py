"""The number of impacts of each member of each surface, counted by each thread by itself."""

import threading
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..lanes.log import Counts
from ..scene import Scene
from ..surfaces.counter import Counter
from .impacts import Impacts


class Tally:
    """The counts of the threads of a run, and of the sessions before; sums of whole numbers, so exact in any order."""

    def __init__(self, scene: Scene) -> None:
        self._surface, self._member = scene.members()
        self._counts: dict[int, Counts] = {}

    def counts(self) -> Counts:
        """The counts of the thread that calls."""
        return self._counts.setdefault(threading.get_ident(), Counts(np.zeros(len(self._surface), np.int64)))

    def total(self) -> NDArray[np.int64]:
        """Of each wall of the scene, all threads."""
        of_threads = [counts.impacts for counts in list(self._counts.values())]
        return np.asarray(np.sum([0 * self._surface, *of_threads], axis=0))

    def restore(self, total: NDArray[np.int64]) -> None:
        """Go on from the `total` of a checkpoint."""
        self._counts = {threading.get_ident(): Counts(total.copy())}

    def of_members(self) -> list[NDArray[np.int64]]:
        """Of each surface its members' impacts; those of all its walls and images together where it is one body."""
        total = self.total()
        # A float holds these sums exactly up to 2^53, as `bincount` gives them.
        of_surfaces = [self._surface == s for s in range(int(self._surface.max()) + 1)]
        numbers = [(np.maximum(self._member[mine], 0), total[mine]) for mine in of_surfaces]
        return [np.bincount(member, counted).astype(np.int64) for member, counted in numbers]


class Watched(NamedTuple):
    """The records of impacts: their log and their tally, None where there is none; and the counters."""

    log: Impacts | None = None
    tally: Tally | None = None
    counters: tuple[Counter, ...] = ()

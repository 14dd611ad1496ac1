"""Two tiers of kernels with the same bits: plain Python, which starts at once, and compiled kernels.

Plain Python takes 30 to 150 us an impact, the compiler 1 to 9 s for a new kind of scene. From the start of Python to
its end, 20 particles with 6 impacts each in a sphere take 0.5 s of processor time in plain Python, and 2.7 s if their
kernels are compiled. With kernels from the cache they take 1.3 s, most of it to import the compiler. So a run of very
few particles begins in plain Python, without a search for compiled kernels. (Rejected: to go on in plain Python while
another process compiles. Four drums that begin together all take twice as long, 44 s and 23 s of processor time, not
22 s and 12 s.)
"""

import functools
import math
import threading
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..kernel import cache, deferred

CHOICES = ("auto", "always", "never")
# The time of plain Python, of all runs of a process with the same missing kernels, after which these are compiled [s].
_PATIENCE = 1.0
# The most particles of a run in plain Python: in that time more particles have only a few impacts each.
_FEW = 2000
# The time of plain Python in a process before it imports the compiler, to search for kernels [s]: as long as the import
# takes. It is booked under `_ANY`, as missing kernels are not known yet. Runs of more than `_VERY_FEW` particles seldom
# end in this time.
_BEFORE_COMPILER, _ANY = 0.4, "any kernel"
_VERY_FEW = 200
# The time of plain Python so far in this process by kind of missing kernel [s].
_spent: dict[str, float] = {}
_lock = threading.Lock()


class Tier:
    """The tier of a run.

    Args:
        choice: "auto": compiled if compiled kernels are found, else plain Python until the runs of this process have
            spent about a second there; "always" or "never" compiled.
        numbers: the arguments of the kernels. If they call library functions, the last bit may differ between the
            tiers, and "auto" compiles at once, as the result must not depend on the wall time.
        particles: the number of particles.
    """

    def __init__(self, choice: str, numbers: Any, particles: int) -> None:
        self._particles = particles
        # The time left for plain Python [s].
        self.remaining = math.inf if choice == "never" else 0.0
        if choice == "auto" and particles <= _FEW and _same_bits(numbers):
            self.remaining = _PATIENCE
        self.is_plain = self.remaining > 0.0
        self._missing: list[str] = []
        # The time left for plain Python after the compiler is imported [s].
        self._later = 0.0

    def choose(self, calls: Iterable[tuple[Any, tuple[Any, ...]]]) -> None:
        """Choose the tier for the next calls, given as kernels and their arguments."""
        if self.remaining == math.inf:
            return
        self._missing = []
        waits = self._particles <= _VERY_FEW and not deferred.is_loaded()
        before = _BEFORE_COMPILER - spent([_ANY]) if waits else 0.0
        if min(before, self.remaining) > 0.0:
            self._later, self.remaining = self.remaining - before, before
            self._missing, self.is_plain = [_ANY], True
            return
        self.remaining, self._later = self.remaining + self._later, 0.0
        if self.remaining > 0.0:
            self._missing = [cache.kind(*call) for call in calls if not cache.is_compiled(*call)]
            self.remaining = min(self.remaining, _PATIENCE - spent(self._missing))
        self.is_plain = self.remaining > 0.0 and bool(self._missing)

    def spend(self, seconds: float) -> None:
        """Count a time [s] spent in the kernels of this tier."""
        self.remaining -= seconds
        if self.is_plain:
            with _lock:
                for kind in self._missing:
                    _spent[kind] = _spent.get(kind, 0.0) + seconds

    def end_plain(self, seconds: float) -> None:
        """Count a time [s] of plain Python that was used up before a frame began, and end plain Python."""
        self.spend(seconds)
        self.remaining, self._later, self.is_plain = 0.0, 0.0, False

    def kernel(self, kernel: Any) -> Any:
        """Return the function that this tier calls for a kernel."""
        plain = cache.in_python(kernel)
        return functools.partial(_in_python, plain) if self.is_plain or plain is kernel else kernel


def _in_python(kernel: Any, *arguments: Any) -> Any:
    """Call a kernel in plain Python, where 1/0 is infinite, and discarded by a select, as in a compiled kernel."""
    with np.errstate(all="ignore"):
        return kernel(*arguments)


def spent(kinds: Iterable[str]) -> float:
    """Return a lower bound of the time that this process spent in plain Python without all of these kernels [s]."""
    with _lock:
        return min((_spent.get(kind, 0.0) for kind in kinds), default=0.0)


def _same_bits(numbers: Any) -> bool:
    """Whether the kernels of these numbers, nested tuples, are known to use only + - * / and sqrt."""
    rest = [numbers]
    while rest:
        one = rest.pop()
        if not isinstance(one, tuple):
            continue
        kind = type(one)
        if getattr(kind, "calls_library", False) or kind.__module__.partition(".")[0] not in ("builtins", "swarm"):
            if not getattr(kind, "same_in_python", False):
                return False
        else:
            rest.extend(one)
    return True

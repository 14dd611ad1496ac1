"""Two tiers of kernels with the same bits: plain Python, which starts at once, and compiled, where that pays.

Plain Python takes 30 to 150 us an impact, the compiler 1 to 6 s for a new kind of scene.
"""

import math
import time
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..contact.regularisation import Power
from ..kernel import cache
from ..surfaces.formulas.numbers import OwnNumbers
from . import ledger

CHOICES = ("auto", "always", "never")
# Seconds of plain Python, of all runs of a process with the same missing kernels, after which these are compiled.
_PATIENCE = 1.0
# Seconds at most for which a run stays in plain Python because another process compiles its kernels.
_LONGEST_COMPILATION = 120.0
# In that time more particles than this have a few impacts each: nearly all of such a run is compiled anyway.
_FEW = 2000


class Tier:
    """The tier of a run.

    Args:
        choice: "auto": compiled where the kernels are found compiled, or an earlier process has found them worth it,
            else in plain Python until this process has been for about a second, and on while another process compiles
            them; "always" or "never" compiled.
        numbers: the arguments of the kernels. Where they call library functions, whose last bit may differ between
            the tiers, "auto" compiles at once: the result must not depend on the wall time.
        particles: their number.
    """

    def __init__(self, choice: str, numbers: Any, particles: int) -> None:
        patience = 0.0 if particles > _FEW or not _same_bits(numbers) else _PATIENCE
        # Time left for plain Python [s].
        self.remaining = {"always": 0.0, "never": math.inf}.get(choice, patience)
        self.is_plain = self.remaining > 0.0
        self._missing: list[str] = []
        self._latest = time.monotonic() + _LONGEST_COMPILATION if self.is_plain else -math.inf

    def choose(self, calls: Iterable[tuple[Any, tuple[Any, ...]]]) -> bool:
        """Choose the tier for the next calls, kernels and their arguments; whether it has changed."""
        before, may = self.is_plain, self.remaining > 0.0
        if self.remaining == math.inf:
            return False
        missing = [call for call in calls if (before or may) and not cache.is_compiled(*call)]
        self._missing = [cache.kind(*call) for call in missing]
        if may and missing:
            known = ledger.is_remembered(self._missing)
            self.remaining = 0.0 if known else min(self.remaining, _PATIENCE - ledger.spent(self._missing))
            may = self.remaining > 0.0
        if before and missing and not may and time.monotonic() < self._latest:
            # Where another process has begun, to wait for it would waste a core.
            may = any(cache.is_being_compiled(*call) for call in missing)
            self.remaining = _PATIENCE if may else self.remaining
        self.is_plain = may and bool(missing)
        if missing and not may and ledger.spent(self._missing) >= _PATIENCE:
            ledger.remember(self._missing)
        return self.is_plain != before

    def spend(self, seconds: float) -> None:
        """Count a time [s] that the kernels of this tier took."""
        self.remaining -= seconds
        if self.is_plain:
            ledger.book(self._missing, seconds)

    def kernel(self, kernel: Any) -> Any:
        """The function that this tier calls for a kernel."""
        plain = cache.in_python(kernel)
        if self.is_plain or plain is kernel:
            # As in compiled kernels: 1/0 is an infinity, which a select discards.
            return np.errstate(all="ignore")(plain)
        return kernel


def _same_bits(numbers: Any) -> bool:
    """Whether the kernels of these numbers, nested tuples, are known to use + - * / and sqrt alone."""
    if not isinstance(numbers, tuple):
        return True
    kind = type(numbers)
    if isinstance(numbers, (Power, OwnNumbers)) or kind.__module__.partition(".")[0] not in ("builtins", "swarm"):
        return getattr(kind, "same_in_python", False)
    return all(map(_same_bits, numbers))

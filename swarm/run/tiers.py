"""Two tiers of kernels with the same bits: in plain Python, which begins at once, and compiled, where that pays.

Plain Python takes 30 to 150 us an impact, the compiler 5 to 20 s for a new kind of scene.
"""

import math
from collections.abc import Iterable
from typing import Any

from ..contact.regularisation import Power
from ..kernel import cache
from ..surfaces.formulas.march import OwnNumbers

CHOICES = ("auto", "always", "never")
# Seconds of plain Python after which a run compiles its kernels.
_PATIENCE = 1.0
# More particles than this come to a few impacts each in that time: nearly all of such a run is to be compiled anyway.
_FEW = 2000


class Tier:
    """The tier that a run is in.

    Args:
        choice: "auto": compiled where the kernels are found compiled, else in plain Python for about a second first;
            "always" or "never" compiled.
        numbers: what is given to the kernels. Where it calls functions of a library, whose last bit is not the same in
            both tiers, "auto" compiles at once, since the result must not depend on the wall time.
        particles: how many there are.
    """

    def __init__(self, choice: str, numbers: Any, particles: int) -> None:
        patience = 0.0 if particles > _FEW or not _same_bits(numbers) else _PATIENCE
        # Seconds that the run may still spend in plain Python.
        self.left = {"always": 0.0, "never": math.inf}.get(choice, patience)
        self.is_plain = self.left > 0.0

    def choose(self, calls: Iterable[tuple[Any, tuple[Any, ...]]]) -> bool:
        """Choose the tier of the calls that follow, kernels and their arguments; whether it is another than before."""
        before, may = self.is_plain, self.left > 0.0
        self.is_plain = may and (self.left == math.inf or not all(cache.is_compiled(*call) for call in calls))
        return self.is_plain != before

    def kernel(self, kernel: Any) -> Any:
        """A kernel as this tier calls it."""
        return cache.in_python(kernel) if self.is_plain else kernel


def _same_bits(numbers: Any) -> bool:
    """Whether kernels of these numbers, nested tuples, are made of + - * / and sqrt alone, as far as is known."""
    if not isinstance(numbers, tuple):
        return True
    kind = type(numbers)
    if isinstance(numbers, (Power, OwnNumbers)) or kind.__module__.partition(".")[0] not in ("builtins", "swarm"):
        return getattr(kind, "same_in_python", False)
    return all(map(_same_bits, numbers))

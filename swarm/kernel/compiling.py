"""Names of kernels in plain words, and the number of a kernel among those that the run needs."""

from collections.abc import Callable, Iterable
from typing import Any

from . import cache

# The result of each kernel, in words for users.
_WORDS = {
    "advance_block": "flights and impacts",
    "slide_block": "sliding",
    "meet_block": "where contacts begin and end",
    "careful_block": "corners",
    "observe": "energies and momenta",
    "count_escaped": "particles that have escaped",
    "advance_bodies": "bodies",
    "lease": "walls that react",
    "predict": "impacts on walls that react",
    "take": "the order of impacts",
    "arrive": "the end of a frame",
    "list_pairs": "balls near one another",
    "list_walls": "balls near walls",
    "march": "balls that press on one another",
    "carry": "what lists of near balls keep",
    "stored": "the energy of contacts",
    "store_at_walls": "the energy of contacts with walls",
    "store": "the energy of contacts",
    "show": "frames of balls",
    "settle": "walls that react, at the end of a frame",
    "mark": "cells near walls",
    "begin": "what each ball meets first",
    "order": "the order of events",
    "welcome": "balls that come",
    "follow_all": "what crosses counters",
    "next_epoch": "the times of events",
    "_find_free": "free places",
    "distances_from": "distances from walls",
}

Calls = Iterable[tuple[Any, tuple[Any, ...]]]


class Compilations:
    """The kernels that are compiled for a run.

    Attributes:
        calls: returns every kernel that the run is known to need, with its arguments; the run sets it.
    """

    def __init__(self) -> None:
        self.calls: Callable[[], Calls] = lambda: ()
        self._begun = 0

    def sentence(self, kernel: Any) -> str:
        """Return the sentence before a kernel is compiled. Particles that slide or rest need further kernels."""
        left = sum(not cache.is_compiled(*call) for call in self.calls())
        self._begun += 1
        return sentence_of(kernel, f" ({self._begun} of {self._begun - 1 + max(1, left)})")


def sentence_of(kernel: Any, number: str = "") -> str:
    """Return the sentence before a kernel is compiled, with its number among those that a run needs."""
    name = kernel.__name__
    words = f"the kernel of {_WORDS[name]}" if name in _WORDS else f"the kernel {name}"
    return f"compiling {words}{number} for this kind of scene, once"

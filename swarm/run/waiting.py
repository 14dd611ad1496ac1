"""Waiting for a thread of a pool, from the thread that takes up signals."""

import math
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

# The caller's thread looks for an interrupt so often [s].
_GLANCE = 0.1
T = TypeVar("T")


def result_of(share: "Future[T]", latest: float, halt: Callable[[], None]) -> T:
    """What a thread returns, which is halted at `latest` [s of time.monotonic].

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

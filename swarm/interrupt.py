"""SIGINT and SIGTERM while a run is under way."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

_DEFAULTS: dict[int, Any] = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}


@contextlib.contextmanager
def taken_by(stop: Callable[[], None]) -> Iterator[None]:
    """Let the first SIGINT or SIGTERM call `stop`; after it both do at once what they do in Python.

    Python raises KeyboardInterrupt between any two of its instructions. Where that is inside a callback of the garbage
    collector, which runs often while Numba compiles, the exception is printed and lost, and the run goes on.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers, and only it is interrupted
        return
    # The others the caller handles himself, or ignores.
    taken = [number for number, default in _DEFAULTS.items() if signal.getsignal(number) is default]

    def give_back() -> None:
        for number in taken:
            signal.signal(number, _DEFAULTS[number])

    def handle(number: int, frame: FrameType | None) -> None:
        give_back()
        stop()

    for number in taken:
        signal.signal(number, handle)
    try:
        yield
    finally:
        give_back()

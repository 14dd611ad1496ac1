"""SIGINT and SIGTERM while a run is under way."""

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

# As a shell's for a process that SIGINT ended; and where it says so.
_EXIT, _STDERR = 130, 2
_DEFAULTS: dict[int, Any] = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}


@contextlib.contextmanager
def at_once() -> Iterator[None]:
    """Let a SIGINT end the process without another word than that, exit code 130.

    For imports and the last words of a command: an exception in the midst of an import may be lost, or become another
    one and a traceback.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield  # the caller handles it himself, or ignores it
        return

    leave_at_once()
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def leave_at_once() -> None:
    """Let a SIGINT end the process from now on: there is nothing left to lose."""

    def leave(number: int, frame: FrameType | None) -> None:
        os.write(_STDERR, b"interrupted\n")
        os._exit(_EXIT)

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


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

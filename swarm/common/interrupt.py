"""The effect of SIGINT and SIGTERM during a run."""

import contextlib
import gc
import os
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

from ..kernel.collection import uncollected

# The exit code that a shell gives a process ended by SIGINT; the descriptor of standard error.
_EXIT, _STDERR = 130, 2
_DEFAULTS: dict[int, Any] = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}


@contextlib.contextmanager
def at_once() -> Iterator[None]:
    """Let a SIGINT end the process with only the word "interrupted", exit code 130.

    For imports and the last output of a command: an exception within an import may be lost, or become another one
    with a traceback.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield  # the caller handles it, or ignores it
        return

    leave_at_once()
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextlib.contextmanager
def importing() -> Iterator[None]:
    """`at_once` for the imports of a command, with the garbage collector disabled.

    Collections would go through the modules again and again, which takes 40 ms. Objects that exist after the first
    imports are never collected, as modules are not; later objects are.
    """
    with uncollected(), at_once():
        try:
            yield
        finally:
            if not gc.get_freeze_count():
                gc.freeze()


def leave_at_once() -> None:
    """Let a SIGINT end the process from now on, as all files are closed."""

    def leave(number: int, frame: FrameType | None) -> None:
        os.write(_STDERR, b"interrupted\n")
        os._exit(_EXIT)

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


@contextlib.contextmanager
def taken_by(stop: Callable[[], None]) -> Iterator[None]:
    """Let the first SIGINT or SIGTERM call `stop`, and restore the default effect of both in Python.

    Python raises KeyboardInterrupt between any two of its instructions. Inside a callback of the garbage collector,
    which runs often while Numba compiles, the exception is printed and lost, and the run continues.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers, and only it is interrupted
        return
    # The caller handles the others, or ignores them.
    taken = [number for number, default in _DEFAULTS.items() if signal.getsignal(number) is default]

    def restore() -> None:
        for number in taken:
            signal.signal(number, _DEFAULTS[number])

    def handle(number: int, frame: FrameType | None) -> None:
        restore()
        stop()

    for number in taken:
        signal.signal(number, handle)
    try:
        yield
    finally:
        restore()

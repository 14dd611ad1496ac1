"""SIGINT while a run is under way."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType


@contextlib.contextmanager
def taken_by(stop: Callable[[], None]) -> Iterator[None]:
    """Let the first SIGINT call `stop`; a second one raises KeyboardInterrupt at once, as Python does.

    Python raises KeyboardInterrupt between any two of its instructions. Where that is inside a callback of the garbage
    collector, which runs often while Numba compiles, the exception is printed and lost, and the run goes on.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers, and only it is interrupted
        return
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.default_int_handler:
        yield  # the caller has a handler of his own, or ignores the signal
        return

    def handle(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, before)
        stop()

    signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)

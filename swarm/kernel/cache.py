"""Compiled kernels on disk: their folder, whether a kernel is compiled, and reports of compilations.

`machine_code.py` makes and finds them, and imports the compiler.
"""

import contextlib
import logging
import math
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .deferred import compiler

# The file of Numba's settings, in the current folder.
_SETTINGS = ".numba_config.yaml"
_COMPILING = "compiling a kernel, once: {}"
_LOG = logging.getLogger("swarm")
# A compilation that takes longer [s] gives a warning, as not every run shows its compilations.
LONG = 10.0
_SLOW = f"it takes more than {LONG:g} s so far"


def base() -> Path:
    """Return the folder of all files kept between processes: $NUMBA_CACHE_DIR or $XDG_CACHE_HOME or ~/.cache."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get("NUMBA_CACHE_DIR") or Path(home) / "swarm")


def is_disabled() -> bool:
    """Whether the compiler is disabled in this process."""
    if "numba" not in sys.modules and not os.path.exists(_SETTINGS):
        return os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0")
    import numba

    return bool(numba.config.DISABLE_JIT)  # type: ignore[attr-defined]


def in_python(kernel: Any) -> Any:
    """Return the Python function of a kernel."""
    return getattr(kernel, "py_func", kernel)


def kind(kernel: Any, arguments: tuple[Any, ...]) -> str:
    """Return a name for the types that a kernel is compiled for."""
    return str(compiler().kind_of(in_python(kernel), arguments))


def is_compiled(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether a kernel is compiled for such arguments, in this process or on disk.

    Numba has no function for this. Its own search initialises the compiler, 0.2 s in each process; a look at its index
    takes a millisecond.
    """
    if in_python(kernel) is kernel:
        return True  # the compiler is disabled
    return bool(compiler().is_found(kernel, arguments))


# --- Reports ---------------------------------------------------------------------------------------------


class Spent:
    """The time spent on kernels.

    Attributes:
        seconds: wall time.
        latest: when the latest of them began and ended [s of time.monotonic].
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self.latest = -math.inf, -math.inf


class Listener:
    """A listener for the beginning and the end of each compilation of a function.

    Args:
        tell: called with a sentence about each kernel.
        sentence: makes the sentence from the kernel; None: the name of the kernel.
        why: why a compilation may take long, or "".
    """

    def __init__(self, tell: Callable[[str], None], sentence: Callable[[Any], str] | None, why: str = "") -> None:
        self._tell, self._sentence, self._begun = tell, sentence, list[float]()
        self._slow = f"{_SLOW}; {why}" if why else _SLOW
        self._timer: threading.Timer | None = None
        self.spent = Spent()

    def begins(self, function: Any, is_kernel: bool) -> None:
        """Report that a compilation begins."""
        self._begun.append(time.monotonic())
        if is_kernel:
            message = _COMPILING.format(function.__name__) if self._sentence is None else self._sentence(function)
            _LOG.info(message)
            self._tell(message)
            self._end_timer()
            self._timer = threading.Timer(LONG, _LOG.warning, (f"{message}: {self._slow}",))
            self._timer.daemon = True
            self._timer.start()

    def ends(self) -> None:
        """Report that a compilation ends."""
        if not self._begun:
            return  # the compilation began before this context
        first = self._begun.pop()
        # A compilation within another one is counted there.
        if not self._begun:
            self._end_timer()
            self.spent.latest = first, time.monotonic()
            self.spent.seconds += self.spent.latest[1] - first

    def _end_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


# The listeners of the open contexts: the compiler calls each of them.
listeners: list[Listener] = []


@contextlib.contextmanager
def kernels_compiled(
    tell: Callable[[str], None], sentence: Callable[[Any], str] | None = None, why: str = ""
) -> Iterator[Spent]:
    """Report every kernel that is compiled in this context to the logger and to `tell`; arguments as in `Listener`."""
    one = Listener(tell, sentence, why)
    listeners.append(one)
    try:
        yield one.spent
    finally:
        listeners.remove(one)

"""Compiled kernels on disk: their folder, whether a kernel is there, and reports of compilations.

What makes and finds them is in `machine_code.py`, which imports the compiler.
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
# A compilation that takes longer [s] is a warning, for not every run shows what is compiled.
LONG = 10.0
_SLOW = f"it takes more than {LONG:g} s so far"


def base() -> Path:
    """Folder of all that is kept between processes: $NUMBA_CACHE_DIR or $XDG_CACHE_HOME or ~/.cache."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get("NUMBA_CACHE_DIR") or Path(home) / "swarm")


def is_disabled() -> bool:
    """Whether the compiler is switched off for this process."""
    if "numba" not in sys.modules and not os.path.exists(_SETTINGS):
        return os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0")
    import numba

    return bool(numba.config.DISABLE_JIT)  # type: ignore[attr-defined]


def in_python(kernel: Any) -> Any:
    """The function that a kernel is compiled from."""
    return getattr(kernel, "py_func", kernel)


def kind(kernel: Any, arguments: tuple[Any, ...]) -> str:
    """A name for what a kernel is compiled for."""
    return str(compiler().kind_of(in_python(kernel), arguments))


def is_compiled(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether a kernel is compiled for such arguments, in this process or on disk.

    Numba has no function for it. Its own search initialises the compiler, 0.2 s in each process; a look into its index
    takes a millisecond.
    """
    if in_python(kernel) is kernel:
        return True  # the compiler is disabled
    return bool(compiler().is_found(kernel, arguments))


# --- Reports ---------------------------------------------------------------------------------------------


class Spent:
    """The time that went into kernels.

    Attributes:
        seconds: of wall time.
        latest: when the latest of them began and ended [s of time.monotonic].
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self.latest = -math.inf, -math.inf


class Listener:
    """What happens at the beginning and at the end of a compilation of any function.

    Args:
        tell: is given a sentence about each kernel.
        sentence: makes it of the kernel; None: its name.
        why: why a compilation may take long, or "".
    """

    def __init__(self, tell: Callable[[str], None], sentence: Callable[[Any], str] | None, why: str = "") -> None:
        self._tell, self._sentence, self._begun = tell, sentence, list[float]()
        self._slow = f"{_SLOW}; {why}" if why else _SLOW
        self._timer: threading.Timer | None = None
        self.spent = Spent()

    def begins(self, function: Any, is_kernel: bool) -> None:
        """A compilation begins."""
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
        """A compilation ends."""
        if not self._begun:
            return  # of one that began before this context
        first = self._begun.pop()
        # One that is compiled within another is counted there.
        if not self._begun:
            self._end_timer()
            self.spent.latest = first, time.monotonic()
            self.spent.seconds += self.spent.latest[1] - first

    def _end_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


# Of the contexts that are open: the compiler tells each of them.
listeners: list[Listener] = []


@contextlib.contextmanager
def kernels_compiled(
    tell: Callable[[str], None], sentence: Callable[[Any], str] | None = None, why: str = ""
) -> Iterator[Spent]:
    """Report every kernel that is compiled in this context to the logger and to `tell`: the arguments of `Listener`."""
    one = Listener(tell, sentence, why)
    listeners.append(one)
    try:
        yield one.spent
    finally:
        listeners.remove(one)

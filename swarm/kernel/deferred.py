"""What the compiler registers when it is first needed, and not before: a run of few particles needs no compiler.

To import Numba, LLVM and the trace, and to load a kernel, takes 0.6 s of processor time, more than such a run.
"""

import importlib
import threading
from collections.abc import Callable
from typing import Any

_waiting: list[Callable[[Any], Any]] = []
_lock = threading.RLock()
_loaded: list[Any] = []


def defer(action: Callable[[Any], Any]) -> None:
    """Do something with the module `machine_code` when it is loaded, now if it is."""
    _waiting.append(action)
    if _loaded:
        _do_all()


def compiler() -> Any:
    """The module `machine_code`, which the first call imports."""
    return importlib.import_module(".machine_code", __package__)


def is_loaded() -> bool:
    """Whether this process has imported the compiler."""
    return bool(_loaded)


def loaded(machine_code: Any) -> None:
    """Do all that was deferred; `machine_code` calls it with itself when it is complete."""
    _loaded.append(machine_code)
    _do_all()


def _do_all() -> None:
    with _lock:
        while _waiting:
            _waiting.pop(0)(_loaded[0])

"""Actions that wait until the compiler is first needed: a run of few particles needs no compiler.

Importing Numba, LLVM and the trace and loading a kernel takes 0.6 s of processor time, more than such a run.
"""

import gc
import importlib
import threading
from collections.abc import Callable
from typing import Any

from .collection import uncollected

_waiting: list[Callable[[Any], Any]] = []
_lock = threading.RLock()
_loaded: list[Any] = []


def defer(action: Callable[[Any], Any]) -> None:
    """Call `action` with the module `machine_code` when it is loaded, at once if it is."""
    _waiting.append(action)
    if _loaded:
        _do_all()


def compiler() -> Any:
    """Return the module `machine_code`; the first call imports it.

    The garbage collector is disabled meanwhile. If the imports of the process are frozen, as a command freezes its own,
    these are too: a collection through Numba's objects takes 0.1 s and finds nothing.
    """
    if is_loaded():
        return importlib.import_module(".machine_code", __package__)
    with uncollected():
        made = importlib.import_module(".machine_code", __package__)
        if gc.get_freeze_count():
            gc.freeze()
    return made


def is_loaded() -> bool:
    """Whether this process has imported the compiler."""
    return bool(_loaded)


def loaded(machine_code: Any) -> None:
    """Run all deferred actions; `machine_code` calls this with itself when it is complete."""
    _loaded.append(machine_code)
    _do_all()


def _do_all() -> None:
    with _lock:
        while _waiting:
            _waiting.pop(0)(_loaded[0])

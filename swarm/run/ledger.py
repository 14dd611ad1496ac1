"""Seconds of plain Python so far, by kind of kernel: in this process, and on disk which kinds were worth compiling.

On disk a kind is the name of an empty file, beside the folders of compiled kernels and whatever their code: there is
nothing that two processes could write at the same time, or a crash cut short.
"""

import contextlib
import threading
from collections.abc import Iterable
from pathlib import Path

from ..kernel import cache

_FOLDER = "worth"
_spent: dict[str, float] = {}
_lock = threading.Lock()


def book(kinds: Iterable[str], seconds: float) -> None:
    """Count a time in plain Python for each kernel that is missing."""
    with _lock:
        for kind in kinds:
            _spent[kind] = _spent.get(kind, 0.0) + seconds


def spent(kinds: Iterable[str]) -> float:
    """Seconds that this process was in plain Python while all of these kernels were missing, at least."""
    with _lock:
        return min((_spent.get(kind, 0.0) for kind in kinds), default=0.0)


def remember(kinds: Iterable[str]) -> None:
    """Tell later processes that these kernels were worth compiling, if the disk takes it."""
    for path in map(_path, kinds):
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()


def is_remembered(kinds: Iterable[str]) -> bool:
    """Whether an earlier process, or this one, has found each of these kernels worth compiling."""
    return all(path.exists() for path in map(_path, kinds))


def _path(kind: str) -> Path:
    return cache.base() / _FOLDER / kind

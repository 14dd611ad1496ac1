"""The key of the code of a kernel: a digest of all code of this package that the kernel may trace.

Numba's own cache checks only the file of the compiled function, so after an edit in another file it would return the
old code. A key of all files would discard every kernel at any edit. This key follows the references of a kernel, from
function to function and from class to base class, which takes 0.3 s; so it is kept on disk, under a digest of the text
of the package, and a warm call reads only this file.
"""

import contextlib
import functools
import hashlib
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .entries import Key, is_own, key_of

_ROOT = Path(__file__).parents[1]
_STARTED = time.time()


def key_of_kernel(function: Any, kinds: Sequence[Any], others: tuple[Any, ...], kept: Path) -> Key:
    """Return the key of a kernel.

    Args:
        function: the function that is compiled.
        kinds: the Numba types of its arguments.
        others: all else that distinguishes two kernels.
        kept: the folder where digests are kept.

    Returns:
        A key that repeats in another process if all that the kernel may trace is the same there.
    """
    names = _names_of(function, kinds, others)
    known = kept / f"{names.text}{text_of_package()}"
    # A text other than that which this process runs does not describe its code.
    is_text = names.repeats and is_package_as_imported()
    if is_text:
        with contextlib.suppress(OSError):
            return names._replace(text=known.read_text())
    whole = key_of(kinds, *others, function, package=text_of_package() if is_text else "")
    if is_text and whole.repeats and is_package_as_imported():
        _write(known, whole.text)
    return whole


def was_compiled(function: Any, kinds: Sequence[Any], others: tuple[Any, ...], kept: Path) -> bool:
    """Whether a kernel of these names was compiled before, with any code; if not, its key need not be computed."""
    return any(kept.glob(f"{_names_of(function, kinds, others).text}*"))


def _names_of(function: Any, kinds: Sequence[Any], others: tuple[Any, ...]) -> Key:
    user = () if is_own(function) else (function,)
    return key_of(kinds, *others, function.__module__, function.__qualname__, *user)


def _write(known: Path, text: str) -> None:
    with contextlib.suppress(OSError):
        known.parent.mkdir(parents=True, exist_ok=True)
        part = known.with_suffix(f".{os.getpid()}")
        part.write_text(text)
        part.replace(known)


@functools.cache
def text_of_package() -> str:
    """Return a digest of the text of all modules of this package."""
    found = hashlib.sha256()
    for path in _files():
        text = Path(path).read_bytes()
        found.update(b"%s %d:" % (os.path.relpath(path, _ROOT).encode(), len(text)) + text)
    return found.hexdigest()[:16]


def is_package_as_imported() -> bool:
    """Whether no module of this package has changed since this process imported the first one."""
    changed = (max(found.st_mtime, found.st_ctime) for found in map(os.stat, _files()))
    return max(changed) < _STARTED


def _files() -> list[str]:
    found = (os.path.join(folder, name) for folder, _folders, names in os.walk(_ROOT) for name in names)
    return sorted(path for path in found if path.endswith(".py"))

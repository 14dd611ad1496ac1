"""Compiled kernels on disk: the folder that holds them, whether one is there, and who hears of one that is not."""

import contextlib
import hashlib
import logging
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba import types
from numba.core import event
from numba.core.caching import FunctionCache

_CONFIG: Any = numba.config
_LOG = logging.getLogger("swarm")
_COMPILING = "compiling kernels for this scene, once: {}"
_kernels: list[Any] = []
# The definitions that code outside of this package has registered, by their class.
_outside: dict[Any, list[Callable[..., Any]]] = {}


def _source_hash() -> str:
    """Digest of every source file of the package: it names the cache folder.

    Numba's cache looks at the file of the compiled function only, so after an edit in another file it would
    answer with the old code.
    """
    root = Path(__file__).parents[1]
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels, $NUMBA_CACHE_DIR or $XDG_CACHE_HOME or ~/.cache, then the source hash."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    base = os.environ.get("NUMBA_CACHE_DIR") or Path(home) / "swarm"
    return Path(base) / _source_hash()


_CACHE = cache_folder()


def kept(function: Callable[..., Any], flags: dict[str, Any]) -> Any:
    """The kernel of a function: Numba compiles it with these flags where no earlier process has."""
    previous = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = str(_CACHE)
    try:
        made = numba.njit(cache=True, **flags)(function)
        if made is not function:
            made._cache = _Cache(function)
    finally:
        _CONFIG.CACHE_DIR = previous
    _kernels.append(made)
    return made


def registered(kind: Any, definition: Callable[..., Any]) -> None:
    """Note a definition for a class: the folder's name covers no code outside of this package."""
    if str(definition.__module__).partition(".")[0] != "swarm":
        _outside.setdefault(kind, []).append(definition)


class _Cache(FunctionCache):  # type: ignore[misc]
    """A kernel of a class with such definitions is found only where they are the same."""

    def _index_key(self, kinds: Any, codegen: Any) -> Any:
        return (*super()._index_key(kinds, codegen), *_digests(kinds))


def _digests(kinds: Any) -> Iterator[str]:
    from .frozen import Frozen  # which uses the compiler, which uses this module

    for kind in kinds:
        if isinstance(kind, types.BaseTuple):
            frozen = Frozen()
            for parent in getattr(kind, "instance_class", tuple).__mro__:
                for definition in _outside.get(parent, ()):
                    frozen.value(definition)
                    yield frozen.digest()
            yield from _digests(kind.types)  # type: ignore[attr-defined]


def in_python(kernel: Any) -> Any:
    """The function that a kernel is compiled from."""
    return getattr(kernel, "py_func", kernel)


def is_compiled(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether a kernel is compiled for such arguments, in this process or on disk.

    Numba has no function for it. To let it look and stop it before it compiles takes 0.2 s at the first kernel of a
    process; its index on disk takes a millisecond.
    """
    if in_python(kernel) is kernel:
        return True  # without the compiler there is nothing to wait for
    kinds = tuple(map(numba.typeof, arguments))
    disk = kernel._cache
    return kinds in kernel.overloads or (
        disk._index_key(kinds, kernel.targetctx.codegen()) in disk._cache_file._load_index()
    )


@contextlib.contextmanager
def kernels_compiled(tell: Callable[[str], None]) -> Iterator[None]:
    """Tell the logger and `tell`, by a sentence, of every kernel that is compiled in this context."""

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, compiled: Any) -> None:
            if compiled.data["dispatcher"] in _kernels:
                sentence = _COMPILING.format(compiled.data["dispatcher"].__name__)
                _LOG.info(sentence)
                tell(sentence)

        def on_end(self, compiled: Any) -> None:
            pass

    with event.install_listener("numba:compile", Listener()):
        yield

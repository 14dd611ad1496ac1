"""Compiled kernels on disk: their folder, whether a kernel is there, and reports of compilations."""

import contextlib
import functools
import hashlib
import inspect
import logging
import math
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import event, sigutils
from numba.core.caching import FunctionCache

from .digest import key_of_kernel, was_compiled
from .entries import File, Key, is_own, key_of
from .once import held

_CONFIG: Any = numba.config
_LOG = logging.getLogger("swarm")
_LOCK = ".lock"
_COMPILING = "compiling a kernel, once: {}"
_DIGESTS = "digests"
_kernels: list[Any] = []
_compiling = threading.local()

_HERE = Path(__file__).parent


def base() -> Path:
    """Folder of all that is kept between processes: $NUMBA_CACHE_DIR or $XDG_CACHE_HOME or ~/.cache."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get("NUMBA_CACHE_DIR") or Path(home) / "swarm")


def cache_folder() -> Path:
    """Folder of the compiled kernels: that of all that is kept, then a digest of the code that makes them.

    That is this folder, which every kernel goes through. What else a kernel is made of is in its key, see `digest.py`.
    """
    files = sorted(_HERE.rglob("*.py"))
    return base() / _digest([(path.relative_to(_HERE).as_posix(), *_code(path)) for path in files])


def _digest(texts: Any) -> str:
    versions = numba.__version__, llvmlite.__version__, np.__version__, sys.version_info[:2]
    whole = repr((versions, texts))
    return hashlib.sha256(whole.encode()).hexdigest()[:16]


def _code(path: Path) -> Iterator[Any]:
    """The code of a module, without comments and docstrings: Python has compiled it already, or keeps it now."""
    whole: Any = SourceFileLoader(path.stem, str(path)).get_code(path.stem)
    found = [whole]
    for code in found:
        # The first constant is the docstring, or None.
        constants = [one for k, one in enumerate(code.co_consts) if k > 0 or not isinstance(one, str)]
        found.extend(one for one in constants if isinstance(one, CodeType))
        yield code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_argcount
        yield [
            sorted(map(repr, one)) if isinstance(one, frozenset) else one
            for one in constants
            if not isinstance(one, CodeType)
        ]


_folder = functools.cache(cache_folder)


def is_disabled() -> bool:
    """Whether the compiler is switched off for this process."""
    return bool(_CONFIG.DISABLE_JIT)


def cached(function: Callable[..., Any], flags: dict[str, Any], compiled: Callable[..., Any] | None = None) -> Any:
    """The kernel of a function: Numba compiles it, or `compiled` in its place, where no earlier process has."""
    if is_disabled():
        return function
    previous = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = str(_folder())
    try:
        made: Any = numba.njit(cache=True, **flags)(compiled or function)
        made.py_func, made._cache = function, _Cache(function)
    finally:
        _CONFIG.CACHE_DIR = previous
    disk = made._cache
    name, stamp = disk._impl.filename_base, disk._impl.locator.get_source_stamp()
    if is_own(function):
        # The code is in the key. Numba's own stamp, the file of the function and its line, would change with every
        # comment.
        name, stamp = f"{function.__module__}.{function.__qualname__}.{sys.implementation.cache_tag}", ""
    disk._cache_file = File(disk.cache_path, name, stamp)
    # On the object: Numba's own code calls it from C and from other kernels, and a class of ours would have to be
    # registered as its target's.
    made.compile = functools.partial(_compile_once, made, made.compile)
    _kernels.append(made)
    return made


def calling(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that calls another, all that Numba compiles of a kernel by itself: the other is traced into it."""
    names = ", ".join(inspect.signature(function).parameters)
    scope: dict[str, Any] = {"__name__": function.__module__, "traced": function}
    code = compile(f"def {function.__name__}({names}): return traced({names})", function.__code__.co_filename, "exec")
    exec(code, scope)
    return functools.update_wrapper(scope[function.__name__], function, ("__module__", "__name__", "__qualname__"), ())


class _Cache(FunctionCache):  # type: ignore[misc]
    """A kernel is found only if all code that it may trace is unchanged, for the same processor and level of LLVM."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._keys: dict[Any, Key] = {}

    def _index_key(self, kinds: Any, codegen: Any) -> Key:
        if kinds not in self._keys or not is_own(self._py_func):
            self._keys[kinds] = key_of_kernel(*self._asked(kinds, codegen))
        return self._keys[kinds]

    def was_compiled(self, kinds: Any, codegen: Any) -> bool:
        """Whether it was compiled for arguments of these types, of whatever code."""
        return kinds in self._keys or was_compiled(*self._asked(kinds, codegen))

    def _asked(self, kinds: Any, codegen: Any) -> tuple[Any, ...]:
        return self._py_func, kinds, (*super()._index_key((), codegen), str(_CONFIG.OPT)), _folder() / _DIGESTS

    def save_overload(self, kinds: Any, made: Any) -> None:
        # What Python code inside of a helper needs, as Numba does it for a kernel that it loads.
        for environment in made._find_referenced_environments():
            made.library.codegen.set_env(environment.env_name, environment)
        # Of two processes that save the same kernel for other arguments, both would take the same name for their code
        # and one would lose its entry of the index: a kernel for other arguments than it says would be loaded.
        # A disk that is full costs the next process its time, and this one nothing.
        with held(Path(self._cache_file._index_path + _LOCK)), contextlib.suppress(OSError):
            super().save_overload(kinds, made)


def _compile_once(kernel: Any, compile: Callable[[Any], Any], signature: Any) -> Any:
    """Numba's `compile`, of all processes in one at a time for the same kernel and arguments.

    The others wait, and find it on disk: 50 runs that start together took the compile time of 50.
    """
    kinds = tuple(sigutils.normalize_signature(signature)[0])
    # A kernel that is compiled within another takes no lock: no two processes can wait for each other.
    if getattr(_compiling, "one", False) or _is_found(kernel, kinds):
        return compile(signature)
    with held(_lock_of(kernel, kinds)):
        _compiling.one = True
        try:
            return compile(signature)  # looks at the disk first
        finally:
            _compiling.one = False


def _key_of(kernel: Any, kinds: Any) -> str:
    return str(kernel._cache._index_key(kinds, kernel.targetctx.codegen()).text)


def _lock_of(kernel: Any, kinds: Any) -> Path:
    """The file that a process locks while it compiles a kernel for such arguments."""
    return Path(f"{kernel._cache._cache_file._index_path}.{_key_of(kernel, kinds)}{_LOCK}")


def _is_found(kernel: Any, kinds: Any) -> bool:
    """Whether a kernel is compiled for arguments of these types, in this process or on disk."""
    if kinds in kernel.overloads:
        return True
    if not kernel._cache.was_compiled(kinds, kernel.targetctx.codegen()):
        return False
    file = kernel._cache._cache_file
    name = file._load_index().get(_key_of(kernel, kinds))
    # A kill may come between the entry of the index and its file.
    return name is not None and os.path.exists(file._data_path(name))


def in_python(kernel: Any) -> Any:
    """The function that a kernel is compiled from."""
    return getattr(kernel, "py_func", kernel)


def kind(kernel: Any, arguments: tuple[Any, ...]) -> str:
    """A name for what a kernel is compiled for."""
    function = in_python(kernel)
    return key_of(tuple(map(numba.typeof, arguments)), function.__module__, function.__qualname__).text


def is_compiled(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether a kernel is compiled for such arguments, in this process or on disk.

    Numba has no function for it. Its own search initialises the compiler, 0.2 s in each process; a look into its index
    takes a millisecond.
    """
    if in_python(kernel) is kernel:
        return True  # the compiler is disabled
    return _is_found(kernel, tuple(map(numba.typeof, arguments)))


class Spent:
    """The time that went into kernels.

    Attributes:
        seconds: of wall time.
        latest: when the latest of them began and ended [s of time.monotonic].
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self.latest = -math.inf, -math.inf


@contextlib.contextmanager
def kernels_compiled(tell: Callable[[str], None], sentence: Callable[[Any], str] | None = None) -> Iterator[Spent]:
    """Report every kernel that is compiled in this context to the logger and to `tell`, in its `sentence`."""
    spent, begun = Spent(), []

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, compiled: Any) -> None:
            begun.append(time.monotonic())
            kernel = compiled.data["dispatcher"]
            if kernel in _kernels:
                message = _COMPILING.format(kernel.__name__) if sentence is None else sentence(kernel)
                _LOG.info(message)
                tell(message)

        def on_end(self, compiled: Any) -> None:
            first = begun.pop()
            # One that is compiled within another is counted there.
            if not begun:
                spent.latest = first, time.monotonic()
                spent.seconds += spent.latest[1] - first

    with event.install_listener("numba:compile", Listener()):
        yield spent

"""Machine code of kernels: made from their functions by the trace and Numba, once on each machine, then read from disk.

The only place for the compiler's flags. Imported when a kernel is first compiled or looked for, see `deferred.py`.
"""

import contextlib
import functools
import hashlib
import importlib
import importlib.util
import inspect
import os
import sys
from collections.abc import Callable, Iterator
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba._dispatcher import compute_fingerprint
from numba.core import event, sigutils
from numba.core.caching import FunctionCache
from numba.np import linalg as blas

from . import emission
from .cache import Listener, base, is_disabled, listeners
from .compilers import KernelCompiler, LongKernelCompiler, PartCompiler, WideLongKernelCompiler, features_of
from .compiling import sentence_of
from .deferred import loaded
from .digest import key_of_kernel, was_compiled
from .entries import File, Key, is_own, key_of
from .jit import Kernel
from .once import held
from .trace import calls
from .trace.helpers import leaving, prepare

_CONFIG: Any = numba.config
_LOCK = ".lock"
_DIGESTS = "digests"
_kernels: list[Any] = []
# Kernels that are compiled, each with the fingerprint of its arguments.
_found: set[tuple[Any, tuple[bytes, ...]]] = set()

_HERE = Path(__file__).parent

# Strict IEEE arithmetic: `fastmath` would let the compiler reorder sums, and with them the energy balance.
# The NumPy error model makes 1/0 an infinity; Python's would put a branch before every division, and a
# branch in the lane loop costs its vectorisation.
# Without reference counts: each array of a NamedTuple that is passed on counts as taken and given back, by an atomic
# instruction that two threads do for the same arrays. They were 100 of the 140 ns of a particle that flies freely
# through a frame, and a third of the code to compile. So kernels make no arrays but `scratch`.
_FLAGS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}
# No kernel is called from C.
_KERNEL: Any = {"no_cfunc_wrapper": True, **_FLAGS}
# Only kernels call helpers, and Python never their compiled form: omitting wrappers saves a fifth of the compile time.
_OUTLINE: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": PartCompiler, **_FLAGS}
_INLINE: Any = {"forceinline": True, **_OUTLINE}
# Functions of the user that cannot be traced, and functions that may make arrays.
_ALLOCATING: Any = {**_INLINE, "_nrt": True}
calls.leave = leaving(_ALLOCATING)
emit_spaced = emission.emit_spaced


def _find_scipy_only() -> None:
    """Let Numba look for SciPy, as it does before the first kernel, without importing its linear algebra.

    The import takes 0.1 of 0.8 s of every start if SciPy is installed, for products of matrices, which no kernel here
    has. A kernel with such products imports it as always.
    """
    ask: Any = blas.ensure_blas

    def find() -> None:
        if importlib.util.find_spec("scipy") is None:
            raise ImportError

    blas.ensure_blas = find
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        blas.ensure_blas = ask


_find_scipy_only()


# --- For the declarations of modules ---------------------------------------------------------------------


def kernel_of(kernel: Kernel) -> Any:
    """Return Numba's dispatcher of a kernel."""
    # Numba keeps its data of a function by its identity: a kernel that is made again has a function of its own.
    function = kernel.py_func
    traced = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    prepare(traced, _INLINE, outlined=False, is_kernel=True)
    long = WideLongKernelCompiler if kernel.is_wide else LongKernelCompiler
    pipeline = long if kernel.is_long else KernelCompiler
    return cached(function, {**_KERNEL, "pipeline_class": pipeline}, calling(traced))


def prepare_helper(function: Any, is_outlined: bool = False, body: Any = None) -> None:
    """Let traces and Numba call a helper, or in its place `body`, which may make arrays."""
    flags = _ALLOCATING if body is not None else _OUTLINE if is_outlined else _INLINE
    prepare(function, flags, outlined=is_outlined, body=body)


# Without an open context, as in `pack`, the sentence goes only to the log.
_unlistened = Listener(lambda _sentence: None, sentence_of)


class _Announcer(event.Listener):  # type: ignore[misc]
    """Pass the beginning and the end of each compilation to the open contexts."""

    def on_start(self, compiled: Any) -> None:
        function = compiled.data["dispatcher"]
        for one in tuple(listeners) or (_unlistened,):
            one.begins(function, function in _kernels)

    def on_end(self, compiled: Any) -> None:
        for one in tuple(listeners) or (_unlistened,):
            one.ends()


event.register("numba:compile", _Announcer())


# --- On disk ---------------------------------------------------------------------------------------------


def cache_folder() -> Path:
    """Return the folder of the compiled kernels: the base folder, then a digest of the code that makes them.

    It is the code of this folder, which every kernel goes through. The rest of its code is in its key, see `digest.py`.
    """
    files = sorted(_HERE.rglob("*.py"))
    return base() / _digest([(path.relative_to(_HERE).as_posix(), *_code(path)) for path in files])


def _digest(texts: Any) -> str:
    versions = numba.__version__, llvmlite.__version__, np.__version__, sys.version_info[:2]
    whole = repr((versions, texts))
    return hashlib.sha256(whole.encode()).hexdigest()[:16]


def _code(path: Path) -> Iterator[Any]:
    """Yield the code of a module, without comments and docstrings: Python has compiled it already, or keeps it now."""
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


def cached(function: Callable[..., Any], flags: dict[str, Any], compiled: Callable[..., Any] | None = None) -> Any:
    """Return the kernel of a function: Numba compiles it, or `compiled` in its place, unless an earlier process has."""
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
    # On the object: Numba's own code calls it from C and from other kernels, and a subclass would have to be
    # registered as its target's.
    made.compile = functools.partial(_compile_once, made, made.compile)
    _kernels.append(made)
    return made


def calling(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that only calls another, for Numba to compile as a kernel: the other is traced into it."""
    names = ", ".join(inspect.signature(function).parameters)
    scope: dict[str, Any] = {"__name__": function.__module__, "traced": function}
    code = compile(f"def {function.__name__}({names}): return traced({names})", function.__code__.co_filename, "exec")
    exec(code, scope)
    return functools.update_wrapper(scope[function.__name__], function, ("__module__", "__name__", "__qualname__"), ())


class _Cache(FunctionCache):  # type: ignore[misc]
    """The cache of a kernel, found only if all code that it may trace, the processor and LLVM's level are unchanged."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._keys: dict[Any, Key] = {}

    def _index_key(self, kinds: Any, codegen: Any) -> Key:
        if kinds not in self._keys or not is_own(self._py_func):
            self._keys[kinds] = key_of_kernel(*self._asked(kinds, codegen))
        return self._keys[kinds]

    def was_compiled(self, kinds: Any, codegen: Any) -> bool:
        """Whether it was compiled for arguments of these types, with any code."""
        return kinds in self._keys or was_compiled(*self._asked(kinds, codegen))

    def _asked(self, kinds: Any, codegen: Any) -> tuple[Any, ...]:
        processor = *super()._index_key((), codegen), features_of(codegen), str(_CONFIG.OPT)
        return self._py_func, kinds, processor, _folder() / _DIGESTS

    def save_overload(self, kinds: Any, made: Any) -> None:
        # The environment of Python code inside of a helper, as Numba sets it for a kernel that it loads.
        for environment in made._find_referenced_environments():
            made.library.codegen.set_env(environment.env_name, environment)
        # Of two processes that save the same kernel for other arguments, both would take the same name for their code
        # and one would lose its entry of the index: a kernel would be loaded for the wrong arguments.
        # A full disk costs the next process its time, and this one nothing.
        with held(Path(self._cache_file._index_path + _LOCK)), contextlib.suppress(OSError):
            super().save_overload(kinds, made)


def _compile_once(kernel: Any, compile: Callable[[Any], Any], signature: Any) -> Any:
    """Numba's `compile`, in one process at a time for the same kernel and arguments.

    The others wait, and find the kernel on disk: without this, 50 runs that start together took the compile time of 50.
    """
    kinds = tuple(sigutils.normalize_signature(signature)[0])
    if _is_found(kernel, kinds):
        return compile(signature)
    with held(_lock_of(kernel, kinds)):
        return compile(signature)  # looks at the disk first


def _key_of(kernel: Any, kinds: Any) -> str:
    return str(kernel._cache._index_key(kinds, kernel.targetctx.codegen()).text)


def _lock_of(kernel: Any, kinds: Any) -> Path:
    """Return the file that a process locks while it compiles a kernel for such arguments."""
    return Path(f"{kernel._cache._cache_file._index_path}.{_key_of(kernel, kinds)}{_LOCK}")


def _is_found(kernel: Any, kinds: Any) -> bool:
    """Whether a kernel is compiled for arguments of these types, in this process or on disk."""
    if kinds in kernel.overloads:
        return True
    if not kernel._cache.was_compiled(kinds, kernel.targetctx.codegen()):
        return False
    file = kernel._cache._cache_file
    name = file._load_index().get(_key_of(kernel, kinds))
    # A kill may come between the entry of the index and the file of the kernel.
    return name is not None and os.path.exists(file._data_path(name))


def kind_of(function: Any, arguments: tuple[Any, ...]) -> str:
    """Return a name for the types that a function is compiled for."""
    return key_of(tuple(map(numba.typeof, arguments)), function.__module__, function.__qualname__).text


def is_found(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether a kernel is compiled for such arguments, in this process or on disk."""
    try:
        # The fingerprints that the dispatcher itself compares; the types of arguments take a hundred times as long.
        known = kernel, tuple(map(compute_fingerprint, arguments))
    except NotImplementedError:
        return _is_found(getattr(kernel, "compiled", kernel), tuple(map(numba.typeof, arguments)))
    if known not in _found and _is_found(getattr(kernel, "compiled", kernel), tuple(map(numba.typeof, arguments))):
        _found.add(known)
    return known in _found


loaded(sys.modules[__name__])

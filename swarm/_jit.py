"""The one place for compiler flags, the kernel cache, and dispatch on the type of a parameter tuple.

Kernels are plain functions of numbers. `kernel` compiles a loop over them, `by_type` makes a family of
functions that is chosen by the type of its first argument: at compile time inside kernels, at run time in
plain Python, from the same definitions.
"""

import functools
import hashlib
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic, overload, register_jitable
from numpy.typing import NDArray

Array = NDArray[np.generic]
F = TypeVar("F", bound=Callable[..., Any])

# Strict IEEE arithmetic: `fastmath` would let the compiler reorder sums, and with them the energy balance.
# The NumPy error model makes 1/0 an infinity; Python's would put a branch before every division, and a
# branch in the lane loop costs its vectorisation.
_FLAGS: dict[str, Any] = {"error_model": "numpy", "nogil": True}
# Kernels call each other, Python never calls their compiled form: no wrappers saves a fifth of the compile time.
_OUTLINE: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, **_FLAGS}
_INLINE: Any = {"forceinline": True, **_OUTLINE}


def _source_hash() -> str:
    """Digest of every source file of the package: it names the cache folder.

    Numba's cache looks at the file of the compiled function only, so after an edit in another file it would
    answer with the old code.
    """
    root = Path(__file__).parent
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
_CONFIG: Any = numba.config


def kernel(function: F) -> F:
    """Compile a module-level function, without the GIL, cached on disk."""
    previous = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = str(_CACHE)
    try:
        compiled: F = numba.njit(cache=True, **_FLAGS)(function)
        return compiled
    finally:
        _CONFIG.CACHE_DIR = previous


def outlined(function: F) -> F:
    """Compile a helper that is rare and long: inlining it would only cost compile time."""
    register_jitable(**_OUTLINE)(function)
    return function


def inlined(function: F) -> F:
    """Compile a helper that is always inlined into the kernel that calls it, so that its loop vectorises."""
    register_jitable(**_INLINE)(function)
    return function


def _python_class(kind: Any) -> Any:
    """The Python class whose values the Numba type `kind` describes."""
    if isinstance(kind, types.BaseNamedTuple):
        return kind.instance_class  # type: ignore[attr-defined]
    if isinstance(kind, types.NoneType):
        return type(None)
    return float if isinstance(kind, types.Float) else object


def by_type(function: Callable[..., Any]) -> Any:
    """A function dispatched on the type of its first argument, in Python and inside kernels alike; always inlined.

    Register a definition with `@name.register(Class)`, where Class is a NamedTuple of numbers, or
    `type(None)` for "the scene has none". Registered functions carry no annotations and the same argument
    names, because Numba compares signatures.
    """
    return _dispatched(function, _INLINE)


def by_type_outlined(function: Callable[..., Any]) -> Any:
    """`by_type` for what is rare and long: inlining it would only cost compile time."""
    return _dispatched(function, _OUTLINE)


def _dispatched(function: Callable[..., Any], options: Any) -> Any:
    generic = functools.singledispatch(function)

    @functools.wraps(function)
    def chosen(*args: Any) -> Any:
        return generic.dispatch(_python_class(args[0]))

    overload(generic, jit_options=options)(chosen)
    return generic


@intrinsic  # type: ignore[call-arg]
def _select(_typing, condition, first, second):
    def emit(_context, builder, _signature, args):
        return builder.select(*args)

    kind = types.unliteral(first)
    return kind(types.boolean, kind, kind), emit


def select(condition: Any, first: Any, second: Any) -> Any:
    """`first if condition else second` without a branch; both are evaluated.

    Python's conditional expression compiles to a branch. LLVM usually turns it back into a select, but with three
    surfaces its jump threading splits the paths first, and the lane loop is no longer vectorised (measured:
    58 ns an impact instead of 17).
    """
    return first if condition else second


@overload(select, jit_options=_INLINE)
def _compiled_select(condition, first, second):
    return lambda condition, first, second: _select(condition, first, second)  # type: ignore[call-arg]


_TAKING = threading.Lock()


def next_of(ticket: Any) -> int:
    """ticket[0], which becomes one more: of several threads no two get the same."""
    with _TAKING:
        ticket[0] += 1
        return int(ticket[0]) - 1


@intrinsic  # type: ignore[call-arg]
def _next_of(_typing, ticket):
    def emit(context, builder, signature, args):
        (kind,) = signature.args
        counter = context.make_array(kind)(context, builder, args[0]).data
        return builder.atomic_rmw("add", counter, context.get_constant(types.int64, 1), "monotonic")

    return types.int64(ticket), emit


@overload(next_of, jit_options=_INLINE)
def _compiled_next_of(ticket):
    return lambda ticket: _next_of(ticket)  # type: ignore[call-arg]


@inlined
def kept(value: Any) -> Any:
    """A value from an array that a select may write back unchanged to its place.

    Of such a select LLVM makes a masked store, which costs AMD processors some ten times an ordinary one (measured: 18
    instead of 12 ns an impact with a contact step). An addition of 0 hides the origin of the value.
    """
    return value + 0.0

"""The one place for the compiler's flags: kernels, and functions of their own in them.

A kernel is a plain function, and whatever it calls is traced into it: functions and methods of records, from the same
definitions that plain Python runs.
"""

import importlib
import importlib.util
from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar

import numpy as np
from numba.np import linalg as blas
from numpy.typing import NDArray

from . import cache
from .compilers import KernelCompiler, LongKernelCompiler, PartCompiler
from .trace import calls
from .trace.helpers import leaving, prepare
from .trace.ways import select as select

Array = NDArray[np.generic]
F = TypeVar("F", bound=Callable[..., Any])

# Strict IEEE arithmetic: `fastmath` would let the compiler reorder sums, and with them the energy balance.
# The NumPy error model makes 1/0 an infinity; Python's would put a branch before every division, and a
# branch in the lane loop costs its vectorisation.
# Without reference counts: each array that a NamedTuple hands on counts as taken and given back, by an atomic
# instruction that two threads do for the same arrays. They were 100 of the 140 ns of a particle that flies freely
# through a frame, and a third of what there is to compile. So kernels make no arrays but `scratch`.
_FLAGS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}
# C calls no kernel.
_KERNEL: Any = {"no_cfunc_wrapper": True, **_FLAGS}
# Only kernels call helpers, and Python never their compiled form: no wrappers saves a fifth of the compile time.
_OUTLINE: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": PartCompiler, **_FLAGS}
_INLINE: Any = {"forceinline": True, **_OUTLINE}
# What of a user's functions cannot be traced.
calls.leave = leaving({**_INLINE, "_nrt": True})


def _find_scipy_only() -> None:
    """Let Numba look whether SciPy is there, as it does before the first kernel, without importing its linear algebra.

    The import is 0.1 of 0.8 s of every start where SciPy is installed, for products of matrices, which no kernel here
    has. One that has them imports it as it always did.
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


def kernel(function: F) -> F:
    """Compile a module-level function, without the GIL, cached on disk."""
    return _kernel(function, KernelCompiler)


def long_kernel(function: F) -> F:
    """`kernel` for what is not flights: many short loops, see `compilers.py`."""
    return _kernel(function, LongKernelCompiler)


def _kernel(function: F, compiler: Any) -> F:
    if cache.is_disabled():
        return function
    # Numba keeps what it knows of a function by its identity: a kernel that is made again has one of its own.
    traced = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    prepare(traced, _INLINE, outlined=False, is_kernel=True)
    compiled: F = cache.cached(function, {**_KERNEL, "pipeline_class": compiler}, cache.calling(traced))
    return compiled


def outlined(function: F) -> F:
    """Keep a helper that is rare and long a function of its own in kernels: to inline it costs compile time."""
    prepare(function, _OUTLINE, outlined=True)
    return function


def inlined(function: F) -> F:
    """A helper that functions may call which Numba compiles because they cannot be traced: see `trace/helpers.py`."""
    prepare(function, _INLINE, outlined=False)
    return function

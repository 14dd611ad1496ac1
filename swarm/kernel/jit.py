"""Kernels and their helpers, as modules declare them; `machine_code.py` makes machine code of them.

A kernel is a plain function, and all functions that it calls are traced into it, and methods of records, from the same
definitions that plain Python runs. Nothing here imports the compiler.
"""

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import cache
from .deferred import compiler, defer

Array = NDArray[np.generic]
F = TypeVar("F", bound=Callable[..., Any])


def select(condition: Any, first: Any, second: Any) -> Any:
    """Return `first if condition else second` without a branch; both are evaluated.

    Python's conditional expression compiles to a branch. LLVM usually turns it back into a select, but with three
    surfaces its jump threading splits the paths first, and the lane loop is no longer vectorised (measured:
    58 ns an impact instead of 17).
    """
    return first if condition else second


def is_known(_value: Any) -> bool:
    """Whether Python knows a number: always in plain Python, which then need not compute what a `select` discards.

    A kernel knows few numbers: `trace/calls.py` answers in its place.
    """
    return True


def is_alike(one: Any, other: Any) -> bool:
    """Whether a `select` may take one of two records for the other, so that the same code serves both.

    Plain Python uses the record with the requested number. In a kernel records are alike if they have the same parts,
    with the same values where Python knows them; `trace/calls.py` answers there.
    """
    return one is other


class Kernel:
    """A function that is compiled when it is first called.

    Args:
        function: the function in plain Python.
        is_long: whether it consists of many short loops, see `compilers.py`.
        is_wide: whether its vectors have 512 bits, on processors where that pays.

    Attributes:
        py_func: the function.
    """

    def __init__(self, function: Any, is_long: bool, is_wide: bool) -> None:
        self.py_func, self.is_long, self.is_wide = function, is_long, is_wide
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return self.compiled(*arguments)

    @functools.cached_property
    def compiled(self) -> Any:
        """Return Numba's dispatcher of the kernel."""
        return compiler().kernel_of(self)

    def __getattr__(self, name: str) -> Any:
        # The attributes of Numba's dispatcher. Python and its tools ask any object for names with underscores.
        if name.startswith("__"):
            raise AttributeError(f"a kernel has no attribute {name}")
        return getattr(self.compiled, name)

    def __reduce__(self) -> str:
        return str(self.py_func.__qualname__)


def kernel(function: F) -> F:
    """Compile a module-level function, without the GIL, cached on disk."""
    made: Any = function if cache.is_disabled() else Kernel(function, is_long=False, is_wide=True)
    return made  # type: ignore[no-any-return]


def long_kernel(function: F) -> F:
    """`kernel` for code other than flights: many short loops, see `compilers.py`."""
    made: Any = function if cache.is_disabled() else Kernel(function, is_long=True, is_wide=False)
    return made  # type: ignore[no-any-return]


def wide_long_kernel(function: F) -> F:
    """`long_kernel` for loops over whole vectors of lanes that take most of the time."""
    made: Any = function if cache.is_disabled() else Kernel(function, is_long=True, is_wide=True)
    return made  # type: ignore[no-any-return]


def outlined(function: F) -> F:
    """Keep a rare and long helper as a function of its own in kernels: inlining it costs compile time."""
    return _prepared(function, is_outlined=True)


def inlined(function: F) -> F:
    """Mark a helper for functions that Numba compiles because they cannot be traced: see `trace/helpers.py`."""
    return _prepared(function, is_outlined=False)


def _prepared(function: F, is_outlined: bool) -> F:
    if not cache.is_disabled():
        defer(lambda machine_code: machine_code.prepare_helper(function, is_outlined))
    return function


def allocating(function: F, body: Any) -> F:
    """Mark a helper of the user's, which may make arrays; kernels call `body` in its place."""
    if not cache.is_disabled():
        function.in_kernels = body  # type: ignore[attr-defined]  # the code that the digest covers
        defer(lambda machine_code: machine_code.prepare_helper(function, body=body))
    return function

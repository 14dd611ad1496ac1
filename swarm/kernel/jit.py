"""Kernels, and functions of their own in them, as modules declare them; `machine_code.py` makes machine code of them.

A kernel is a plain function, and whatever it calls is traced into it: functions and methods of records, from the same
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
    """`first if condition else second` without a branch; both are evaluated.

    Python's conditional expression compiles to a branch. LLVM usually turns it back into a select, but with three
    surfaces its jump threading splits the paths first, and the lane loop is no longer vectorised (measured:
    58 ns an impact instead of 17).
    """
    return first if condition else second


def is_known(_value: Any) -> bool:
    """Whether Python knows a number: always in plain Python, which then need not compute what a `select` discards.

    A kernel knows few: `trace/calls.py` answers in its place.
    """
    return True


def is_alike(one: Any, other: Any) -> bool:
    """Whether a `select` may take one of two records for the other, so that one code serves both.

    Plain Python asks the one that it has the number of. In a kernel they are alike if they have the same parts, and
    Python knows the same of these; `trace/calls.py` answers there.
    """
    return one is other


class Kernel:
    """A function that is compiled when it is first called.

    Args:
        function: what it computes, in plain Python.
        is_long: whether it is many short loops, see `compilers.py`.
        is_wide: whether its vectors are of 512 bits where that pays.

    Attributes:
        py_func: the function.
    """

    def __init__(self, function: Any, is_long: bool, is_wide: bool) -> None:
        self.py_func, self.is_long, self.is_wide = function, is_long, is_wide
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """The result of the compiled function."""
        return self.compiled(*arguments)

    @functools.cached_property
    def compiled(self) -> Any:
        """Numba's dispatcher of it."""
        return compiler().kernel_of(self)

    def __getattr__(self, name: str) -> Any:
        # What Numba's dispatcher has. Python and its tools ask for names with underscores of any object.
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
    """`kernel` for what is not flights: many short loops, see `compilers.py`."""
    made: Any = function if cache.is_disabled() else Kernel(function, is_long=True, is_wide=False)
    return made  # type: ignore[no-any-return]


def wide_long_kernel(function: F) -> F:
    """`long_kernel` where most of the time goes to loops over whole vectors of lanes."""
    made: Any = function if cache.is_disabled() else Kernel(function, is_long=True, is_wide=True)
    return made  # type: ignore[no-any-return]


def outlined(function: F) -> F:
    """Keep a helper that is rare and long a function of its own in kernels: to inline it costs compile time."""
    return _prepared(function, is_outlined=True)


def inlined(function: F) -> F:
    """A helper that functions may call which Numba compiles because they cannot be traced: see `trace/helpers.py`."""
    return _prepared(function, is_outlined=False)


def _prepared(function: F, is_outlined: bool) -> F:
    if not cache.is_disabled():
        defer(lambda machine_code: machine_code.prepare_helper(function, is_outlined))
    return function


def allocating(function: F, body: Any) -> F:
    """A helper of the user's, which may make arrays; kernels call `body` in its place."""
    if not cache.is_disabled():
        function.in_kernels = body  # type: ignore[attr-defined]  # what the digest of its code is of
        defer(lambda machine_code: machine_code.prepare_helper(function, body=body))
    return function

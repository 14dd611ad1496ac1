"""Helpers in kernels against the same in plain Python, bit for bit, and against Numba's own compilation of them."""

import linecache
import math
import types
import warnings
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.extending import overload

from swarm.kernel import jit as _jit
from swarm.kernel import machine_code
from swarm.kernel.trace import helpers

compiled_only = pytest.mark.skipif(
    bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: nothing is compiled that could be compared"
)
FLAGS = {"error_model": "numpy", "no_cfunc_wrapper": True}

FLOATS = (0.0, -0.0, 1.0, -2.5, 3.0, math.inf, -math.inf, math.nan, 5e-324, -2.2e-308, 1.7e308, 0.1)
INTS = (0, 1, -1, 2, -3, 7, 2**31, -(2**53) - 1, 2**63 - 1, -(2**63))


class Inner(NamedTuple):
    """A record in a record."""

    y: float
    flag: bool


class Record(NamedTuple):
    """A record of a float, an int and a record."""

    x: float
    n: int
    inner: Inner


def copied(function):
    """The same function, of which Numba knows nothing yet."""
    made = types.FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    made.__kwdefaults__ = function.__kwdefaults__
    return made


def in_kernel(function, outlined=False):
    """A function as a helper of a compiled function; it must be traced."""
    helper = copied(function)
    (_jit.outlined if outlined else _jit.inlined)(helper)
    compiled = numba.njit(**FLAGS)(machine_code.calling(helper))

    def called(*arguments):
        helpers.left_to_numba.clear()
        result = compiled(*arguments)
        assert helpers.left_to_numba == {}, helpers.left_to_numba
        return result

    return called


def by_numba(function):
    """The same function as Numba compiles it, without a trace."""
    return numba.njit(**FLAGS)(copied(function))


def left_to_numba(function):
    """A function that kernels call, which Numba compiles, without a trace."""
    helper = copied(function)
    overload(helper, strict=False, jit_options=machine_code._INLINE)(lambda *_: function)
    return helper


def in_python(function, *arguments):
    """What plain Python gives, in the arithmetic of kernels."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return function(*map(as_kernels_take_it, arguments))


def as_kernels_take_it(value):
    """NumPy's numbers in the place of Python's: 1/0 is infinite and ints wrap."""
    if isinstance(value, tuple):
        parts = map(as_kernels_take_it, value)
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if type(value) in (float, int):
        return {float: np.float64, int: np.int64}[type(value)](value)
    return copied_array(value) if isinstance(value, np.ndarray) else value


def copied_array(array):
    """A copy with the same distances between its elements."""
    whole = array if array.base is None else array.base
    start = array.ctypes.data - whole.ctypes.data
    return np.ndarray(array.shape, array.dtype, whole.copy(order="K"), start, array.strides)


def bits(value):
    """What tells one result from another: the type of every number, and its bits; all NaNs are one."""
    if isinstance(value, (tuple, list)):
        return [type(value).__name__, *map(bits, value)]
    if isinstance(value, np.ndarray):
        return bits(value.tolist())
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return f"int {int(value)}"
    if isinstance(value, (float, np.floating)):
        return float(value).hex()
    assert value is None
    return value


def assert_the_same(function, *cases, outlined=False, numba_has_it=True):
    """A traced helper against plain Python and against Numba, over cases of arguments."""
    traced = in_kernel(function, outlined)
    numbas = by_numba(function) if numba_has_it else traced
    for case in cases:
        given = [[as_kernels_take_it(one) for one in case] for _ in range(3)]
        got, other = traced(*given[0]), numbas(*given[1])
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            expected = function(*given[2])
        assert bits(got) == bits(expected), (case, got, expected)
        assert bits(got) == bits(other), (case, got, other)
        # What it wrote to arrays
        assert bits(given[0]) == bits(given[1]) == bits(given[2]), case


def defined(text, file, **scope):
    """The functions of a text, whose source is known as that of a file or of a cell of a notebook."""
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    scope = {"np": np, "math": math, "select": _jit.select, "Record": Record, "Inner": Inner, **scope}
    exec(compile(text, file, "exec"), scope)
    return scope

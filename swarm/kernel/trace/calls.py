"""Calls of a helper while it is traced: operations of a kernel, and functions that are traced in their turn."""

import builtins
import functools
import math
import operator
import types as python_types
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher
from numba.extending import lower_builtin, type_callable

from ..entries import is_own
from ..jit import Kernel, is_alike, is_known, select
from .frame import CallFrame, Range
from .notes import taken
from .twins import twin_of
from .values import UNDEFINED, TraceError, Value, has_value, kind_of, name_of, noted
from .ways import are_alike, traced_select, unified

# Functions that are operations of a kernel, see `noted`; with known arguments only they are called themselves.
OPERATIONS: set[Any] = {
    *(getattr(math, name) for name in (
        "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "copysign", "cos", "cosh", "degrees", "erf",
        "erfc", "exp", "expm1", "fabs", "floor", "fmod", "frexp", "gamma", "hypot", "isfinite", "isinf", "isnan",
        "ldexp", "lgamma", "log", "log10", "log1p", "log2", "pow", "radians", "sin", "sinh", "sqrt", "tan", "tanh",
        "trunc",
    )),
    builtins.abs, builtins.bool, builtins.divmod, builtins.float, builtins.int, builtins.pow, builtins.round,
    *(function for function in vars(operator).values() if isinstance(function, python_types.BuiltinFunctionType)),
}  # fmt: skip
# Functions that only a kernel can run.
INTRINSIC: set[Any] = set()


def _cast(value: Any, kind: Any) -> Any:
    number = np.dtype(str(kind)).type
    return noted(number, value) if isinstance(value, Value) else number(value)


def _extreme(function: Any, farther: Any, *values: Any) -> Any:
    """Return the least or the largest of some numbers, by Python's comparisons: NaN does not replace another number."""
    if not has_value(values):
        return function(*values)
    if len(values) == 1 and isinstance(values[0], Value):
        return traced(_extreme_of, (farther, values[0]), {})
    values = values[0] if len(values) == 1 else values
    kind = unified(list(map(kind_of, values)))
    first, *others = (one if kind_of(one) == kind else _cast(one, kind) for one in values)
    for one in others:
        first = traced_select(farther(one, first), one, first)
    return first


def _extreme_of(farther: Any, values: Any) -> Any:
    """Return the reduction of an array which is not empty."""
    found = values[0]
    for k in range(1, values.shape[0]):
        found = select(farther(values[k], found), values[k], found)
    return found


def _is_instance(value: Any, made: Any) -> bool:
    """Whether a value is of a class; a number of a kernel is no record."""
    classes = made if isinstance(made, tuple) else (made,)
    if isinstance(value, Value) and not all(isinstance(one, type) and issubclass(one, _RECORDS) for one in classes):
        raise TraceError("it asks for the class of a number that is known in the kernel only")
    return isinstance(value, made)


_RECORDS = (tuple, type(None))
# The functions that are called in place of others while tracing.
REPLACED: dict[Any, Callable[..., Any]] = {
    isinstance: _is_instance,
    is_alike: are_alike,
    is_known: lambda value: not isinstance(value, Value),
    range: Range,
    select: traced_select,
    len: lambda values: values.shape[0] if isinstance(values, Value) else len(values),
    max: functools.partial(_extreme, max, operator.gt),
    min: functools.partial(_extreme, min, operator.lt),
}
# NumPy's `np.array`, `np.sum` and others that are not ufuncs.
_ARRAY_FUNCTION = type(np.sum)
_IN_PLACE = (list, dict, set)


def operation(function: Any, typed: Callable[..., Any], *kinds: Any) -> Any:
    """Decorate the instructions of a function for arguments of such types; `typed` gives the type of its result."""
    OPERATIONS.add(function)
    type_callable(function)(lambda _context: typed)
    return lower_builtin(function, *kinds)


def called(function: Any, /, *given: Any, **named: Any) -> Any:
    """Make a call while a helper is traced."""
    if isinstance(function, Kernel):
        function = function.py_func
    if isinstance(function, python_types.MethodType):
        # Before the lookup: a method of a record may be outlined.
        function, given = function.__func__, (function.__self__, *given)
    try:
        replaced, is_operation = REPLACED.get(function), function in OPERATIONS
    except TypeError:  # not hashable: a method of a proxy
        return function(*given, **named)
    if replaced is not None:
        return replaced(*given, **named)
    if function in INTRINSIC:
        return noted(function, *given)
    if is_operation or _is_operation(function):
        return _operation(function, given, named)
    if any(one is UNDEFINED for one in given):
        bool(UNDEFINED)
    if isinstance(function, python_types.FunctionType):
        return traced(function, given, named) if is_own(function) else _foreign(function, given, named)
    is_python = getattr(function, "__module__", None) == "builtins"
    if function in _IN_PLACE or (is_python and any(isinstance(one, Value) for one in given)):
        raise TraceError(f"it asks {name_of(function)} about a number that is known in the kernel only")
    return function(*given, **named)


def _refused(function: Any, error: Exception) -> None:
    raise error


# Let Numba compile a function in place of a trace; the bridge to Numba sets this function, see `helpers.py`.
leave: Callable[[Any, Exception], None] = _refused


def _foreign(function: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """Call a function of the user's, which may have operations that cannot be traced."""
    now = taken()
    mark = len(now)
    try:
        return traced(function, given, named)
    except Exception as error:  # Python's errors if a proxy is not the type that a function expects
        if named:
            raise
        del now[mark:]
        leave(function, error)
        return noted(function, *given)


def _is_operation(function: Any) -> bool:
    if isinstance(function, (np.ufunc, _ARRAY_FUNCTION, Dispatcher)) or function is np.array:
        return True
    return isinstance(function, type) and issubclass(function, np.generic)


def _operation(function: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    if not has_value(given):
        return function(*given, **named)
    if named:
        raise TraceError(f"{name_of(function)} is called by the names of its arguments")
    if function is int:
        return given[0] if isinstance(given[0].kind, types.Integer) else noted(np.int64, *given)
    return noted(function, *given)


def traced(function: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """Return the result of a Python function, with its operations noted."""
    frame = CallFrame(called)
    twin_of(function, frame)(*given, **named)
    return frame.result()

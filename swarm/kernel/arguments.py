"""Read the arguments of a kernel directly from the memory of Python's objects.

Numba asks Python for each number in a tuple and checks for an error after each: two thirds of the instructions of a
short kernel, which are compiled like any others. The types of all arguments are known when the kernel is chosen, so a
float is read from its object, and the address, shape and strides of an array from NumPy's object. This saves a sixth
of the time to compile two walls with friction, or balls in a box.
"""

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.callwrapper import PyCallWrapper
from numba.core.pythonapi import NativeValue
from numba.np.numpy_support import as_dtype

# Where objects have these data, in words: floats and arrays behind the head of any object, tuples at their end.
_WORD = np.dtype(np.intp).itemsize
_HEAD, _ITEMS = object.__basicsize__ // _WORD, tuple.__basicsize__ // _WORD
_DATA, _SHAPE, _STRIDES = _HEAD, _HEAD + 2, _HEAD + 3
# Passing this many numbers takes LLVM a fifth of the first call of balls in a union of three parts.
_MANY = 400
_THING, _INDEX = ir.IntType(8).as_pointer(), ir.IntType(8 * _WORD)


class _Parts(NamedTuple):
    """A tuple or the fields of an array, each part of which is an argument of the kernel."""

    parts: tuple[Any, ...]


class CallWrapper(PyCallWrapper):  # type: ignore[misc]
    """The function of a kernel that Python calls."""

    def build_wrapper(self, api: Any, builder: Any, *given: Any) -> None:
        """Emit Numba's instructions, except for the arguments that can be read."""
        take, unbox = builder.extract_value, api.to_native_value

        def part(of: Any, place: Any, **named: Any) -> Any:
            if not isinstance(of, _Parts):
                return take(of, place, **named)
            (k,) = place if isinstance(place, list) else [place]
            return of.parts[k]

        def read(kind: Any, thing: Any) -> Any:
            if isinstance(kind, types.BaseTuple):
                kinds: Any = kind.types  # type: ignore[attr-defined]
                made = [read(one, _loaded(builder, thing, _ITEMS + k)) for k, one in enumerate(kinds)]
                return NativeValue(_Parts(tuple(one.value for one in made)))
            if kind == types.float64:
                return NativeValue(_loaded(builder, thing, _HEAD, ir.DoubleType()))
            if kind == types.int64:
                return NativeValue(api.long_as_longlong(thing))
            if isinstance(kind, types.Array):
                return NativeValue(self._array(builder, kind, thing))
            return unbox(kind, thing)

        api.to_native_value, builder.extract_value = read, part
        super().build_wrapper(api, builder, *given)

    def _array(self, builder: Any, kind: Any, thing: Any) -> _Parts:
        shape, strides = (
            [_loaded(builder, _loaded(builder, thing, place), k, _INDEX) for k in range(kind.ndim)]
            for place in (_SHAPE, _STRIDES)
        )
        number = _INDEX(1)
        for one in shape:
            number = builder.mul(number, one)
        data = _loaded(builder, thing, _DATA, self.context.get_data_type(kind.dtype).as_pointer())
        item = _INDEX(as_dtype(kind.dtype).itemsize)
        return _Parts((_THING(None), thing, number, item, data, _Parts(tuple(shape)), _Parts(tuple(strides))))


def _loaded(builder: Any, thing: Any, place: int, kind: Any = _THING) -> Any:
    return builder.load(builder.gep(builder.bitcast(thing, kind.as_pointer()), [_INDEX(place)]))


def wrap(context: Any, library: Any, described: Any, environment: Any, call_helper: Any, release_gil: bool) -> None:
    """Add to a library the function that Python calls: `create_cpython_wrapper` of a target of Numba."""
    module = context.create_module("wrapper")
    kind = context.call_conv.get_function_type(described.restype, described.argtypes)
    function = ir.Function(module, kind, described.llvm_func_name)
    CallWrapper(context, module, function, described, environment, call_helper, release_gil).build()
    library.add_ir_module(module)
    if library.is_in_wrapper or len(function.args) > _MANY:
        library.get_function(function.name).linkage = "internal"

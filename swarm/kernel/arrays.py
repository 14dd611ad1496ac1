"""Operations of kernels beyond Python, on arrays and their elements: arrays of their own, rows, indices, tickets.

Each is an operation of the compiler with the same definition in plain Python.
"""

import functools
import math
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from llvmlite.ir import Constant
from llvmlite.ir.instructions import InsertValue
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.np.arrayobj import populate_array
from numpy.typing import NDArray

from .trace.calls import INTRINSIC, operation


def spaced(stride: int) -> Callable[[Any], Any]:
    """A function that tells the compiler how far apart rows of the 2-D arrays in a NamedTuple are: `stride` numbers.

    It gives the tuple back. Where distances are known at run time only, a lane loop computes addresses, and before it
    checks every row against every other for an overlap: 5.9 instead of 5.4 ns an impact in a sphere, 13.7 instead of
    6.5 ns with a contact step.
    """

    def known(tables: Any) -> Any:
        return tables

    @operation(known, lambda tables: tables, types.BaseNamedTuple)
    def _emit_tables(context, builder, signature, args):
        (tables,) = args
        columns, item = (context.get_constant(types.intp, k) for k in (stride, np.dtype(float).itemsize))
        for k, kind in enumerate(signature.args[0]):
            if isinstance(kind, types.Array) and kind.ndim == 2:
                table = context.make_array(kind)(context, builder, builder.extract_value(tables, k))
                table.shape = cgutils.pack_array(builder, [builder.extract_value(table.shape, 0), columns])
                table.strides = cgutils.pack_array(builder, [builder.mul(columns, item), item])
                tables = builder.insert_value(tables, table._getvalue(), k)
        return impl_ret_borrowed(context, builder, signature.return_type, tables)

    return known


def scratch(shape: Any, dtype: Any) -> Any:
    """An array of zeros for the function of a kernel that asks for it: it is gone when that returns.

    What is asked for in a loop has a shape that is known before the kernel runs, or is in an outlined helper.
    On the stack: kernels count no references, so they cannot make arrays that would have to be freed. With arrays of
    Numba's, and references counted, an impact in a sphere costs 67 instead of 5.4 ns, and kernels a quarter more to
    compile.
    """
    return np.zeros(shape, dtype)


def unwritten(shape: Any, dtype: Any) -> Any:
    """`scratch` that holds anything, for what is written first: zeros in 20 rows of lanes cost a lane 1 ns a pass."""
    return np.zeros(shape, dtype)


def _type_of_scratch(shape, dtype):
    return types.Array(dtype.dtype, len(shape) if isinstance(shape, types.BaseTuple) else 1, "C")


def _part(builder: Any, made: Any, k: int) -> Any:
    """A part of a tuple, as the constant that it was made of where it is one."""
    while isinstance(made, InsertValue):
        if made.indices == [k]:
            return made.value
        made = made.aggregate
    return builder.extract_value(made, k)


def _on_stack(zeros: bool, context: Any, builder: Any, signature: Any, args: Any) -> Any:
    kind, asked = signature.return_type, signature.args[0]
    shape = [_part(builder, args[0], k) for k in range(len(asked))] if isinstance(asked, types.BaseTuple) else [args[0]]
    number = context.get_data_type(kind.dtype)
    item = context.get_constant(types.intp, context.get_abi_sizeof(number))
    if all(isinstance(one, Constant) for one in shape):
        # Where a function begins: what a loop asks for in each of its rounds is the same.
        size = context.get_constant(types.intp, math.prod(one.constant for one in shape))
        with builder.goto_entry_block():
            data = builder.alloca(number, size)
    else:
        size = functools.reduce(builder.mul, shape)
        data = builder.alloca(number, size)
    if zeros:
        cgutils.memset(builder, data, builder.mul(size, item), 0)
    strides = [item]
    for columns in reversed(shape[1:]):
        strides.insert(0, builder.mul(columns, strides[0]))
    table = context.make_array(kind)(context, builder)
    populate_array(table, data=data, shape=shape, strides=strides, itemsize=item, meminfo=None)
    return table._getvalue()


INTRINSIC.update((scratch, unwritten))
operation(scratch, _type_of_scratch, types.Any, types.Any)(functools.partial(_on_stack, True))
operation(unwritten, _type_of_scratch, types.Any, types.Any)(functools.partial(_on_stack, False))


def copy_row(target: Any, i: Any, source: Any, m: Any, count: Any) -> None:
    """target[i, :count] = source[m, :count], of tables in C order.

    In a loop over lanes one by one, each a load and a store or two: of assignments of numbers LLVM makes gathers, which
    take AMD processors some 20 cycles each.
    """
    target[int(i), :count] = source[int(m), :count]


@operation(
    copy_row, lambda target, i, source, m, count: types.none, types.Array, types.Any, types.Array, types.Any, types.Any
)
def _emit_copy_row(context, builder, signature, args):
    places = []
    for k in (0, 2):
        table = context.make_array(signature.args[k])(context, builder, args[k])
        row = context.cast(builder, args[k + 1], signature.args[k + 1], types.intp)
        columns = builder.extract_value(table.shape, 1)
        places.append(builder.gep(table.data, [builder.mul(row, columns)]))
    count = context.cast(builder, args[4], signature.args[4], types.intp)
    cgutils.raw_memcpy(builder, places[0], places[1], count, 8)
    return context.get_dummy_value()


_TAKING = threading.Lock()


def next_of(ticket: Any) -> int:
    """ticket[0], which becomes one more: of several threads no two get the same."""
    with _TAKING:
        ticket[0] += 1
        return int(ticket[0]) - 1


@operation(next_of, lambda ticket: types.int64, types.Array)
def _emit_next(context, builder, signature, args):
    counter = context.make_array(signature.args[0])(context, builder, args[0]).data
    return builder.atomic_rmw("add", counter, context.get_constant(types.int64, 1), "monotonic")


def fetch(row: Any, i: Any) -> None:
    """Ask for the line of the cache that holds row[i], which is needed soon; the index may be of any place."""


@operation(fetch, lambda row, i: types.none, types.Array, types.Any)
def _emit_fetch(context, builder, signature, args):
    data = context.make_array(signature.args[0])(context, builder, args[0]).data
    place = builder.gep(data, [context.cast(builder, args[1], signature.args[1], types.intp)])
    place = builder.bitcast(place, cgutils.voidptr_t)
    number, pointer = ir.IntType(32), cgutils.voidptr_t
    kind = ir.FunctionType(ir.VoidType(), [pointer, number, number, number])
    ask = builder.module.declare_intrinsic("llvm.prefetch", [pointer], kind)
    # To read, of use for long, data
    builder.call(ask, [place, number(0), number(3), number(1)])
    return context.get_dummy_value()


def aligned_copy(values: NDArray[Any]) -> NDArray[Any]:
    """A copy that begins with a line of the cache."""
    made = aligned(-(-values.nbytes // 8)).view(values.dtype)[: values.size].reshape(values.shape)
    made[...] = values
    return made


def aligned(size: int) -> NDArray[np.float64]:
    """An array of zeros that begins with a line of the cache."""
    # Of zeros NumPy asks the system for no large pages.
    made = np.empty(size + 8)
    made.fill(0.0)
    first = -(made.ctypes.data // 8) % 8
    return made[first : first + size]


def index(value: Any) -> Any:
    """A number from an array as an index, which is not negative.

    Of a signed one a kernel asks at each use whether it counts from the end: half of the instructions of a lane that is
    given back, a third of one that is loaded. A function that is given both kinds is compiled twice.
    A loop over lanes runs up to one: of a signed one LLVM does not always see that it is never negative, and vectorises
    nothing that may count from the end (in a box that is carried along 29 instead of 9.5 ns an impact).
    """
    return value


@operation(index, lambda value: types.uintp, types.Any)
def _emit_index(context, builder, signature, args):
    return context.cast(builder, *args, *signature.args, signature.return_type)


def kept(value):
    """A value from an array that a select may write back unchanged to its place.

    Of such a select LLVM makes a masked store, which costs AMD processors some ten times an ordinary one (measured: 18
    instead of 12 ns an impact with a contact step). An addition of 0 hides the origin of the value.
    """
    if isinstance(value, tuple):
        return type(value)(*tuple(kept(one) for one in value))
    return value + 0.0

"""Instructions of the operations that `arrays.py`, `fours.py`, `lines.py` and `vector.py` define in Python."""

import functools
import math
import operator
from typing import Any

from llvmlite import ir
from llvmlite.ir import Constant
from llvmlite.ir.instructions import InsertValue
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.np.arrayobj import populate_array

from .arrays import copy_row, fetch, index, next_of, scratch, unwritten
from .fours import Four, over_block
from .lines import COLUMNS, FOUR, LANES, add_from_lanes, into_lanes
from .trace.calls import INTRINSIC, operation
from .vector import Vec

# --- Arrays ----------------------------------------------------------------------------------------------


def emit_spaced(known: Any, stride: int) -> None:
    """Emit the instructions of a function that `spaced` returned."""

    @operation(known, lambda tables: tables, types.BaseNamedTuple)
    def _emit_tables(context, builder, signature, args):
        (tables,) = args
        columns = context.get_constant(types.intp, stride)
        for k, kind in enumerate(signature.args[0]):
            if isinstance(kind, types.Array) and kind.ndim == 2:
                item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
                table = context.make_array(kind)(context, builder, builder.extract_value(tables, k))
                table.shape = cgutils.pack_array(builder, [builder.extract_value(table.shape, 0), columns])
                table.strides = cgutils.pack_array(builder, [builder.mul(columns, item), item])
                tables = builder.insert_value(tables, table._getvalue(), k)
        return impl_ret_borrowed(context, builder, signature.return_type, tables)


def _type_of_scratch(shape, dtype):
    return types.Array(dtype.dtype, len(shape) if isinstance(shape, types.BaseTuple) else 1, "C")


def _part(builder: Any, made: Any, k: int) -> Any:
    """Return a part of a tuple, as the constant that it was made of if it is one."""
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
        # At the beginning of the function: all rounds of a loop use the same array.
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


@operation(next_of, lambda ticket: types.int64, types.Array)
def _emit_next(context, builder, signature, args):
    counter = context.make_array(signature.args[0])(context, builder, args[0]).data
    return builder.atomic_rmw("add", counter, context.get_constant(types.int64, 1), "monotonic")


@operation(fetch, lambda row, i: types.none, types.Array, types.Any)
def _emit_fetch(context, builder, signature, args):
    data = context.make_array(signature.args[0])(context, builder, args[0]).data
    place = builder.gep(data, [context.cast(builder, args[1], signature.args[1], types.intp)])
    place = builder.bitcast(place, cgutils.voidptr_t)
    number, pointer = ir.IntType(32), cgutils.voidptr_t
    kind = ir.FunctionType(ir.VoidType(), [pointer, number, number, number])
    ask = builder.module.declare_intrinsic("llvm.prefetch", [pointer], kind)
    # For reading, of long use, data
    builder.call(ask, [place, number(0), number(3), number(1)])
    return context.get_dummy_value()


@operation(index, lambda value: types.uintp, types.Any)
def _emit_index(context, builder, signature, args):
    return context.cast(builder, *args, *signature.args, signature.return_type)


# --- Sums -------------------------------------------------------------------------------------------------


def _type_of_sums(table, place, x, y):
    return types.NamedUniTuple(types.float64, 4, Four)


@operation(over_block, _type_of_sums, types.Array, *3 * (types.BaseNamedTuple,))
def _emit_sums(context, builder, signature, args):
    kind = signature.args[0]
    table, four = context.make_array(kind)(context, builder, args[0]), ir.VectorType(ir.DoubleType(), 4)
    first = [builder.extract_value(args[1], axis) for axis in range(3)]

    def weighted(weights, rows):
        products = []
        for n, row in enumerate(rows):
            weight = builder.insert_element(
                ir.Constant(four, ir.Undefined), builder.extract_value(weights, n), _lane(0)
            )
            zeros = ir.Constant(ir.VectorType(ir.IntType(32), 4), [0] * 4)
            products.append(builder.fmul(builder.shuffle_vector(weight, weight, zeros), row))
        return builder.fadd(builder.fadd(*products[:2]), builder.fadd(*products[2:]))

    def row(a, b):
        place = [builder.add(at, at.type(n)) for at, n in zip(first, (a, b, 0), strict=True)]
        pointer = cgutils.get_item_pointer(context, builder, kind, table, place, wraparound=False)
        return builder.load(builder.bitcast(pointer, four.as_pointer()), align=8)

    sums = weighted(args[2], [weighted(args[3], [row(a, b) for b in range(4)]) for a in range(4)])
    parts = [builder.extract_element(sums, _lane(n)) for n in range(4)]
    return context.make_tuple(builder, signature.return_type, parts)


def _lane(n):
    return ir.Constant(ir.IntType(32), n)


# --- Operators of vectors ---------------------------------------------------------------------------------


def _is_vector(kind: Any) -> bool:
    return isinstance(kind, types.BaseNamedTuple) and issubclass(kind.instance_class, Vec)  # type: ignore[attr-defined]


_KIND = types.NamedUniTuple(types.float64, 3, Vec)


def _emitted(symbol: Any, instruction: str, first: Any, second: Any) -> None:
    """Let kernels apply this operator component by component, without a function of its own for the compiler.

    Overloads of the operators cost up to a tenth of the compile time.
    """
    vectors = [kind is types.BaseNamedTuple for kind in (first, second)]

    def typed(a, b):
        good = (_is_vector(k) if v else isinstance(k, types.Float) for k, v in zip((a, b), vectors, strict=True))
        return _KIND if all(good) else None

    @operation(symbol, typed, first, second)
    def _emit(context, builder, signature, args):
        one, two = (
            [builder.extract_value(arg, k) for k in range(3)] if v else 3 * [arg]
            for arg, v in zip(args, vectors, strict=True)
        )
        parts = [getattr(builder, instruction)(*pair) for pair in zip(one, two, strict=True)]
        return context.make_tuple(builder, signature.return_type, parts)


_emitted(operator.add, "fadd", types.BaseNamedTuple, types.BaseNamedTuple)
_emitted(operator.sub, "fsub", types.BaseNamedTuple, types.BaseNamedTuple)
_emitted(operator.mul, "fmul", types.BaseNamedTuple, types.Float)
_emitted(operator.mul, "fmul", types.Float, types.BaseNamedTuple)
_emitted(operator.truediv, "fdiv", types.BaseNamedTuple, types.Float)


# --- Lines of eight numbers ------------------------------------------------------------------------------

_NUMBER, _PLACE, _WHOLE = ir.DoubleType(), ir.IntType(32), ir.IntType(64)
_FOUR, _EIGHT = ir.VectorType(_NUMBER, FOUR), ir.VectorType(_NUMBER, LANES)


def _shuffled(builder, pair, places):
    mask = ir.Constant(ir.VectorType(_PLACE, len(places)), list(places))
    return builder.shuffle_vector(*pair, mask)


def _pointer(context, builder, kind, table, row, column, columns, to):
    """Return the pointer of the numbers from (row, column) on, in a table of `columns` columns; both are indices."""
    data = context.make_array(kind)(context, builder, table).data
    place = builder.add(builder.mul(row, row.type(columns)), column)
    return builder.bitcast(builder.gep(data, [place]), to.as_pointer())


def _pointers(context, builder, kinds, given):
    """Return the pointers of the tile, of the table, and of the rows for its lanes, from arrays and places in them."""
    tile, q, table, column, ends, e = given
    none = q.type(0)
    return [
        _pointer(context, builder, kinds[0], tile, q, none, LANES, _NUMBER),
        _pointer(context, builder, kinds[1], table, none, column, COLUMNS, _NUMBER),
        _pointer(context, builder, kinds[2], ends, e, none, LANES, _PLACE),
    ]


def _indices(context, builder, signature, args, places):
    return [context.cast(builder, args[k], signature.args[k], types.intp) for k in places]


def _function(module, name, arguments, body):
    """Return a function for all calls in a kernel: written out in each of them the kernel takes a third longer."""
    if name not in module.globals:
        made = ir.Function(module, ir.FunctionType(ir.VoidType(), arguments), name)
        made.linkage = "internal"
        made.attributes.add("noinline")
        builder = ir.IRBuilder(made.append_basic_block())
        body(builder, *made.args)
        builder.ret_void()
    return module.globals[name]


def _row(builder, table, ends, lane, to):
    """Return the pointer of a row of the table for a lane, which is a number of 64 bits."""
    row = builder.zext(builder.load(builder.gep(ends, [lane])), _WHOLE)
    return builder.bitcast(builder.gep(table, [builder.mul(row, _WHOLE(COLUMNS))]), to.as_pointer())


def _column(builder, tile, c):
    """Return the pointer of a column of all lanes."""
    return builder.bitcast(builder.gep(tile, [_WHOLE(c * LANES)]), _EIGHT.as_pointer())


# --- Into lanes ------------------------------------------------------------------------------------------


@operation(
    into_lanes, lambda tile, q, table, column, ends, e: types.none,
    types.Array, types.Any, types.Array, types.Any, types.Array, types.Any,
)  # fmt: skip
def _emit_into_lanes(context, builder, signature, args):
    q, column, e = _indices(context, builder, signature, args, (1, 3, 5))
    pointers = _pointers(context, builder, signature.args[::2], (args[0], q, args[2], column, args[4], e))
    called = _function(builder.module, ".into_lanes", [one.type for one in pointers], _into_lanes)
    builder.call(called, pointers)
    return context.get_dummy_value()


def _into_lanes(builder, tile, table, ends):
    lines = [builder.load(_row(builder, table, ends, _WHOLE(lane), _FOUR), align=8) for lane in range(LANES)]
    # Each instruction joins the numbers of two lanes, and works on halves of a quarter of a vector.
    halves = [_shuffled(builder, (lines[k], lines[k + 2]), range(8)) for k in (0, 1, 4, 5)]
    low = [_shuffled(builder, halves[k : k + 2], (0, 8, 2, 10, 4, 12, 6, 14)) for k in (0, 2)]
    high = [_shuffled(builder, halves[k : k + 2], (1, 9, 3, 11, 5, 13, 7, 15)) for k in (0, 2)]
    for c, pair in enumerate((low, high, low, high)):
        first = 2 * (c // 2)
        places = [base + first + k for base in (0, 4, 8, 12) for k in (0, 1)]
        builder.store(_shuffled(builder, pair, places), _column(builder, tile, c), align=8)


# --- From lanes ------------------------------------------------------------------------------------------


def _of_lanes(builder, tile, end):
    """Return the four numbers of an end, for each lane."""
    columns = [builder.load(_column(builder, tile, end * FOUR + c), align=8) for c in range(FOUR)]
    low = [_shuffled(builder, columns[k : k + 2], (0, 8, 2, 10, 4, 12, 6, 14)) for k in (0, 2)]
    high = [_shuffled(builder, columns[k : k + 2], (1, 9, 3, 11, 5, 13, 7, 15)) for k in (0, 2)]
    firsts = [2 * (lane // 2) for lane in range(LANES)]
    return [
        _shuffled(builder, high if lane % 2 else low, (first, first + 1, first + LANES, first + LANES + 1))
        for lane, first in enumerate(firsts)
    ]


def _from_lanes(of_one, count, builder, tile, table, ends, lanes):
    """Call `of_one` with the place of each end in the table and its numbers; each lane has `count` ends."""
    every = _WHOLE(2**LANES - 1)
    with builder.if_else(builder.icmp_unsigned("==", builder.and_(lanes, every), every)) as (all_lanes, some_lanes):
        with all_lanes:
            changes = [_of_lanes(builder, tile, end) for end in range(count)]
            for lane in range(LANES):
                for end in range(count):
                    of_one(builder, _row(builder, table, ends, _WHOLE(end * LANES + lane), _FOUR), changes[end][lane])
        with some_lanes, cgutils.for_range(builder, _WHOLE(LANES)) as loop:
            bit = builder.and_(builder.lshr(lanes, loop.index), _WHOLE(1))
            with builder.if_then(builder.icmp_unsigned("==", bit, _WHOLE(1))):
                for end in range(count):
                    lane = builder.add(loop.index, _WHOLE(end * LANES))
                    row = _row(builder, table, ends, lane, _NUMBER)
                    for c in range(FOUR):
                        one = builder.gep(tile, [builder.add(loop.index, _WHOLE((end * FOUR + c) * LANES))])
                        of_one(builder, builder.gep(row, [_WHOLE(c)]), builder.load(one))


def _add(builder, place, change):
    builder.store(builder.fadd(builder.load(place, align=8), change), place, align=8)


def _put(builder, place, numbers):
    builder.store(numbers, place, align=8)


def _emit_from_lanes(name, of_one, count, context, builder, signature, args):
    column, e, q, lanes = _indices(context, builder, signature, args, (1, 3, 5, 6))
    kinds = [signature.args[k] for k in (4, 0, 2)]
    pointers = _pointers(context, builder, kinds, (args[4], q, args[0], column, args[2], e))
    body = functools.partial(_from_lanes, of_one, count)
    called = _function(builder.module, name, [*(one.type for one in pointers), _WHOLE], body)
    builder.call(called, [*pointers, lanes])
    return context.get_dummy_value()


for _operation, _of_one, _count in ((add_from_lanes, _add, 2),):
    operation(
        _operation, lambda table, column, ends, e, tile, q, lanes: types.none,
        types.Array, types.Any, types.Array, types.Any, types.Array, types.Any, types.Any,
    )(functools.partial(_emit_from_lanes, f".{_operation.__name__}", _of_one, _count))  # fmt: skip

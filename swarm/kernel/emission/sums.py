"""Instructions of the sums of `kernel/fours.py`."""

from llvmlite import ir
from numba import types
from numba.core import cgutils

from ..fours import Four, over_block
from ..trace.calls import operation


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

"""Sums over blocks of 4 x 4 x 4 numbers of a table, four at a time: the vector instructions that LLVM does not find.

It makes vectors of loops, not of what is written out, and a loop over four it writes out first.
"""

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils

from .trace.calls import operation


class Four(NamedTuple):
    """Four numbers that go with four others, such as weights."""

    a: Any
    b: Any
    c: Any
    d: Any


def sum_of(w, c):
    """The sum of the products."""
    return (w.a * c.a + w.b * c.b) + (w.c * c.c + w.d * c.d)


def over_block(table: Any, place: Any, x: Any, y: Any) -> Four:
    """Along the third axis, the sums with the weights x and y over the first two, of the block that begins at a place.

    The place is a NamedTuple that begins with three indices; in plain Python these may be arrays.
    """
    i, j, k = place[0], place[1], place[2]
    if np.ndim(i) == 0:
        block = table[i : i + 4, j : j + 4, k : k + 4]
    else:
        a, b, c = np.indices((4, 4, 4)).reshape(3, 4, 4, 4, *[1] * np.ndim(i))
        block = table[i + a, j + b, k + c]
    return Four(*_weighted(x, _weighted(y, block.swapaxes(0, 1))))


def _weighted(w: Any, parts: Any) -> Any:
    return (w.a * parts[0] + w.b * parts[1]) + (w.c * parts[2] + w.d * parts[3])


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

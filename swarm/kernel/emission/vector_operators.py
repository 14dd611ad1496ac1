"""Instructions of the operators of vectors."""

import operator
from typing import Any

from numba import types

from ..trace.calls import operation
from ..vector import Vec


def _is_vector(kind: Any) -> bool:
    return isinstance(kind, types.BaseNamedTuple) and issubclass(kind.instance_class, Vec)  # type: ignore[attr-defined]


_KIND = types.NamedUniTuple(types.float64, 3, Vec)


def _emitted(symbol: Any, instruction: str, first: Any, second: Any) -> None:
    """Let kernels do this operator component by component: no function of its own for the compiler.

    As overloads of the operators they cost up to a tenth of the time to compile.
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

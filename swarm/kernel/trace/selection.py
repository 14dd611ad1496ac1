"""Values that are chosen without a branch."""

from typing import Any

from numba import types
from numba.extending import lower_builtin, type_callable

from .values import has_value, made_of, noted


def select(condition: Any, first: Any, second: Any) -> Any:
    """`first if condition else second` without a branch; both are evaluated.

    Python's conditional expression compiles to a branch. LLVM usually turns it back into a select, but with three
    surfaces its jump threading splits the paths first, and the lane loop is no longer vectorised (measured:
    58 ns an impact instead of 17).
    """
    return first if condition else second


def traced_select(condition: Any, first: Any, second: Any) -> Any:
    """`select` in a trace: of records part by part."""
    if not has_value((condition, first, second)):
        return first if condition else second
    if isinstance(first, tuple):
        return made_of(first, [traced_select(condition, a, b) for a, b in zip(first, second, strict=True)])
    return first if first is second or first is None else noted(select, condition, first, second)


@type_callable(select)
def _type_of_select(_context):
    return lambda condition, first, second: types.unliteral(first)


@lower_builtin(select, types.Boolean, types.Any, types.Any)
def _emit_select(context, builder, signature, args):
    kinds, kind = signature.args[1:], signature.return_type
    return builder.select(args[0], *(context.cast(builder, *pair, kind) for pair in zip(args[1:], kinds, strict=True)))

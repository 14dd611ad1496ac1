"""One value from several: for a variable where the ways through a helper meet, and for `select`, without a branch."""

import math
from collections.abc import Iterable
from typing import Any

from numba import types
from numba.extending import lower_builtin, type_callable

from ..jit import select
from .notes import Assign, Load, Slot, add, context
from .values import UNDEFINED, TraceError, Value, has_value, is_number, kind_of, made_of, noted, opened


def _is_same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if isinstance(a, Value) or isinstance(b, Value):
        return isinstance(a, Value) and isinstance(b, Value) and a.note is b.note and a.path == b.path
    if type(a) is not type(b):
        return False
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(_is_same, a, b))
    if isinstance(a, float):
        return a == b and math.copysign(1.0, a) == math.copysign(1.0, b)
    try:
        return bool(a == b)
    except (ValueError, TypeError):
        return False


def all_of(answers: Iterable[bool]) -> bool:
    """Whether all are true; all of them are evaluated."""
    return all(list(answers))


def unified(kinds: list[Any]) -> Any:
    """Return the type that holds values of all these types."""
    kind = kinds[0] if all(k == kinds[0] for k in kinds) else context().unify_types(*kinds)
    if kind is None or isinstance(kind, types.Optional):
        raise TraceError(f"a variable is {' or '.join(map(str, kinds))}")
    return types.unliteral(kind)


def merged(ways: list[tuple[Assign, Any]]) -> Any:
    """Return one value for several, each known on its way."""
    first = ways[0][1]
    if all(_is_same(value, first) for _, value in ways):
        return first
    values = [value for _, value in ways]
    if all(isinstance(value, tuple) and type(value) is type(first) and len(value) == len(first) for value in values):
        columns = [[(assign, value[k]) for assign, value in ways] for k in range(len(first))]
        return made_of(first, map(merged, columns))
    if not all(map(is_number, values)):
        return UNDEFINED
    slot = Slot(unified(list(map(kind_of, values))))
    for assign, value in ways:
        assign.pairs.append((slot, value))
    return opened(slot.kind, add(Load(slot)))


def carried(value: Any, entry: Assign, slots: Any, wider: Any, path: tuple[int, ...]) -> Any:
    """Return the variables of a loop at the start of a round, with every number in a slot."""
    if isinstance(value, tuple):
        return made_of(value, [carried(one, entry, slots, wider, (*path, k)) for k, one in enumerate(value)])
    if not is_number(value):
        return value
    slots[path] = slot = Slot(wider.get(path) or kind_of(value))
    entry.pairs.append((slot, value))
    return opened(slot.kind, add(Load(slot)))


def goes_round(before: Any, slots: Any, wider: Any, assign: Assign, value: Any, path: tuple[int, ...]) -> bool:
    """Put the variables at the end of a round into their slots; return whether the types of the slots hold them."""
    if before is UNDEFINED:
        return True  # a round does not use the value that an earlier one has left
    if isinstance(before, tuple) and type(value) is type(before) and len(value) == len(before):
        pairs = enumerate(zip(before, value, strict=True))
        return all_of(goes_round(old, slots, wider, assign, new, (*path, k)) for k, (old, new) in pairs)
    slot = slots.get(path)
    if slot is None and _is_same(before, value):
        return True
    if slot is None or not is_number(value):
        raise TraceError("a variable of a loop has another type in the first round than later")
    assign.pairs.append((slot, value))
    kind = unified([slot.kind, kind_of(value)])
    if kind == slot.kind:
        return True
    wider[path] = kind
    return False


# --- Without a branch ------------------------------------------------------------------------------------


def traced_select(condition: Any, first: Any, second: Any) -> Any:
    """Return `select` in a trace, part by part for records."""
    if not has_value((condition, first, second)):
        return first if condition else second
    if isinstance(first, tuple):
        return made_of(first, [traced_select(condition, a, b) for a, b in zip(first, second, strict=True)])
    return first if first is second or first is None else noted(select, condition, first, second)


def are_alike(one: Any, other: Any) -> bool:
    """Return `is_alike` in a trace."""
    if isinstance(one, tuple):
        same = type(one) is type(other) and len(one) == len(other)
        return same and all(map(are_alike, one, other))
    if isinstance(one, Value):
        return isinstance(other, Value) and one.kind == other.kind
    return _is_same(one, other)


@type_callable(select)
def _type_of_select(_context):
    return lambda condition, first, second: types.unliteral(first)


@lower_builtin(select, types.Boolean, types.Any, types.Any)
def _emit_select(context, builder, signature, args):
    kinds, kind = signature.args[1:], signature.return_type
    return builder.select(args[0], *(context.cast(builder, *pair, kind) for pair in zip(args[1:], kinds, strict=True)))

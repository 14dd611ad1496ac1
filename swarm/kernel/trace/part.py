"""A part of a kernel: a helper as a function of its own, for some types of its arguments."""

import itertools
from typing import Any

import numpy as np

from .notes import Argument, PartCall, add
from .values import TraceError, Value, is_defined, kind_of, leaves, made_of, opened

_part_numbers = itertools.count()


class Part:
    """A function of a kernel: the notes of a helper, its arguments and its result, a number each."""

    def __init__(self, name: str, inlined: bool) -> None:
        self.name, self.inlined, self.number = name, inlined, next(_part_numbers)
        self.arguments: list[Argument] = []
        self.notes: list[Any] = []
        self.result: Any = None
        self.kind: Any = None
        self.numbers: list[Value] = []

    def take(self, given: Any) -> Any:
        """The same with an argument in the place of every number that is not a type of its own."""
        if isinstance(given, tuple):
            return made_of(given, map(self.take, given))
        if not _is_argument(given):
            return given
        self.arguments.append(Argument(kind_of(given), len(self.arguments)))
        return opened(self.arguments[-1].kind, self.arguments[-1])

    def give(self, result: Any) -> None:
        """Its result: a constant of it stays one for who calls it."""
        self.result, self.numbers = result, [one for one in leaves(result) if isinstance(one, Value)]
        if not is_defined(result):
            raise TraceError("its result has values of several kinds")

    def called(self, given: Any) -> Any:
        """Note a call of it; what it gives."""
        note, numbers = add(PartCall(self, [one for one in leaves(given) if _is_argument(one)])), itertools.count()

        def again(result: Any) -> Any:
            if isinstance(result, tuple):
                return made_of(result, map(again, result))
            return opened(result.kind, note, (next(numbers),)) if isinstance(result, Value) else result

        return again(self.result)


def _is_argument(given: Any) -> bool:
    """Whether a part takes it as an argument: a whole number or a truth that is known makes another part."""
    return isinstance(given, (Value, float, np.generic))


def key_of(given: Any) -> Any:
    """What tells one part of a helper from another: the types of its arguments, and what is known of them."""
    if isinstance(given, tuple):
        return (type(given), *map(key_of, given))
    return ("a number", kind_of(given)) if _is_argument(given) else (type(given), given)

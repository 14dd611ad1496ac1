"""The decisions and the end of one call of a function while it is traced."""

import operator
from collections.abc import Callable
from typing import Any

from numba import types

from .notes import Assign, Branch, Jump, Label, add
from .values import UNDEFINED, TraceError, Value, has_value, is_defined, noted
from .ways import merged

# The end of a block of statements: at the next statement, or elsewhere.
NEXT, DONE = True, False

Get = Callable[[], tuple[Any, ...]]
Put = Callable[[tuple[Any, ...]], None]


class Decisions:
    """The methods that `twins.py` calls for `if`, `and`, `or`, `not`, `in` and `return`.

    The statements inside of `if` and loops are functions of no arguments that return NEXT, or DONE if their end is not
    reached; `get` and `put` read and write the variables that they assign.
    """

    UNDEFINED = UNDEFINED
    NEXT = NEXT

    def __init__(self, call: Callable[..., Any]) -> None:
        # `function(...)`
        self.call = call
        self._depth = 0
        self._gives: list[tuple[Assign, Any]] = []
        self._exit = Label()
        self._only: Any = None

    # --- The end ---

    def give(self, value: Any) -> bool:
        """`return value`"""
        if self._depth == 0 and not self._gives:
            self._only = value
            return DONE
        self._gives.append((self._ends_at(self._exit), value))
        return DONE

    def result(self) -> Any:
        """Return the value that the function returns."""
        if not self._gives:
            return self._only
        return self._met(self._exit, self._gives)

    @staticmethod
    def _ends_at(label: Label) -> Assign:
        assign: Assign = add(Assign())
        add(Jump(label))
        return assign

    @staticmethod
    def _met(label: Label, ways: list[tuple[Assign, Any]]) -> Any:
        add(label)
        return merged(ways)

    # --- Decisions ---

    def test(self, value: Any) -> Any:
        """Return a condition: True or False if Python knows it."""
        if not isinstance(value, Value):
            return bool(value)
        return value if isinstance(value.kind, types.Boolean) else noted(bool, value)

    def branch(self, condition: Any, first: Callable[[], bool], second: Callable[[], bool], get: Get, put: Put) -> bool:
        """`if condition: first() else: second()`"""
        condition = self.test(condition)
        if not isinstance(condition, Value):
            return first() if condition else second()
        before, label, ways = get(), Label(), list[tuple[Assign, Any]]()
        places = (Label(), Label())
        add(Branch(condition, *places))
        self._depth += 1
        for place, way in zip(places, (first, second), strict=True):
            put(before)
            add(place)
            if way() is NEXT:
                ways.append((self._ends_at(label), get()))
        self._depth -= 1
        if not ways:
            return DONE
        put(self._met(label, ways))
        return NEXT

    def choose(self, condition: Any, first: Callable[[], Any], second: Callable[[], Any]) -> Any:
        """`first() if condition else second()`"""
        condition = self.test(condition)
        if not isinstance(condition, Value):
            return first() if condition else second()
        label, places, ways = Label(), (Label(), Label()), []
        add(Branch(condition, *places))
        for place, way in zip(places, (first, second), strict=True):
            add(place)
            value = way()
            ways.append((self._ends_at(label), value))
        result = self._met(label, ways)
        if not is_defined(result):
            raise TraceError("an expression has values of several kinds")
        return result

    def both(self, first: Any, second: Callable[[], Any]) -> Any:
        """`first and second()`"""
        if not isinstance(first, Value):
            return first and second()
        return self.choose(first, second, lambda: False if isinstance(first.kind, types.Boolean) else first)

    def either(self, first: Any, second: Callable[[], Any]) -> Any:
        """`first or second()`"""
        if not isinstance(first, Value):
            return first or second()
        return self.choose(first, lambda: True if isinstance(first.kind, types.Boolean) else first, second)

    def negate(self, value: Any) -> Any:
        """`not value`"""
        return noted(operator.not_, value) if isinstance(value, Value) else not value

    def same(self, first: Any, second: Any) -> bool:
        """`first is second`"""
        if first is UNDEFINED or second is UNDEFINED:
            bool(UNDEFINED)
        return first is second

    def contains(self, values: Any, value: Any) -> Any:
        """`value in values`"""
        if not has_value((value, values)):
            return value in values
        found: Any = False
        for one in values:
            found = found | (one == value)
        return found

"""Methods that compute their value only once."""

import functools
from collections.abc import Callable
from typing import Any, TypeVar

Owner = TypeVar("Owner")
Value = TypeVar("Value")


def once(method: Callable[[Owner], Value]) -> Callable[[Owner], Value]:
    """Return a method without arguments that keeps its value in its object, which never changes.

    >>> class Wall:
    ...     @once
    ...     def area(self):
    ...         print("computed")
    ...         return 2.0
    >>> wall = Wall()
    >>> wall.area(), wall.area()
    computed
    (2.0, 2.0)
    """
    name = f"_{method.__name__}"

    @functools.wraps(method)
    def kept(self: Owner) -> Value:
        values: dict[str, Any] = self.__dict__
        if name not in values:
            values[name] = method(self)
        value: Value = values[name]
        return value

    return kept

"""The order of what kernels are compiled for: one order by kind stands for all in which a user may list the same.

The types of nested numbers are what the compiler sees. Whoever has sorted by them keeps which is which.
"""

import functools
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

Thing = TypeVar("Thing")


def by_kind(things: Iterable[Thing], numbers: Callable[[Thing], Any]) -> list[Thing]:
    """Things in the order of the types of their numbers; those of the same types stay in their order."""
    listed = list(things)
    # The numbers of one thing alone may take long.
    return sorted(listed, key=lambda thing: _rank(numbers(thing))) if len(listed) > 1 else listed


def _rank(numbers: Any) -> tuple[int, str]:
    # What is known by most numbers comes first, so planes last. Any order would do, but of two walls that are met at
    # the same instant the first is met first.
    text = _text(numbers)
    return -len(text), text


def _text(numbers: Any) -> str:
    """The types of nested numbers."""
    if type(numbers) is tuple:
        # As nested pairs: by their text walls have the order in which results of earlier versions were made.
        return functools.reduce(lambda rest, part: f"Chain({_text(part)},{rest})", reversed(numbers), "NoneType")
    parts = f"({','.join(map(_text, numbers))})" if isinstance(numbers, (tuple, list)) else ""
    return type(numbers).__name__ + parts

"""Dataclasses with fields that are checked as their annotations declare: `radius: Length`."""

import dataclasses
import functools
import operator
from collections.abc import Callable
from typing import Annotated, Any

from . import checks

# The check in `Annotated`, after the type of a field: (name, value) -> the final value, or a `SceneError`.
Check = Callable[[str, Any], Any]

Number = Annotated[float, checks.number]
Positive = Annotated[float, checks.positive]
NotNegative = Annotated[float, functools.partial(checks.at_least, bound=0.0)]
Length = Annotated[float, checks.length]
Magnitude = Annotated[float, checks.magnitude]
PositiveMagnitude = Annotated[float, checks.positive_magnitude]
Bounded = Annotated[float, checks.bounded]
Part = Annotated[float, checks.part]
Count = Annotated[int, checks.count]
NotNegativeCount = Annotated[int, functools.partial(checks.count, least=0)]
Flag = Annotated[bool, checks.flag]
Lengths = Annotated[checks.Vector, checks.three_lengths]
Point = Annotated[checks.Vector, checks.vector]


def choice(*choices: str) -> Check:
    """Return the check of a text that must be one of `choices`."""
    return functools.partial(checks.one_of, choices=choices)


class Validated:
    """A base of dataclasses: a field of an `Annotated` type gets the value that its check returns.

    None is not checked where the type allows it. A subclass checks conditions on several fields in its
    `__post_init__`, after that of its base.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Ring(Validated):
    ...     radius: Length
    ...     width: Length | None = None
    >>> Ring(2)
    Ring(radius=2.0, width=None)
    >>> Ring(2.0, width=-1.0)
    Traceback (most recent call last):
    swarm.errors.SceneError: width must be above 0, got -1
    """

    def __post_init__(self) -> None:
        mine: Any = type(self)
        for name, check, may_be_none in _declared(mine):
            value = getattr(self, name)
            if value is not None or not may_be_none:
                object.__setattr__(self, name, check(name, value))


@functools.cache
def _declared(cls: Any) -> tuple[tuple[str, Check, bool], ...]:
    """Return for each field with a check its name, the check, and whether None is allowed."""
    kinds = {name: (one.type, *getattr(one.type, "__args__", ())) for name, one in cls.__dataclass_fields__.items()}
    found = [
        (name, check, type(None) in either)
        for name, either in kinds.items()
        for kind in either
        for check in filter(callable, getattr(kind, "__metadata__", ()))
    ]
    return tuple(found)


def bare(kind: Any) -> Any:
    """Return an annotation without its checks.

    >>> bare(Length), bare(Length | None)
    (<class 'float'>, float | None)
    """
    if hasattr(kind, "__metadata__"):
        return kind.__origin__
    for one in getattr(kind, "__args__", ()):
        if hasattr(one, "__metadata__"):
            return functools.reduce(operator.or_, map(bare, kind.__args__))
    return kind


def is_left_out(described: Any, field: dataclasses.Field[Any]) -> bool:
    """Whether a field has the default of older files that do not have it: then files omit it."""
    return bool(field.metadata.get("younger")) and getattr(described, field.name) == field.default

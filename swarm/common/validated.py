"""Dataclasses with fields that are checked as their annotations declare: `radius: Length`."""

import dataclasses
import functools
import operator
from collections.abc import Callable
from typing import Annotated, Any

from . import checks

# What `Annotated` holds behind the type of a field: (name, value) -> the value in its final form, or a `SceneError`.
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
    """The check of a text that is one of `choices`."""
    return functools.partial(checks.one_of, choices=choices)


class Validated:
    """A base of dataclasses: a field of an `Annotated` type gets the value that its check returns.

    None stands where the type allows it and is not checked. A subclass checks in its `__post_init__`, after that of its
    base, what concerns several fields.

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
    """The name of each field that has a check, the check, and whether None takes its place."""
    kinds = {name: (one.type, *getattr(one.type, "__args__", ())) for name, one in cls.__dataclass_fields__.items()}
    found = [
        (name, check, type(None) in either)
        for name, either in kinds.items()
        for kind in either
        for check in filter(callable, getattr(kind, "__metadata__", ()))
    ]
    return tuple(found)


def bare(kind: Any) -> Any:
    """An annotation without its checks.

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
    """Whether a field is at the default that it has in files that are older than it: then files leave it out."""
    return bool(field.metadata.get("younger")) and getattr(described, field.name) == field.default

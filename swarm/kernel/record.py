"""Records: named tuples that may have base classes, from which they inherit methods.

Numba passes a named tuple in registers and knows its class. Python's own `NamedTuple` takes no other base class.
"""

import collections
from collections.abc import Iterator
from types import FunctionType
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform

from ..errors import SceneError

_named: Any = collections.namedtuple
# Flags of a function that takes any number of arguments.
_ANY_NUMBER = 0x0C
# The attributes that Python writes for a named tuple by itself.
_KEPT = ("__dict__", "__doc__", "__module__", "__qualname__", "__slots__", "__weakref__")


@dataclass_transform()
class _RecordType(type):
    """The class of records and of their base classes."""

    def __new__(cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any]) -> Any:
        fields = namespace.get("__annotations__", {})
        _check(name, bases, namespace, fields)
        if fields:
            given = [one for one in fields if one in namespace]
            if given != list(fields)[len(fields) - len(given) :]:
                raise SceneError(f"the fields of {name} that have defaults must be its last, got {', '.join(fields)}")
            made = _named(name, fields, defaults=[namespace.pop(one) for one in given])
            # Into the class itself: a field takes precedence over an attribute of a base class with its name.
            namespace = {**{key: one for key, one in vars(made).items() if key not in _KEPT}, **namespace}
        namespace.setdefault("__slots__", ())
        return super().__new__(cls, name, bases, namespace)


def _check(name: str, bases: tuple[type, ...], namespace: dict[str, Any], fields: Any) -> None:
    """Raise a `SceneError` if a class hides a field or a method that kernels need."""
    for base in bases:
        if fields and getattr(base, "_fields", ()):
            raise SceneError(f"{name} must add no fields to those of {base.__name__}, got {', '.join(fields)}")
    for one, made in namespace.items():
        if one in fields and isinstance(made, (FunctionType, property)):
            raise SceneError(f"{name}.{one} must be a field or a method, got both")
        known = next((vars(parent)[one] for base in bases for parent in base.__mro__ if one in vars(parent)), None)
        if isinstance(made, FunctionType) and isinstance(known, FunctionType) and not one.startswith("__"):
            expected, got = (_arguments(each.__code__) for each in (known, made))
            if None not in (expected, got) and len(expected) != len(got):
                raise SceneError(
                    f"{name}.{one} must be a method of ({', '.join(expected)}), as {known.__qualname__} is, got one of "
                    f"({', '.join(got)})"
                )


def _arguments(code: Any) -> Any:
    """Return the names of a function's arguments; None if it takes any number of them."""
    return None if code.co_flags & _ANY_NUMBER else code.co_varnames[: code.co_argcount]


_EMPTY: Any = _named("Record", ())


class Record(_EMPTY, metaclass=_RecordType):  # type: ignore[misc]
    """A named tuple with the fields that a class annotates, or with those of its base class.

    Raises:
        SceneError: a class adds fields to those of its base, has a field and a method with the same name, or a method
            with other arguments than in its base.

    >>> class Shape(Record):
    ...     def twice(self):
    ...         return 2.0 * self.area()
    >>> class Square(Shape):
    ...     edge: float
    ...     def area(self):
    ...         return self.edge * self.edge
    >>> Square(3.0).twice(), Square(3.0)
    (18.0, Square(edge=3.0))
    """

    if TYPE_CHECKING:
        _fields: ClassVar[tuple[str, ...]]

        def _replace(self, **changes: Any) -> Self: ...
        def _asdict(self) -> dict[str, Any]: ...
        def __iter__(self) -> Iterator[Any]: ...

"""Records: named tuples that may have base classes, with which they share methods.

Numba passes a named tuple in registers and knows its class. Python's own `NamedTuple` takes no other base class.
"""

import collections
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform

_named: Any = collections.namedtuple
# What Python writes for a named tuple by itself.
_KEPT = ("__dict__", "__doc__", "__module__", "__qualname__", "__slots__", "__weakref__")


@dataclass_transform()
class _RecordType(type):
    """The class of records and of their base classes."""

    def __new__(cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any]) -> Any:
        fields = namespace.get("__annotations__", {})
        if fields:
            defaults = [namespace.pop(one) for one in fields if one in namespace]
            made = _named(name, fields, defaults=defaults)
            # Into the class itself: a field goes before what a base class has by its name.
            namespace = {**{key: one for key, one in vars(made).items() if key not in _KEPT}, **namespace}
        namespace.setdefault("__slots__", ())
        return super().__new__(cls, name, bases, namespace)


_EMPTY: Any = _named("Record", ())


class Record(_EMPTY, metaclass=_RecordType):  # type: ignore[misc]
    """A named tuple of the fields that a class annotates, or of those of its base class.

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

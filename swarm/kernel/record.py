"""Records: named tuples that may have base classes, with which they share methods.

Numba passes a named tuple in registers and knows its class. Python's own `NamedTuple` takes no other base class.
"""

import collections
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Self, dataclass_transform

_named: Any = collections.namedtuple


@dataclass_transform()
class _RecordType(type):
    """The class of records and of their abstract bases, which have no fields."""

    def __new__(cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any]) -> Any:
        fields = namespace.get("__annotations__", {})
        if fields:
            defaults = [namespace.pop(one) for one in fields if one in namespace]
            # Of the module of the class, so that records can be pickled.
            made = _named(name, fields, defaults=defaults, module=namespace["__module__"])
            bases = (*bases, made)
            # A field goes before what a base class has by its name.
            namespace |= {one: vars(made)[one] for one in fields}
        namespace.setdefault("__slots__", ())
        return super().__new__(cls, name, bases, namespace)


class Record(metaclass=_RecordType):
    """A named tuple of the fields that a class annotates; a class that annotates none is a base of records.

    A record that is a base of another hands on its fields, and the other adds none.

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

        def _replace(self, **changes: Any) -> Self: ...
        def __iter__(self) -> Iterator[Any]: ...

"""The notes of a helper: its operations, and the ways through it."""

import contextlib
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np


class Call:
    """An operation that Numba types and lowers."""

    __slots__ = ("given", "signature", "symbol")

    def __init__(self, symbol: Any, signature: Any, given: tuple[Any, ...]) -> None:
        self.symbol, self.signature, self.given = symbol, signature, given


class Attribute:
    """An attribute of a value, such as the shape of an array."""

    __slots__ = ("kind", "name", "of")

    def __init__(self, of: Any, name: str, kind: Any) -> None:
        self.of, self.name, self.kind = of, name, kind


class Element:
    """The element of an array, read where `value` is None."""

    __slots__ = ("array", "place", "value")

    def __init__(self, array: Any, place: tuple[Any, ...], value: Any = None) -> None:
        self.array, self.place, self.value = array, place, value


class Slot:
    """A variable of a kernel where several ways meet."""

    __slots__ = ("kind",)

    def __init__(self, kind: Any) -> None:
        self.kind = kind


class Assign:
    """Values for slots at the end of a way; filled in when the other ways are known."""

    __slots__ = ("pairs",)

    def __init__(self) -> None:
        self.pairs: list[tuple[Slot, Any]] = []


class Load:
    """The value of a slot."""

    __slots__ = ("slot",)

    def __init__(self, slot: Slot) -> None:
        self.slot = slot


class Label:
    """A place where a way can continue."""

    __slots__ = ()


class Jump:
    """The end of a way, which continues at a label."""

    __slots__ = ("to",)

    def __init__(self, to: Label) -> None:
        self.to = to


class Branch:
    """The end of a way, which continues at one of two labels."""

    __slots__ = ("condition", "first", "second")

    def __init__(self, condition: Any, first: Label, second: Label) -> None:
        self.condition, self.first, self.second = condition, first, second


class Argument:
    """An argument of a part."""

    __slots__ = ("kind", "number")

    def __init__(self, kind: Any, number: int) -> None:
        self.kind, self.number = kind, number


class PartCall:
    """A call of a part."""

    __slots__ = ("given", "part")

    def __init__(self, part: Any, given: list[Any]) -> None:
        self.part, self.given = part, given


# --- The trace of a thread -------------------------------------------------------------------------------

_now = threading.local()


@contextlib.contextmanager
def noting(notes: list[Any], context: Any = None) -> Iterator[None]:
    """Let a thread note its trace; the default context is that of the trace around it."""
    before = getattr(_now, "notes", None), getattr(_now, "context", None)
    _now.notes, _now.context = notes, context or before[1]
    try:
        # For known numbers: kernels do not warn.
        with np.errstate(all="ignore"):
            yield
    finally:
        _now.notes, _now.context = before


def context() -> Any:
    """Numba's context of types in the trace of this thread."""
    return _now.context


def taken() -> list[Any]:
    """The notes of the part that is being traced."""
    return _now.notes  # type: ignore[no-any-return]


def add(note: Any) -> Any:
    """Add a note."""
    _now.notes.append(note)
    return note

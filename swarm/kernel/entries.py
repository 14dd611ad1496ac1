"""The keys of compiled kernels on disk, and their files.

Numba finds a kernel by the types of its arguments, which it pickles in an index with the classes of tuples. A class of
a module is pickled by its name: a process that cannot import this module cannot read the index. A class of a script or
of a cell of a notebook is pickled by its value, which no other process takes for its own. Here a text stands for the
types: the names of classes, and the code of their definitions outside of this package. In a kernel itself
classes are numbers, so that the process that loads it uses its own classes.
"""

import io
import pickle
from collections.abc import Sequence
from typing import Any, NamedTuple

from numba import types
from numba.core.caching import IndexDataCacheFile
from numba.core.serialize import NumbaPickler

from .frozen import Frozen


class Key(NamedTuple):
    """A text for the types of arguments, the classes of tuples in them, in order, and whether the key repeats."""

    text: str
    classes: tuple[type, ...]
    repeats: bool


def key_of(kinds: Sequence[Any], *others: Any, package: str | None = None) -> Key:
    """Return the key of Numba types, and of all else that distinguishes two kernels: plain values and functions.

    It never repeats if a function, or the definition of a class, refers to an unknown value. With `package` the key
    includes the code of this package to which the functions and classes refer, see `Frozen`.
    """
    frozen, classes = Frozen(package=package), dict[type, None]()
    frozen.value(others)
    for kind in kinds:
        _add(kind, frozen, classes)
    return Key(frozen.digest(), tuple(classes), frozen.is_known)


def _add(kind: Any, frozen: Frozen, classes: dict[type, None]) -> None:
    made = python_class(kind)
    frozen.value(made)
    if isinstance(kind, types.BaseTuple):
        classes[made] = None
        frozen.add(len(kind.types))  # type: ignore[attr-defined]
        for part in kind.types:  # type: ignore[attr-defined]
            _add(part, frozen, classes)
    else:
        frozen.add(repr(kind))


def python_class(kind: Any) -> Any:
    """Return the Python class of the values of the Numba type `kind`, as far as functions are chosen by it."""
    if isinstance(kind, types.BaseTuple):
        return getattr(kind, "instance_class", tuple)
    if isinstance(kind, types.NoneType):
        return type(None)
    return float if isinstance(kind, types.Float) else object


def is_own(function: Any) -> bool:
    """Whether a function belongs to this package; the folder of kernels is named by the package's code."""
    return str(function.__module__).partition(".")[0] == __name__.partition(".")[0]


class File(IndexDataCacheFile):  # type: ignore[misc]
    """The index and the kernels of one function, by `Key`."""

    def save(self, key: Key, data: Any) -> None:
        """Write a kernel with a key that repeats."""
        if not key.repeats:
            return
        written = io.BytesIO()
        _EntryWriter(written, key.classes).dump(data)
        super().save(key.text, written.getvalue())

    def load(self, key: Key) -> Any:
        """Return a kernel, or None."""
        written = super().load(key.text)
        return None if written is None else _EntryReader(io.BytesIO(written), key.classes).load()


class _EntryWriter(NumbaPickler):  # type: ignore[misc]
    def __init__(self, file: io.BytesIO, classes: tuple[type, ...]) -> None:
        super().__init__(file, protocol=4)
        self._numbers = {made: number for number, made in enumerate(classes)}

    def persistent_id(self, thing: Any) -> int | None:
        """Return the number of a class."""
        return self._numbers.get(thing) if isinstance(thing, type) else None


class _EntryReader(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, classes: tuple[type, ...]) -> None:
        super().__init__(file)
        self._classes = classes

    def persistent_load(self, number: int) -> type:
        """Return the class of a number."""
        return self._classes[number]

"""Checksums of the values of an HDF5 file: of each row of a growing dataset, and of each constant.

HDF5 has checksums of its metadata (objects, attributes of a fixed length, indexes of chunks), not of values. Its filter
Fletcher-32 would cover a chunk as a whole: a chunk of ten frames is written again with each of them, and a kill during
that would lose the earlier frames, which other processes could not read meanwhile either. So each row of a
dataset, in blocks of 250 particles, has a CRC-32 in the file: parameters/checksums/rows, (frames, columns) uint32, 0 if
it is not known. parameters/checksums/columns lists the datasets of these columns, one a line: its name, its number of
columns, and the entries in each (0: the row). parameters/checksums/constants has a line of the name and the checksum
of each dataset that is written once, and of each attribute that is a text, GROUP@NAME. Both are texts of a fixed
length. Files of older versions have no checksums.
"""

import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from .appended import put
from .layout import text

GROUP = "parameters/checksums"
_ROWS, _COLUMNS, _CONSTANTS = (f"{GROUP}/{name}" for name in ("rows", "columns", "constants"))
# Particles of a block: the path of one is read with those of its block, and a call takes as long as a few kB.
BLOCK = 250
# Bytes of a chunk of checksums.
_CHUNK = 1 << 14
# Bytes of the rows that are read at once.
_AT_ONCE = 1 << 24

Sums = NDArray[np.uint32]


def checksum_of(data: Any, before: int = 0) -> int:
    """The CRC-32 of the bytes of an array or a text, continued from the checksum `before`; never 0."""
    if isinstance(data, str):
        return zlib.crc32(data.encode("utf-8", "surrogateescape"), before) or 1
    values: Any = np.ascontiguousarray(data)
    values = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return (zlib.crc32(memoryview(values).cast("B"), before) if values.size else before) or 1


def row_sums(entries: Any, block: int = 0) -> Sums:
    """The checksums of rows (rows, n, ...), one a row or one for each `block` of its n entries: (rows, blocks).

    >>> row_sums(np.zeros((2, 5, 3)), 2).shape
    (2, 3)
    """
    values: Any = np.ascontiguousarray(entries)
    values = values.astype(values.dtype.newbyteorder("<"), copy=False)
    count = max(1, -(-values.shape[1] // block)) if block else 1
    if not values.size:
        return np.ones((len(values), count), np.uint32)
    view = memoryview(values).cast("B")
    width = len(view) // len(values)
    step = width // values.shape[1] * block if block else width
    sums = [
        zlib.crc32(view[k : min(k + step, row + width)]) or 1
        for row in range(0, len(view), width)
        for k in range(row, row + width, step)
    ]
    return np.array(sums, np.uint32).reshape(len(values), count)


class RowSums:
    """The checksums of the rows of a file that is being written."""

    def __init__(self, file: Any, blocks: dict[str, tuple[int, int]]) -> None:
        self._data, self._new, self._blocks = file[_ROWS], dict[str, Sums](), blocks

    @classmethod
    def create(cls, file: Any, growing: dict[str, tuple[int, int]], other: Sequence[str] = ()) -> "RowSums":
        """Create the dataset of checksums of growing datasets, and write the checksums of constants.

        `growing` has the entries of a row and of a block for each. The `other` datasets get no checksums.
        """
        blocks = {
            name: (max(1, -(-entries // block)) if block else 1, block) for name, (entries, block) in growing.items()
        }
        total = sum(count for count, _block in blocks.values())
        rows = max(10, min(1024, _CHUNK // (4 * total)))
        file.create_dataset(_ROWS, (0, total), np.uint32, maxshape=(None, total), chunks=(rows, total))
        file[_COLUMNS] = np.bytes_(
            "\n".join(f"{name} {count} {block}" for name, (count, block) in blocks.items()).encode()
        )
        # To open an object takes longer than to visit it.
        objects = _objects(file, lambda name, about: about.num_attrs > 0 or name not in growing)
        known = {name: one for name, one in objects if _is_constant(name, one) and name not in (*growing, *other)}
        sums = {name: checksum_of(_value(known[name])) for name in sorted(known)}
        file[_CONSTANTS] = np.bytes_(_serialized(sums | _attributes(objects)))
        # A file on a full disk cannot be read back.
        return cls(file, blocks)

    @classmethod
    def of(cls, file: Any) -> "RowSums | None":
        """The checksums of the rows of an existing file; None if the file has no checksums."""
        if _ROWS not in file:
            return None
        return cls(file, {name: (count, block) for name, count, block in _columns(file)})

    def forget(self, first: int, count: int) -> bool:
        """Mark checksums of rows as unknown until the rows are written again; return whether there were some."""
        there = min(count, int(self._data.shape[0]) - first)
        if there > 0:
            put(self._data, first, np.zeros((there, self._data.shape[1]), np.uint32))
        return there > 0

    def add(self, name: str, entries: Any) -> None:
        """Add the checksums of the next rows of a dataset."""
        if name in self._blocks:
            self._new[name] = row_sums(entries, self._blocks[name][1])

    def take(self, sums: dict[str, list[int]]) -> None:
        """Add the checksums of rows by the names of their datasets."""
        self._new |= {name: np.array(each, np.uint32)[:, None] for name, each in sums.items()}

    def write(self, first: int) -> None:
        """Write the added checksums, from row `first` on."""
        rows = len(next(iter(self._new.values())))
        # A dataset that was removed from the file has no new rows; its checksums are 0, which means unknown.
        nothing = {name: np.zeros((rows, count), np.uint32) for name, (count, _block) in self._blocks.items()}
        put(self._data, first, np.hstack(list((nothing | self._new).values())))
        self._new.clear()


def checksum_of_attribute(group: Any, name: str) -> int:
    """The checksum of an attribute of texts."""
    return checksum_of("\n".join(map(str, np.ravel(group.attrs[name]))))


def _objects(file: Any, is_wanted: Callable[[str, Any], bool]) -> list[tuple[str, Any]]:
    """Return groups with attributes, and the datasets that `is_wanted` selects by HDF5's information, with their names.

    Each comes once, though links give some of them several names.
    """
    found: list[str] = []

    def visit(name: bytes, about: Any) -> None:
        text = name.decode("utf-8", "surrogateescape")
        if (about.num_attrs > 0 or about.type == h5py.h5o.TYPE_DATASET) and is_wanted(text, about):
            found.append(text)

    h5py.h5o.visit(file.id, visit, info=True)
    return [(name, file[name]) for name in found]


def _attributes(objects: list[tuple[str, Any]]) -> dict[str, int]:
    """The checksums of the attributes with texts in the heap, by GROUP@NAME."""
    found = {}
    for name, one in objects:
        for key in one.attrs if h5py.h5a.get_num_attrs(one.id) else ():
            if h5py.check_string_dtype(one.attrs.get_id(key).dtype):
                found[f"{name}@{key}"] = checksum_of_attribute(one, key)
    return found


def replace(file: Any, values: dict[str, Any]) -> None:
    """Write constants anew; if the process is killed, their checksums fit the old values or the new, or are unknown."""
    known = dict(_constants(file)) if _CONSTANTS in file else {}
    values = {name: value for name, value in values.items() if file[name][()] != value}
    if not values:
        return
    for sums in (dict.fromkeys(values, 0), {name: checksum_of(file[name].dtype.type(values[name])) for name in values}):
        if known:
            file[_CONSTANTS][()] = np.bytes_(
                _serialized(known | {name: sums[name] for name in values if name in known})
            )
            file.flush()
        if not any(sums.values()):
            for name, value in values.items():
                file[name][()] = value
            file.flush()


def _is_constant(name: str, one: Any) -> bool:
    """Whether an object of a file is a dataset that does not grow and holds no checksums."""
    if not isinstance(one, h5py.Dataset) or name.startswith(GROUP):
        return False
    return one.shape == () or (one.maxshape[0] is not None and not one.is_virtual)


def constants(file: Any) -> list[str]:
    """The names of the datasets that do not grow."""
    return sorted(name for name, one in _objects(file, lambda *_: True) if _is_constant(name, one))


class Checked:
    """A reader of the values of a file that compares them with their checksums, if the file has some.

    A value that differs raises a ValueError that names its dataset and its frame.
    """

    def __init__(self, file: Any, path: Path, opened: Callable[[Path], Any]) -> None:
        self._file, self._path, self._opened = file, path, opened
        self._sums = file.get(_ROWS)
        self._constants = _constants(file) if _CONSTANTS in file else {}
        self._places, first = dict[str, tuple[slice, int]](), 0
        for name, count, block in _columns(file) if self._sums is not None else ():
            self._places[name] = slice(first, first + count), block
            first += count
        self._parts: dict[str, Checked] = {}
        self._datasets = dict[str, tuple[Any, bool]]()

    def close(self) -> None:
        """Close the files of shards."""
        for part in self._parts.values():
            part._file.close()

    def has_any(self) -> bool:
        """Whether the file has checksums."""
        return self._sums is not None

    def constant(self, name: str) -> Any:
        """Return a dataset that is written once: a number, an array or a text."""
        value = text(self._file[name], self._path) if _is_text(self._file[name]) else self._file[name][()]
        if (known := self._constants.get(name)) and known != checksum_of(value):
            raise ValueError(f"{name} does not match its checksum")
        return value

    def row(self, name: str, k: int) -> Any:
        """Return row k of a growing dataset."""
        return self.rows(name, k, k + 1)[0]

    def rows(self, name: str, first: int, last: int) -> Any:
        """Return rows of a growing dataset."""
        data, is_virtual = self._dataset(name)
        if is_virtual:
            return self._joined(data, first, last)
        values = data[first:last]
        if name in self._places:
            where, block = self._places[name]
            self._compare(name, first, row_sums(values, block), self._sums[first:last, where])
        return values

    def path(self, name: str, i: int, frames: int) -> Any:
        """Return entry i of the first rows of a dataset, (rows, ...)."""
        data, is_virtual = self._dataset(name)
        if is_virtual:
            for one in data.virtual_sources():
                (_, to, *_), (_, end, *_) = one.vspace.get_select_bounds()
                if to <= i <= end:
                    at = one.src_space.get_select_bounds()[0][1]
                    return self._part(one.file_name).path(one.dset_name, at + i - to, frames)
        if name not in self._places:
            return data[:frames, i]
        where, block = self._places[name]
        begin = i // block * block
        each = max(1, _AT_ONCE // (block * data.dtype.itemsize))
        found = []
        for first in range(0, frames, each):
            last = min(frames, first + each)
            values = data[first:last, begin : begin + block]
            known = self._sums[first:last, where.start + i // block][:, None]
            self._compare(name, first, row_sums(values), known)
            found.append(values[:, i - begin])
        return np.concatenate(found) if found else data[:0, i]

    def compare_rows(self, name: str, data: Any, k: int, rows: tuple[int, int]) -> None:
        """Compare the rows of a column that belong to frame k with their checksum."""
        if name in self._places:
            found, (begin, end) = 0, rows
            each = _AT_ONCE // (data.dtype.itemsize * int(np.prod(data.shape[1:])))
            for first in range(begin, end, each):
                found = checksum_of(data[first : min(end, first + each)], found)
            self._compare(name, k, np.array([[found or 1]], np.uint32), self._sums[k : k + 1, self._places[name][0]])

    def require_constants(self) -> None:
        """Compare all constants with their checksums."""
        for name in constants(self._file):
            self.constant(name)
        # Texts come first: their check tells whether the heap, which also holds the texts of attributes, can be read.
        self.require_attributes()

    def require_attributes(self, group: str = "") -> None:
        """Compare the text attributes of a group, or of all groups, with their checksums."""
        for name, known in self._constants.items():
            where, has_one, attribute = name.rpartition("@")
            if has_one and where.startswith(group) and checksum_of_attribute(self._file[where], attribute) != known:
                raise ValueError(f"the attribute {attribute} of {where} does not match its checksum")

    def require_intact(self, frames: int) -> None:
        """Compare all constants, and all rows of the first frames, with their checksums."""
        self.require_constants()
        virtual = [f"particles/all/{name}/value" for name in self._file.get("particles/all", ())]
        virtual = [name for name in virtual if name in self._file and self._file[name].is_virtual]
        for name in (*self._places, *virtual):
            data = self._file[name]
            each = max(1, _AT_ONCE // max(1, data.dtype.itemsize * int(np.prod(data.shape[1:]))))
            for first in range(0, frames, each):
                self.rows(name, first, min(frames, first + each))

    def _dataset(self, name: str) -> tuple[Any, bool]:
        """Return a growing dataset and whether it is virtual, cached: to open it takes as long as to read a frame."""
        if name not in self._datasets:
            data = self._file[name]
            self._datasets[name] = data, data.is_virtual
        return self._datasets[name]

    def _compare(self, name: str, first: int, found: Sums, known: Sums) -> None:
        wrong = ((found != known) & (known != 0)).any(axis=1)
        if len(known) < len(found):
            raise ValueError(f"{name} has {first + len(found)} rows, and {first + len(known)} checksums")
        if wrong.any():
            shown = name.removesuffix("/value")
            raise ValueError(f"{shown} of frame {first + int(wrong.argmax())} does not match its checksum")

    def _part(self, name: str) -> "Checked":
        """Return the reader of the file of a shard."""
        if name not in self._parts:
            path = self._path.parent / name
            self._parts[name] = Checked(self._opened(path), path, self._opened)
        return self._parts[name]

    def _joined(self, data: Any, first: int, last: int) -> Any:
        """Return rows of a virtual dataset, which are in the files of shards."""
        out, read = np.zeros((last - first, *data.shape[1:]), data.dtype), dict[str, Any]()
        for one in data.virtual_sources():
            (_, to, *_), (_, end, *_) = one.vspace.get_select_bounds()
            at = one.src_space.get_select_bounds()[0][1]
            if one.file_name not in read:
                read = {one.file_name: self._part(one.file_name).rows(one.dset_name, first, last)}
            out[:, to : end + 1] = read[one.file_name][:, at : at + end + 1 - to]
        return out


def _is_text(data: Any) -> bool:
    # A damaged file may have a group under the name.
    return isinstance(data, h5py.Dataset) and data.shape == () and h5py.check_string_dtype(data.dtype) is not None


def _value(data: Any) -> Any:
    return str(data.asstr(errors="surrogateescape")[()]) if _is_text(data) else data[()]


def _serialized(sums: dict[str, int]) -> bytes:
    return "\n".join(f"{name} {known:08x}" for name, known in sums.items()).encode()


def _lines(file: Any, name: str, numbers: int) -> Iterator[list[str]]:
    if not _is_text(file[name]):
        raise ValueError(f"{name} is not a text")
    return (line.rsplit(" ", numbers) for line in file[name][()].decode().split("\n"))


def _constants(file: Any) -> dict[str, int]:
    return {name: int(known, 16) for name, known in _lines(file, _CONSTANTS, 1)}


def _columns(file: Any) -> Iterator[tuple[str, int, int]]:
    return ((name, int(count), int(block)) for name, count, block in _lines(file, _COLUMNS, 2))

"""The mark of HDF5 on a file that is open for writing, taken off again.

In the mode for one writer and many readers (SWMR) HDF5 writes in an order in which every prefix of its writes is a
whole file: what a kill leaves can be read. (In the ordinary mode it cannot: a kill while a node of a B-tree is split
loses the half of it.) But it marks the file, so that readers which do not ask for
that mode refuse it, even after the writer is dead. The mark is a byte of the superblock, whose layout is fixed: HDF5
File Format Specification, II.A, superblock version 3.
"""

import io
import os
from pathlib import Path
from typing import Any, BinaryIO

SIZE = 48
_VERSION, _FLAGS, _END, _CHECKSUM = 8, 11, slice(28, 36), slice(44, 48)
_MASK = 0xFFFFFFFF


def unmark(file: BinaryIO) -> bytes:
    """Clear the mark of an open file, which is not buffered; return its superblock."""
    block = _read(file)
    if len(block) == SIZE and block[_FLAGS] != 0:
        block[_FLAGS] = 0
        _write(file, block)
    return bytes(block)


def mend(file: BinaryIO) -> None:
    """Make what a kill left ready to be written on: no mark, and the end where the file ends.

    The superblock is the last that a flush writes. Its end may lie before blocks that are in use already, and HDF5
    would give their place to others.
    """
    block = _read(file)
    if len(block) == SIZE and block[_VERSION] == 3:
        end = max(file.seek(0, os.SEEK_END), int.from_bytes(block[_END], "little"))
        block[_FLAGS], block[_END] = 0, end.to_bytes(8, "little")
        _write(file, block)


class Unmarked(io.FileIO):
    """A file as if it had no mark, to be read by h5py.

    A marked one opens in the mode for readers only, and there HDF5 waits until the writer has mended what is damaged:
    if there is no writer, for ever.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._place = 0
        block = bytearray(super().read(SIZE) or b"")
        if len(block) == SIZE and block[_VERSION] == 3 and _sum(block) == block[_CHECKSUM]:
            block[_FLAGS] = 0
            block[_CHECKSUM] = _sum(block)
        self._block = bytes(block)

    def __del__(self) -> None:
        # h5py closes no file that it did not open.
        self.close()

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to a place."""
        self._place = super().seek(offset, whence)
        return self._place

    def readinto(self, buffer: Any) -> int:
        """Read from there; the superblock is the one without a mark."""
        at, view = self._place, memoryview(buffer)
        # Where processes are forked, they share the place of a file.
        data = os.pread(self.fileno(), len(view), at) if hasattr(os, "pread") else super().read(len(view)) or b""
        part = self._block[at : at + len(data)]
        view[: len(data)] = part + data[len(part) :]
        return len(data)


def _sum(block: bytearray) -> bytes:
    return checksum(bytes(block[: _CHECKSUM.start])).to_bytes(4, "little")


def put_back(file: BinaryIO, block: bytes) -> None:
    """Let the superblock be what it was."""
    file.seek(0)
    file.write(block)


def _read(file: BinaryIO) -> bytearray:
    file.seek(0)
    return bytearray(file.read(SIZE))


def _write(file: BinaryIO, block: bytearray) -> None:
    block[_CHECKSUM] = _sum(block)
    put_back(file, bytes(block))


def checksum(data: bytes) -> int:
    """Bob Jenkins' lookup3, hashlittle(data, 0), which HDF5 uses for metadata; for a length above 12."""
    a = b = c = 0xDEADBEEF + len(data) & _MASK
    words = [int.from_bytes(data[i : i + 4], "little") for i in range(0, len(data), 4)]
    words += [0] * (-len(words) % 3)
    last = len(words) - 3
    for i in range(0, last, 3):
        a, b, c = a + words[i] & _MASK, b + words[i + 1] & _MASK, c + words[i + 2] & _MASK
        a, c = (a - c & _MASK) ^ _turned(c, 4), c + b & _MASK
        b, a = (b - a & _MASK) ^ _turned(a, 6), a + c & _MASK
        c, b = (c - b & _MASK) ^ _turned(b, 8), b + a & _MASK
        a, c = (a - c & _MASK) ^ _turned(c, 16), c + b & _MASK
        b, a = (b - a & _MASK) ^ _turned(a, 19), a + c & _MASK
        c, b = (c - b & _MASK) ^ _turned(b, 4), b + a & _MASK
    a, b, c = a + words[last] & _MASK, b + words[last + 1] & _MASK, c + words[last + 2] & _MASK
    for bits in (14, 11, 25, 16, 4, 14, 24):
        a, b, c = b, (c ^ b) - _turned(b, bits) & _MASK, a
    return b


def _turned(word: int, bits: int) -> int:
    return (word << bits | word >> 32 - bits) & _MASK

"""The mark that HDF5 sets on a file that is open for writing is cleared.

In the mode for one writer and many readers (SWMR) HDF5 orders its writes so that every prefix of them is a valid file:
a file of a killed run can be read. (In the ordinary mode it cannot: a kill while a node of a B-tree is split
loses half of it.) But HDF5 marks the file, and readers that do not use SWMR refuse a marked one, even after the
writer has ended. The mark is a byte of the superblock. Its layout is fixed: HDF5 File Format Specification, II.A,
superblock version 3.
"""

import io
import os
from pathlib import Path
from typing import Any, BinaryIO

SIZE = 48
_VERSION, _FLAGS, _END, _CHECKSUM = 8, 11, slice(28, 36), slice(44, 48)
_MASK = 0xFFFFFFFF


def unmark(file: BinaryIO) -> bytes:
    """Clear the mark of an open, unbuffered file; return its superblock."""
    block = _read(file)
    if len(block) == SIZE and block[_FLAGS] != 0:
        block[_FLAGS] = 0
        _write(file, block)
    return bytes(block)


def make_appendable(file: BinaryIO) -> None:
    """Prepare a file of a killed run for writing: clear the mark, and set the end of file to the real one.

    A flush writes the superblock last, so its end of file may lie before blocks in use, which HDF5 would overwrite.
    """
    block = _read(file)
    if len(block) == SIZE and block[_VERSION] == 3:
        end = max(file.seek(0, os.SEEK_END), int.from_bytes(block[_END], "little"))
        block[_FLAGS], block[_END] = 0, end.to_bytes(8, "little")
        _write(file, block)


class Unmarked(io.FileIO):
    """A file that h5py reads as if it had no mark.

    A marked file can only be opened in SWMR mode, where HDF5 waits for the writer to complete a damaged part:
    forever, if there is no writer.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._offset = 0
        block = bytearray(super().read(SIZE) or b"")
        if len(block) == SIZE and block[_VERSION] == 3 and _sum(block) == block[_CHECKSUM]:
            block[_FLAGS] = 0
            block[_CHECKSUM] = _sum(block)
        self._block = bytes(block)

    def __del__(self) -> None:
        # h5py does not close a file that it did not open.
        self.close()

    def seek(self, offset: int, whence: int = 0) -> int:
        """Move to an offset."""
        self._offset = super().seek(offset, whence)
        return self._offset

    def readinto(self, buffer: Any) -> int:
        """Read from the offset; the superblock has no mark."""
        at, view = self._offset, memoryview(buffer)
        # Forked processes share the offset of a file.
        data = os.pread(self.fileno(), len(view), at) if hasattr(os, "pread") else super().read(len(view)) or b""
        part = self._block[at : at + len(data)]
        view[: len(data)] = part + data[len(part) :]
        return len(data)


def _sum(block: bytearray) -> bytes:
    return checksum(bytes(block[: _CHECKSUM.start])).to_bytes(4, "little")


def put_back(file: BinaryIO, block: bytes) -> None:
    """Restore the superblock."""
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
        a, c = (a - c & _MASK) ^ _rotated(c, 4), c + b & _MASK
        b, a = (b - a & _MASK) ^ _rotated(a, 6), a + c & _MASK
        c, b = (c - b & _MASK) ^ _rotated(b, 8), b + a & _MASK
        a, c = (a - c & _MASK) ^ _rotated(c, 16), c + b & _MASK
        b, a = (b - a & _MASK) ^ _rotated(a, 19), a + c & _MASK
        c, b = (c - b & _MASK) ^ _rotated(b, 4), b + a & _MASK
    a, b, c = a + words[last] & _MASK, b + words[last + 1] & _MASK, c + words[last + 2] & _MASK
    for bits in (14, 11, 25, 16, 4, 14, 24):
        a, b, c = b, (c ^ b) - _rotated(b, bits) & _MASK, a
    return b


def _rotated(word: int, bits: int) -> int:
    return (word << bits | word >> 32 - bits) & _MASK

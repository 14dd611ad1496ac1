"""HDF5 files that are written row by row and stay readable if the process is killed at any moment.

HDF5's mode for one writer and many readers (SWMR) orders the writes so that every prefix of them is a valid file.
"""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..errors import FileError
from . import driver, paths, superblock
from .replaced import no_room
from .sources import cause

# HDF5's default chunk cache, 1 MB a dataset, would fill during 100 000 frames, which looks like a memory leak.
_SMALL_CACHE = 1 << 16
# The approximate number of bytes of a new file before its first frame.
_BEGINNING = 1 << 17
# The oldest format with SWMR.
_FORMAT = ("v110", "v110")


class AppendedFile:
    """A file that is created, or reopened to go on with it.

    A new file gets its name by `_rename`; until then an existing file of that name stays. Subclasses create or find the
    datasets, and write to them.
    """

    def __init__(self, path: Path, what: str, following: bool) -> None:
        self._path, self._what, self._following = path, what, following
        self._part = path if following else paths.part_of(path)

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        try:
            self._file.close()
        except (OSError, RuntimeError) as problem:
            self._abandon()
            if error is None:
                raise FileError(f"cannot close the {self._what} {self._path}: {cause(problem)}") from problem
        finally:
            self._handle.close()
        if self._is_new():
            # A file without a frame has no content.
            self._part.unlink(missing_ok=True)

    def sync(self) -> None:
        """Flush the written data to the disk."""
        try:
            os.fsync(self._handle.fileno())
        except OSError as error:
            raise FileError(f"cannot write the {self._what} {self._path}: {cause(error)}") from error

    def _open(self) -> None:
        """Open the file, or raise a FileError."""
        self._size, self._block = 0, b""
        try:
            # HDF5 crashes when it frees its objects if the disk has no room for the beginning of the file.
            if not self._following and (full := no_room(self._part, _BEGINNING)):
                raise OSError(full)
            self._open_as("r+" if self._following else "w")
        except OSError as error:
            if not self._following:
                self._part.unlink(missing_ok=True)
            raise FileError(f"cannot write the {self._what} {self._path}: {cause(error)}") from error

    def _open_as(self, mode: str) -> None:
        self._handle = open(self._part, "r+b", buffering=0)  # noqa: SIM115  closed by `__exit__`
        if mode == "r+":
            superblock.make_appendable(self._handle)
        # HDF5's locks would block readers.
        self._file = driver.opened_to_write(self._part, mode, libver=_FORMAT, rdcc_nbytes=_SMALL_CACHE, locking=False)
        self._descriptor = int(self._file.id.get_vfd_handle())

    def _find(self) -> None:
        """Find the datasets of an existing file, and begin."""
        raise NotImplementedError

    def _begin(self) -> None:
        """Switch to SWMR, after which nothing can be created."""
        self._file.swmr_mode = True
        self._flush()

    def _flush(self) -> None:
        """Write the buffers of HDF5, after which the file can be read even if the process is killed."""
        self._file.flush()
        self._block = superblock.unmark(self._handle)
        self._size = os.fstat(self._handle.fileno()).st_size

    @contextlib.contextmanager
    def _beginning(self) -> Iterator[None]:
        """Open the file, and create or find its datasets; an error removes a new file.

        HDF5 would crash the process if it closed a file with data that it cannot write.
        """
        self._open()
        try:
            with self._writing(f"the beginning of the {self._what}"):
                try:
                    yield
                except (LookupError, ValueError):
                    # Unwritten data cannot be read back; the flush raises the system's reason.
                    self._file.flush()
                    raise
        except FileError as error:
            self.__exit__(FileError, error, None)
            raise

    @contextlib.contextmanager
    def _writing(self, what: str) -> Iterator[None]:
        """Write `what`; turn an error into a FileError and leave earlier data as they were."""
        try:
            self._require_there()
            yield
        except FileError:
            self._abandon()
            raise
        except (OSError, RuntimeError) as error:
            self._abandon()
            if not self._handle.closed:
                superblock.put_back(self._handle, self._block)
            raise FileError(f"cannot write {what} to {self._path}: {cause(error)}") from error

    def _rename(self) -> None:
        """Take the name from an older file."""
        try:
            os.replace(self._part, self._path)
            self._part = self._path
        except PermissionError:  # Windows renames no file that is open
            self._file.close()
            self._handle.close()
            os.replace(self._part, self._path)
            self._part = self._path
            self._open_as("r+")
            self._find()

    def _is_new(self) -> bool:
        """Whether the file has not got its name yet."""
        return self._part != self._path

    def _require_there(self) -> None:
        """Raise a FileError if the file was removed or truncated, which HDF5 would not notice."""
        mine = os.fstat(self._handle.fileno())
        try:
            there = os.path.samestat(os.stat(self._part), mine)
        except FileNotFoundError:
            there = False
        if not there:
            raise FileError(f"the {self._what} {self._path} was deleted or replaced while the run was writing it")
        if mine.st_size < self._size:
            raise FileError(
                f"the {self._what} {self._path} was truncated while the run was writing it, from {self._size} to "
                f"{mine.st_size} bytes"
            )

    def _abandon(self) -> None:
        """Send further writes to the null device: HDF5's buffers of a failed frame would damage earlier ones."""
        try:
            # The descriptor is tested without HDF5, which crashes the process if it could not close the file.
            if not os.path.samestat(os.fstat(self._descriptor), os.fstat(self._handle.fileno())):
                return  # abandoned already
        except (OSError, ValueError):
            return  # closed
        null = os.open(os.devnull, os.O_RDWR)
        os.dup2(null, self._descriptor)
        os.close(null)


def put(dataset: Any, first: int, values: Any) -> Any:
    """Write entries from row `first` on; return them as they are stored.

    h5py's indexing takes four times as long, for twenty datasets a frame.
    """
    handle = dataset.id
    count, *shape = handle.shape
    entries = np.ascontiguousarray(values, dtype=dataset.dtype)
    if count < first + len(entries):
        handle.set_extent((first + len(entries), *shape))
    space = handle.get_space()
    space.select_hyperslab((first, *(0 for _ in shape)), entries.shape)
    handle.write(h5py.h5s.create_simple(entries.shape), space, entries)
    return entries

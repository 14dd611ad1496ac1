"""HDF5 files that others in this process have open too.

In one process HDF5 allows one setting of locks, and one of reading or writing, for a file and a driver, and other code
may have opened the file with another. The logging driver reads and writes like the default one, logs nothing by
default, and is rarely used: what others have opened by the default one does not matter to it.
"""

import weakref
from pathlib import Path
from typing import Any

import h5py

from . import paths

NAME = "swarm"


h5py.register_driver(NAME, lambda plist, **_options: plist.set_fapl_log(b"", 0, 0))

# The files that this process has opened by it, and which they are. HDF5 is not asked: it crashes the process if it
# could not close one, on a full disk.
_opened: list[tuple[weakref.ref[h5py.File], tuple[int, int] | None]] = []


def open_by(path: Path, mode: str, **options: Any) -> h5py.File:
    """Open a file by this driver."""
    file = h5py.File(path, mode, driver=NAME, **options)
    _opened[:] = [*_open(), (weakref.ref(file), paths.identity(path))]
    return file


def opened_to_write(path: Path, mode: str, **options: Any) -> h5py.File:
    """Open a file to write it."""
    try:
        return open_by(path, mode, **options)
    except OSError:
        # A reader of swarm has it open by this driver.
        return h5py.File(path, mode, **options)


def has_open(path: Path) -> bool:
    """Whether this process has the file open by this driver: by it, it could only be opened as it was then."""
    return paths.identity(path) in [identity for _file, identity in _open()]


def _open() -> list[tuple[weakref.ref[h5py.File], tuple[int, int] | None]]:
    """The files that are open still."""
    return [(found, identity) for found, identity in _opened if found()]

"""HDF5 files that other code in this process has open too.

In one process HDF5 allows one setting of locks, and one mode of access, for a file and a driver, and other code
may have opened the file with another setting. The logging driver reads and writes like the default one, logs nothing by
default, and is rarely used, so that files opened by the default driver do not conflict with it.
"""

import weakref
from pathlib import Path
from typing import Any

import h5py

from . import paths

NAME = "swarm"


h5py.register_driver(NAME, lambda plist, **_options: plist.set_fapl_log(b"", 0, 0))

# The files that this process has opened by this driver, and their identities. HDF5 cannot list them safely: it crashes
# the process if it could not close one on a full disk.
_opened: list[tuple[weakref.ref[h5py.File], tuple[int, int] | None]] = []


def open_by(path: Path, mode: str, **options: Any) -> h5py.File:
    """Open a file by this driver."""
    file = h5py.File(path, mode, driver=NAME, **options)
    _opened[:] = [*_open(), (weakref.ref(file), paths.identity(path))]
    return file


def opened_to_write(path: Path, mode: str, **options: Any) -> h5py.File:
    """Open a file for writing."""
    try:
        return open_by(path, mode, **options)
    except OSError:
        # A reader of swarm has the file open by this driver.
        return h5py.File(path, mode, **options)


def has_open(path: Path) -> bool:
    """Whether this process has the file open by this driver, which then opens it in the same mode only."""
    return paths.identity(path) in [identity for _file, identity in _open()]


def _open() -> list[tuple[weakref.ref[h5py.File], tuple[int, int] | None]]:
    """Return the files that are still open."""
    return [(found, identity) for found, identity in _opened if found()]

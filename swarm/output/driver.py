"""HDF5 files that others in this process have open too.

In one process HDF5 allows one setting of locks, and one of reading or writing, for a file and a driver, and other code
may have opened the file with another. The logging driver reads and writes like the default one, logs nothing by
default, and is rarely used: what others have opened by the default one does not matter to it.
"""

import contextlib
import os
from pathlib import Path
from typing import Any

import h5py

from . import paths

NAME = "swarm"


def _driver(plist: Any, **_options: Any) -> None:
    plist.set_fapl_log(b"", 0, 0)


h5py.register_driver(NAME, _driver)


def opened(path: Path, mode: str, **options: Any) -> h5py.File:
    """Open a file to write it."""
    try:
        return h5py.File(path, mode, driver=NAME, **options)
    except OSError:
        # A reader of swarm has it open by this driver.
        return h5py.File(path, mode, **options)


def has_open(path: Path) -> bool:
    """Whether this process has the file open by this driver: by it, it could only be opened as it was then."""
    wanted = paths.identity(path)
    for file in h5py.h5f.get_obj_ids(types=h5py.h5f.OBJ_FILE):
        # Another thread may close it.
        with contextlib.suppress(OSError, RuntimeError, ValueError):
            if file.get_access_plist().get_driver() == h5py.h5fd.LOG:
                status = os.fstat(file.get_vfd_handle())
                if (status.st_dev, status.st_ino) == wanted:
                    return True
    return False

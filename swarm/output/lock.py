"""One run at a time writes a trajectory: a lock file beside it, whose lock goes with the process that holds it."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from ..errors import FileError


@contextlib.contextmanager
def only_writer(trajectory: Path) -> Iterator[None]:
    """Hold the lock of a trajectory.

    The lock is that of a file beside it: one of the trajectory itself would shut readers out. What a killed run leaves
    of it locks nobody out.

    Raises:
        FileError: another run holds it, or its file cannot be made.
    """
    path = trajectory.with_name(trajectory.name + ".lock")
    try:
        handle = _locked(path)
    except BlockingIOError as error:
        raise FileError(
            f"the trajectory {trajectory} is being written by another run; wait until that has ended, or choose "
            "another name"
        ) from error
    except OSError as error:
        raise FileError(f"cannot write the trajectory {trajectory}: {error}") from error
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(handle)


def _locked(path: Path) -> int:
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # The run before may have removed it between these two lines.
            if os.path.exists(path) and os.path.samestat(os.fstat(handle), os.stat(path)):
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)

"""Locks: only one run writes a file. The system releases the lock of a file beside it when a process ends."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from ..errors import FileError
from . import paths


@contextlib.contextmanager
def only_writer(target: Path, what: str = "trajectory", patience: float = 0.0) -> Iterator[None]:
    """Hold the lock of a file that a run writes; wait for it up to `patience` [s].

    A file beside it is locked, since a lock on the file itself would block readers. A lock file left by a
    killed run blocks no later run.

    Raises:
        FileError: another run holds it, or its file cannot be made.
    """
    import filelock

    path = paths.lock_of(target)
    lock = filelock.FileLock(path, timeout=patience)
    try:
        lock.acquire()
    except filelock.Timeout as error:
        if not path.exists():  # filelock reports a file that cannot be created as locked
            raise FileError(f"cannot write the {what} {target}: no file can be made in that folder") from error
        raise FileError(
            f"the {what} {target} is being written by another run; wait until that has ended, or choose another name"
        ) from error
    except OSError as error:
        raise FileError(f"cannot write the {what} {target}: {error}") from error
    try:
        yield
    finally:
        # Removed while locked: a process that waits for it notices that its name is gone, and opens a new one. Windows
        # cannot remove an open file: there filelock removes it later.
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
        lock.release()


def is_written(target: Path) -> bool:
    """Whether a run writes this file now and holds the lock beside it."""
    lock = paths.lock_of(target)
    if not lock.exists():
        return False
    import filelock

    try:
        with filelock.FileLock(lock, timeout=0.0):
            return False
    except (filelock.Timeout, OSError):
        return True

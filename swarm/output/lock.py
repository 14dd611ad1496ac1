"""One run at a time writes a trajectory: a lock file beside it, whose lock goes with the process that holds it."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from ..errors import FileError
from . import paths


@contextlib.contextmanager
def only_writer(trajectory: Path) -> Iterator[None]:
    """Hold the lock of a trajectory.

    The lock is that of a file beside it: one of the trajectory itself would shut readers out. What a killed run leaves
    of it locks nobody out.

    Raises:
        FileError: another run holds it, or its file cannot be made.
    """
    import filelock

    path = paths.lock_of(trajectory)
    lock = filelock.FileLock(path, blocking=False)
    try:
        lock.acquire()
    except filelock.Timeout as error:
        if not path.exists():  # what no file can be made of looks to filelock like one that comes and goes
            raise FileError(f"cannot write the trajectory {trajectory}: no file can be made in that folder") from error
        raise FileError(
            f"the trajectory {trajectory} is being written by another run; wait until that has ended, or choose "
            "another name"
        ) from error
    except OSError as error:
        raise FileError(f"cannot write the trajectory {trajectory}: {error}") from error
    try:
        yield
    finally:
        # While it is held: whoever opened the file before sees that it has no name any more, and opens the next one.
        # Where a file in use keeps its name, as on Windows, filelock removes it.
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
        lock.release()

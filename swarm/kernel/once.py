"""One process at a time: locks of names in the folder of kernels, which the system releases when a process dies."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

# No compilation takes this long [s]: a lock that lasts is one of a disk without locks. Two processes that compile the
# same kernel are slower, but not wrong.
_LONGEST = 300.0
# The interval at which a waiting process looks [s]; a compilation takes seconds.
_GLANCE = 0.05


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """Hold the lock of a file; without it if the folder is read-only, or its disk has no locks."""
    import filelock

    lock = filelock.FileLock(path, timeout=_LONGEST)
    with contextlib.suppress(OSError, NotImplementedError):  # among the first: filelock.Timeout
        lock.acquire(poll_interval=_GLANCE)
    try:
        yield
    finally:
        if lock.is_locked:
            # Removed while locked: a process that has the file open notices that its name is gone, and makes a new one.
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
            lock.release()

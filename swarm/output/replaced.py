"""Files that are replaced as a whole: the old one stays until the new one is completely on the disk."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from ..errors import FileError, SwarmError
from . import paths


@contextlib.contextmanager
def replaced(path: Path, what: str) -> Iterator[IO[bytes]]:
    """A file to write in place of `path`, which takes its name at the end.

    Raises:
        FileError: it cannot be written.
    """
    part = paths.part_of(path)
    try:
        with open(part, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
        if os.name == "posix":  # other systems cannot open folders
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise FileError(f"cannot write the {what} {path}: {error}; the previous {what} is unchanged") from error


@contextlib.contextmanager
def named_when_whole(target: Path) -> Iterator[Path]:
    """The name under which others write a file, which gets its own when it is whole, and is removed if it never is.

    Raises:
        FileError: it cannot be written.
    """
    part = paths.part_of(target)
    try:
        yield part
        os.replace(part, target)
    except SwarmError:
        raise
    except (OSError, RuntimeError) as error:
        raise FileError(f"cannot write {target}: {error}") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink()

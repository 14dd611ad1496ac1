"""Files that are replaced as a whole: the old one stays until the new one is completely on the disk."""

import contextlib
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

from ..errors import FileError, SwarmError
from . import paths
from .sources import cause

# Bytes that are enough to tell whether a disk is full.
_BLOCK = 1 << 16


def no_room(path: Path | None, room: int = _BLOCK) -> str:
    """The system's message if `room` more bytes cannot be written to a file, which libraries do not report; else ""."""
    if path is None:
        return ""
    try:
        with open(path, "ab", buffering=0) as file:
            size, left = file.tell(), room
            try:
                while left > 0:  # the first write may be in part
                    left -= file.write(bytes(min(left, _BLOCK)))
            finally:
                file.truncate(size)
    except OSError as error:
        return cause(error)
    return ""


@contextlib.contextmanager
def replaced(path: Path, what: str) -> Iterator[IO[bytes]]:
    """Open a file that replaces `path` at the end of the context.

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
        left = f"; the previous {what} is unchanged" * path.exists()
        raise FileError(f"cannot write the {what} {path}: {cause(error)}{left}") from error


@contextlib.contextmanager
def together(target: Path, files: Sequence[Path], stale: Sequence[Path] = ()) -> Iterator[list[Path]]:
    """Return temporary names for files, which get their own names when all are complete, and are removed on an error.

    They are in a hidden folder beside `target`, which a killed process leaves and the next one removes. At the end the
    old files of these names, and the `stale` ones, are replaced.

    Raises:
        FileError: they cannot be written; the old files are kept.
    """
    folder = paths.part_of(target)
    parts = [folder / one.name for one in files]
    try:
        _remove(folder)
        folder.mkdir()
        yield parts
        if len(files) == 1 and not stale:
            os.replace(parts[0], files[0])
        else:
            _exchange(parts, files, [one for one in (*files, *stale) if one.exists()], folder)
    except SwarmError:
        raise
    except (OSError, RuntimeError) as error:
        # Errors of HDF5 and gsd do not always state the cause.
        begun = next((one for one in reversed(parts) if one.is_file()), None)
        full = "" if getattr(error, "errno", None) else no_room(begun)
        raise FileError(f"cannot write {target}: {full or cause(error)}") from error
    finally:
        with contextlib.suppress(OSError):
            _remove(folder)


@contextlib.contextmanager
def named_when_whole(target: Path) -> Iterator[Path]:
    """Return a temporary name for one file; see `together`."""
    with together(target, [target]) as (part,):
        yield part


def _remove(folder: Path) -> None:
    if folder.is_dir():
        shutil.rmtree(folder)
    else:
        folder.unlink(missing_ok=True)


def _exchange(parts: Sequence[Path], files: Sequence[Path], old: Sequence[Path], folder: Path) -> None:
    """Give files their names after the old ones are set aside; on an error no file changes.

    The last file gets its name first. If the process is killed meanwhile, a sequence lacks its beginning, and no file
    in the middle.
    """
    aside = folder / "old"
    aside.mkdir()
    try:
        for one in old:
            os.replace(one, aside / one.name)
        for part, one in reversed(list(zip(parts, files, strict=True))):
            os.replace(part, one)
    except BaseException:
        for part, one in zip(parts, files, strict=True):
            if not part.exists() and one.exists():
                one.unlink()
        for one in old:
            if (aside / one.name).exists():
                os.replace(aside / one.name, one)
        raise

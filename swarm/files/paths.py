"""Names of the files of a run, and checks that a path can become a file."""

import os
import stat
from pathlib import Path
from typing import Any

from ..common.checks import path_of, require_short
from ..common.links import SHARDS
from ..errors import SceneError

# Part of the names of temporary files, which no other program uses.
_OURS = "swarm-"


def target_of(name: str, value: Any) -> Path:
    """Return the argument `name` as the path of a file to write, with a symbolic link resolved.

    Raises:
        SceneError: it is not a path.
    """
    path = path_of(name, value)
    return path.resolve() if path.is_symlink() else path


def target_of_run(name: str, value: Any) -> Path:
    """Return `target_of` for a run, which has files of longer names beside it.

    Raises:
        SceneError: it is not a path, or a name is too long for the system.
    """
    path = target_of(name, value)
    require_short(name, path, part_of(checkpoint_of(path)))
    return path


def checkpoint_of(trajectory: Path) -> Path:
    """The checkpoint of a trajectory."""
    return trajectory.with_name(trajectory.name + ".checkpoint")


def shards_of(trajectory: Path) -> Path:
    """The folder of the shards of a trajectory that was run on a cluster."""
    return trajectory.with_suffix(SHARDS)


def is_temporary(name: str) -> bool:
    """Whether a file name is that of a temporary file of swarm."""
    return name.startswith(".") and f".{_OURS}" in name


def lock_of(path: Path) -> Path:
    """The lock file that a run holds while it writes a file."""
    return path.with_name(f".{path.name}.{_OURS}lock")


def part_of(path: Path) -> Path:
    """The name of a file until it is complete."""
    return path.with_name(f".{path.name}.{_OURS}part{path.suffix}")


def is_file(path: Path) -> bool:
    """Whether a path is a file; a text that cannot be the name of one is not."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def identity(path: Path) -> tuple[int, int] | None:
    """Device and inode, which differ for another file of the same name; None if there is no file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def check_place(path: Path, what: str) -> None:
    """Raise a SceneError if no file can be at `path`: its folder does not exist, or it is no regular file."""
    try:
        if not path.parent.is_dir():
            raise SceneError(f"{what}: the folder {path.parent} does not exist; create it first")
        there = path.stat()
    except FileNotFoundError:
        return
    except OSError as error:
        raise SceneError(f"{what}: expected the name of a file, got {str(path)!r:.200}: {error.strerror}") from None
    if stat.S_ISDIR(there.st_mode):
        raise SceneError(f"{what}: expected a file name, got the folder {path}")
    if not stat.S_ISREG(there.st_mode):
        raise SceneError(f"{what}: expected a file name, got {path}, which is a device or a pipe")


def check_distinct(outputs: dict[str, Path | None], inputs: dict[str, Path | None]) -> None:
    """Raise a SceneError if an output is an input, or two outputs are the same file; the keys name the files."""
    seen = [(what, path) for what, path in inputs.items() if path is not None]
    for what, path in ((what, path) for what, path in outputs.items() if path is not None):
        for other, there in seen:
            if _same(path, there):
                raise SceneError(f"{what}: {path} is also the {other}; choose another name for one of them")
        seen.append((what, path))


def _same(one: Path, other: Path) -> bool:
    if one.exists() and other.exists():
        return os.path.samefile(one, other)
    return os.path.normcase(os.path.realpath(one)) == os.path.normcase(os.path.realpath(other))

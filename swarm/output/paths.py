"""Names of the files of a run, and checks that a path can become a file."""

import errno
import os
import stat
from pathlib import Path
from typing import Any

from ..checks import flag, shown
from ..errors import SceneError

# Part of the names of temporary files, which no other program uses.
_OURS = "swarm-"
# Of the folder of shards.
SHARDS = ".shards"
_ALLOW = "overwrite it (--overwrite, overwrite=True)"


def given(name: str, value: Any) -> Path:
    """The argument `name` as the path of a file.

    Raises:
        SceneError: it is not a path, or it is empty.
    """
    text = os.fspath(value) if isinstance(value, (str, os.PathLike)) else value
    if not isinstance(text, str) or not text or "\0" in text:
        raise SceneError(f"{name} must be the path of a file, got {shown(text)}")
    path = Path(text)
    _require_short(name, path, path)
    return path


def target_of(name: str, value: Any) -> Path:
    """The argument `name` as the path of a file to write: a symbolic link is resolved.

    Raises:
        SceneError: it is not a path.
    """
    path = given(name, value)
    return path.resolve() if path.is_symlink() else path


def target_of_run(name: str, value: Any) -> Path:
    """As `target_of`, for a run, which has files of longer names beside it.

    Raises:
        SceneError: it is not a path, or a name is too long for the system.
    """
    path = target_of(name, value)
    _require_short(name, path, part_of(checkpoint_of(path)))
    return path


def _require_short(name: str, path: Path, longest: Path) -> None:
    """Raise a SceneError if the system finds the name of a file too long."""
    try:
        os.lstat(longest)
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            raise SceneError(
                f"{name} must be the path of a file, got one of {len(str(path))} characters, which is too long for "
                f"this system, {path!s:.40}...; choose a shorter name"
            ) from None


def checkpoint_of(trajectory: Path) -> Path:
    """The checkpoint of a trajectory."""
    return trajectory.with_name(trajectory.name + ".checkpoint")


def shards_of(trajectory: Path) -> Path:
    """The folder of the shards of a trajectory that was run on a cluster."""
    return trajectory.with_suffix(SHARDS)


def is_temporary(name: str) -> bool:
    """Whether a file of this name is one that swarm has made for as long as it runs."""
    return name.startswith(".") and f".{_OURS}" in name


def lock_of(path: Path) -> Path:
    """The file whose lock a run holds while it writes another."""
    return path.with_name(f".{path.name}.{_OURS}lock")


def part_of(path: Path) -> Path:
    """The name of a file until it is complete."""
    return path.with_name(f".{path.name}.{_OURS}part{path.suffix}")


def is_file(path: Path) -> bool:
    """Whether there is a file; also of a text that cannot be the name of one."""
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


def check_target(path: Path, overwrite: bool, what: str = "trajectory", allow: str = _ALLOW) -> None:
    """Raise a SceneError if `path` cannot become a new file, or replace the one that is there.

    A file is replaced only by one of its own kind, which its content says.

    Args:
        path: the file.
        overwrite: whether an existing file may be replaced.
        what: the output; `marks` knows the kind of each.
        allow: how an existing file may be replaced, for the sentence.
    """
    overwrite = flag("overwrite", overwrite)
    check_place(path, what)
    if path.exists() and not overwrite:
        stopped = what == "trajectory" and checkpoint_of(path).exists()
        on = ", or go on with it, which was stopped (--resume, resume=True)" if stopped else ""
        raise SceneError(f"{what}: {path} exists; choose another name, or {allow}{on}")
    if path.exists():
        require_own(path, what)


def check_place(path: Path, what: str) -> None:
    """Raise a SceneError if no file can be at `path`: its folder is not there, or something else is."""
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


def require_own(path: Path, what: str) -> None:
    """Raise a SceneError if the file at `path` is not of the kind that `what` replaces."""
    from . import marks

    kind = marks.why_not(path, what)
    if kind is not None:
        raise SceneError(
            f"{what}: {path} is not {kind}, and only such a file is overwritten; choose another name, or move that "
            "file away"
        )


def check_distinct(outputs: dict[str, Path | None], inputs: dict[str, Path | None]) -> None:
    """Raise a SceneError if an output is an input, or two outputs are the same file; the keys say what each is."""
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

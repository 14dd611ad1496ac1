"""Names of the files of a run, and checks that a path can become a file."""

import os
from pathlib import Path
from typing import Any

from ..errors import SceneError

# Part of the names of temporary files, which no other program uses.
_OURS = "swarm-"


def given(name: str, value: Any) -> Path:
    """The argument `name` as the path of a file.

    Raises:
        SceneError: it is not a path, or it is empty.
    """
    text = os.fspath(value) if isinstance(value, (str, os.PathLike)) else value
    if not isinstance(text, str) or not text or "\0" in text:
        raise SceneError(f"{name} must be the path of a file, got {text!r}")
    return Path(text)


def target_of(name: str, value: Any) -> Path:
    """The argument `name` as the path of a file to write: a symbolic link is resolved."""
    path = given(name, value)
    return path.resolve() if path.is_symlink() else path


def checkpoint_of(trajectory: Path) -> Path:
    """The checkpoint of a trajectory."""
    return trajectory.with_name(trajectory.name + ".checkpoint")


def lock_of(path: Path) -> Path:
    """The file whose lock a run holds while it writes another."""
    return path.with_name(f".{path.name}.{_OURS}lock")


def part_of(path: Path) -> Path:
    """The name of a file until it is complete."""
    return path.with_name(f".{path.name}.{_OURS}part{path.suffix}")


def identity(path: Path) -> tuple[int, int] | None:
    """Device and inode, which differ for another file of the same name; None if there is no file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def check_target(path: Path, overwrite: bool, what: str = "trajectory") -> None:
    """Raise a SceneError if `path` cannot become a new file."""
    if not path.parent.is_dir():
        raise SceneError(f"{what}: the folder {path.parent} does not exist; create it first")
    if path.is_dir():
        raise SceneError(f"{what}: expected a file name, got the folder {path}")
    if path.exists() and not path.is_file():
        raise SceneError(f"{what}: expected a file name, got {path}, which is a device or a pipe")
    if path.exists() and not overwrite:
        stopped = what == "trajectory" and checkpoint_of(path).exists()
        on = ", or go on with it, which was stopped (--resume, resume=True)" if stopped else ""
        raise SceneError(
            f"{what}: {path} exists; choose another name, or overwrite it (--overwrite, overwrite=True){on}"
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

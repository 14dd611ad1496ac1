"""Errors of input files that are missing, of another kind or damaged."""

import errno
import os
import re
import stat
from pathlib import Path

from ..errors import SceneError

# Exceptions that h5py, NumPy, tomllib, msgspec and swarm itself raise for a damaged file. KeyError and IndexError are
# LookupErrors; SceneError, UnicodeDecodeError and TOMLDecodeError are ValueErrors; RecursionError is a
# RuntimeError.
DAMAGE = (OSError, RuntimeError, ValueError, LookupError, TypeError, ArithmeticError, MemoryError)

# The system's messages for a full disk, and for a full quota of a user.
_FULL = {os.strerror(number) for number in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))}


# The commands that take files of a suffix, and those for the folder of a sweep.
_COMMANDS = {
    ".toml": "swarm check says what a scene file will do, and swarm run carries it out",
    ".h5": "swarm info says what a trajectory holds, swarm plot draws it, and swarm record makes its recording",
    ".rrd": "swarm view draws a recording, and swarm info says what it holds",
}
_OF_SWEEPS = "swarm report makes the page of a sweep, and its trajectories are in the folder"


class DamagedError(SceneError):
    """A damaged file."""


def commands_for(path: Path, needed: str = "") -> str:
    """The end of a sentence about a path without the suffix `needed`: the command that takes it, or ""."""
    suffix = path.suffix.lower()
    words = "" if suffix == needed else _COMMANDS.get(suffix, "")
    if path.is_dir():
        is_sweep = any((path / name).is_file() for name in ("sweep.toml", "results.csv", "results.parquet"))
        words = _OF_SWEEPS if is_sweep else ""
    return f"; {words}" if words else ""


def require_file(path: Path, expected: str) -> None:
    """Raise a SceneError unless the path is a regular file that is not empty."""
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise SceneError(f"there is no file {path}; expected {expected}") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from error
    if stat.S_ISDIR(found.st_mode):
        raise SceneError(f"{path} is a folder; expected {expected}{commands_for(path)}")
    if not stat.S_ISREG(found.st_mode):
        raise SceneError(f"{path} is not a regular file; expected {expected}")
    if found.st_size == 0:
        raise SceneError(f"{path} is empty; expected {expected}")


def cause(error: BaseException) -> str:
    """The system's message about a file that cannot be written, without names of parts and texts of HDF5."""
    messages = re.findall(r"error message = '([^']*)'", str(error))
    number = getattr(error, "errno", None)
    message = os.strerror(number) if number else messages[-1] if messages else reason(error)
    return f"{message}; make room there" if message in _FULL else message


def reason(error: BaseException | None) -> str:
    """The message of an error in one line, without the name of the HDF5 function."""
    message = str(error.args[0]) if isinstance(error, LookupError) and error.args else str(error)
    message = next(iter(message.strip().splitlines()), "") or type(error).__name__
    for pattern in (r".*error message = '([^']*)'.*", r"(?:Unable to|Can't|Link|Object)[^(]*\((.*)\)"):
        found = re.fullmatch(pattern, message)
        message = found.group(1) if found else message
    return message

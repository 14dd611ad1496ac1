"""Files that are read: what is said of a path with no such file, and of what HDF5 and others say of a damaged one."""

import re
import stat
from pathlib import Path

from ..errors import SceneError

# What h5py, NumPy, tomllib, msgspec and swarm itself raise when they read what nobody wrote. KeyError and IndexError
# are LookupErrors; SceneError, UnicodeDecodeError and TOMLDecodeError are ValueErrors; RecursionError is a
# RuntimeError.
DAMAGE = (OSError, RuntimeError, ValueError, LookupError, TypeError, ArithmeticError, MemoryError)


class DamagedError(SceneError):
    """A file that is not as it was written."""


def require_file(path: Path, expected: str) -> None:
    """Raise a SceneError if there is no file, nothing in it, or something else."""
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise SceneError(f"there is no file {path}; expected {expected}") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from error
    if stat.S_ISDIR(found.st_mode):
        raise SceneError(f"{path} is a folder; expected {expected}")
    if not stat.S_ISREG(found.st_mode):
        raise SceneError(f"{path} is no regular file; expected {expected}")
    if found.st_size == 0:
        raise SceneError(f"{path} is empty; expected {expected}")


def reason(error: BaseException | None) -> str:
    """What an error says, in one line, without the function of HDF5 that it is from."""
    told = str(error.args[0]) if isinstance(error, LookupError) and error.args else str(error)
    told = next(iter(told.strip().splitlines()), "") or type(error).__name__
    for pattern in (r".*error message = '([^']*)'.*", r"(?:Unable to|Can't|Link|Object)[^(]*\((.*)\)"):
        found = re.fullmatch(pattern, told)
        told = found.group(1) if found else told
    return told

"""Text files that commands write: whole or not at all; one is replaced by its own kind alone, where the caller says."""

from pathlib import Path

from ..files import marks, paths
from ..files.replaced import replaced


def write_text(what: str, path: Path, text: str, overwrite: bool = False) -> Path:
    """Write a text file, and return its path.

    Raises:
        SceneError: it exists and may not be replaced, or no file can be there.
        FileError: it cannot be written.
    """
    target = paths.target_of(what, path)
    marks.check_target(target, overwrite, what)
    with replaced(target, what) as file:
        file.write(text.encode())
    return target

"""Scene files to begin with: short ones with comments, one for each field."""

from pathlib import Path

from ..common.checks import one_of
from ..files import marks

_FOLDER = Path(__file__).parent / "scenes"
KINDS = tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def text_of(kind: str) -> str:
    """The text of a scene file to begin with.

    Raises:
        SceneError: there is no such kind.

    >>> text_of("gas").splitlines()[0]
    '# A gas of hard spheres in a cell that repeats without end: they collide elastically, and nothing is lost.'
    """
    return (_FOLDER / f"{one_of('kind', kind, KINDS)}.toml").read_text("utf-8")


def begin(kind: str, path: Path | None = None) -> Path:
    """Write a scene file to begin with, KIND.toml in the current folder or another new file; return its path."""
    text = text_of(kind)
    return marks.write(Path(f"{kind}.toml") if path is None else path, text.encode(), "scene file")

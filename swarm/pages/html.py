"""Pages in HTML: one file each, with its own pictures and style, that a browser shows without a network."""

import functools
import html
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from markupsafe import Markup

from ..common.checks import flag
from ..errors import SceneError
from ..files import marks, paths
from ..version import VERSION

_HERE = Path(__file__).parent
_SUFFIXES = (".html", ".htm")
# The height of a page in a notebook [pixels].
_HEIGHT = 800


@dataclass(frozen=True)
class Page:
    """A report, which a notebook shows where it is the last line of a cell.

    Attributes:
        title: the title of the page.
        html: the page itself, as text.
        sources: its source files, which it cannot replace.
    """

    title: str
    html: str = field(repr=False)
    sources: tuple[Path, ...] = field(default=(), repr=False)

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the page to a file.

        Args:
            path: `.html`.
            overwrite: replace an existing file.

        Returns:
            The path. The file has this name when it is complete.

        Raises:
            SceneError: the name has another suffix, or the file exists.
            FileError: the file cannot be written.
        """
        return marks.write(checked_target(path, overwrite, self.sources), self.html.encode(), "report", overwrite)

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {_HEIGHT}px; border: 1px solid #8A8A8A; border-radius: 6px"
        return f'<iframe style="{style}" sandbox="allow-scripts" srcdoc="{html.escape(self.html)}"></iframe>'


def checked_target(path: Any, overwrite: bool, sources: tuple[Path, ...]) -> Path:
    """Return the file of a report; raise a SceneError if it cannot be written there."""
    flag("overwrite", overwrite)
    target = paths.target_of("report", path)
    if target.suffix.lower() not in _SUFFIXES:
        raise SceneError(f"report: expected a file name that ends in .html, got {target}")
    paths.check_distinct({"report": target}, {f"{source.name} that it is of": source for source in sources})
    marks.check_target(target, overwrite, "report")
    return target


def written(made: Callable[[], Page], path: Any, overwrite: bool, sources: tuple[Path, ...]) -> Page:
    """Make a page, and write it if a path is given, which is checked first."""
    flag("overwrite", overwrite)
    if path is not None:
        checked_target(path, overwrite, sources)
    page = made()
    if path is not None:
        page.save(path, overwrite=overwrite)
    return page


def filled(template: str, **content: Any) -> str:
    """Return a template with its content; a value that is no `Markup` is text, and is escaped."""
    return str(_environment().get_template(template).render(version=VERSION, **content))


@functools.cache
def _environment() -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    # The page's own style and script, unescaped.
    made.globals["own"] = lambda name: Markup((_HERE / name).read_text(encoding="utf-8"))
    # A name may be broken after a dot and an underscore.
    made.globals["breakable"] = lambda name: Markup("<wbr>").join(re.split(r"(?<=[._])", name))
    return made

"""Every picture that a page shows is there, and examples and benchmarks take their look from one place."""

import re
import struct
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted({*ROOT.glob("**/README.md"), *ROOT.glob("examples/**/*.md")})
SOURCES = sorted(path for folder in ("examples", "bench") for path in (ROOT / folder).rglob("*.py"))
PICTURES = sorted(path for folder in ("examples", "bench") for path in (ROOT / folder).rglob("*.png"))
# What of matplotlib makes a look of its own: its styles, pyplot, named colours, shades of grey, and colours in digits.
OWN_LOOK = re.compile(
    r'rcParams|rc_context|pyplot|mplstyle|"tab:|"#[0-9A-Fa-f]{6}"|color="(C\d|black|grey|gray|0?\.\d+|[rgbk])"|cmap="'
)


def shown(page):
    """The files that a page shows as pictures."""
    return [page.parent / name for name in re.findall(r"!\[[^\]]*\]\(([^):]+\.png)\)", page.read_text())]


def test_what_is_shown_is_there():
    pictures = [path for page in PAGES for path in shown(page)]
    assert len(pictures) > 30
    assert [str(path) for path in pictures if not path.is_file()] == []


def test_pictures_of_examples_are_shown():
    """One that no page shows has no caption."""
    seen = {path.resolve() for page in PAGES for path in shown(page)}
    assert [path.name for path in (ROOT / "examples").glob("*.png") if path.resolve() not in seen] == []


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_look_is_that_of_the_package(path):
    found = [match.group(0) for match in OWN_LOOK.finditer(path.read_text())]
    assert found == []


def test_pictures_are_for_a_page():
    """Their width is that of a page at one or two dots a pixel, and their files are small."""
    for path in PICTURES:
        head = path.read_bytes()[:24]
        width, _height = struct.unpack(">2I", head[16:24])
        assert 800 <= width <= 1650, path
        assert path.stat().st_size < 180_000, path

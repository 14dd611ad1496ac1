"""The pictures of a report: graphs as SVG in the colours of the page, particles among their walls as PNG."""

import base64
import hashlib
import io
import re
from typing import Any, NamedTuple

from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.text import Text

from ..pictures import plots, style
from ..pictures.drawn import Drawn
from ..words.amounts import amount, many
from ..words.content import Content

# Sizes of a graph and of a picture of particles [inches]; pixels an inch and the number of particles of the latter.
_GRAPH, _PLACES, _DPI, _SHOWN = (5.0, 2.8), (4.4, 3.15), 240, 5000
# Larger graphs [characters of SVG], those of very many frames, are PNG, so that a page stays small.
_LARGEST = 120_000
# Colours of the light style -> the colours of the page that replace them.
_COLOURS = {"#222222": "var(--ink)", "#8a8a8a": "var(--faint)", "#e6e6e6": "var(--grid)", "#ffffff": "var(--card)"}


class PagePicture(NamedTuple):
    """A picture, its content in words, and whether it is wide."""

    picture: Markup
    caption: str
    wide: bool = False


def of_places(content: Content) -> list[PagePicture]:
    """The particles, or bodies, among their walls, at the start and at the end, if they are kept."""
    times, found = content.seen["time"], []
    for name, k in (("start", 0), ("end", -1)):
        if name in content.frames:
            moment = amount(float(times[k]), "s")
            picture = _png(lambda dark, name=name, k=k: _placed(content, name, k, dark), f"particles at {moment}")
            found.append(PagePicture(picture, f"At the {name}, {moment}{_how_many(content, name)}"))
    return found


def _how_many(content: Content, name: str) -> str:
    """The number of drawn particles, or bodies, of a frame, if it is not that of all."""
    drawn = Drawn(len(content.frames[name]), content.body, _SHOWN)
    if drawn.shown == drawn.count:
        return ""
    return f": {many(drawn.shown)} of {many(drawn.count)} {drawn.noun} are drawn"


def _placed(content: Content, name: str, k: int, dark: bool) -> Any:
    """A figure of the particles of a frame."""
    figure = plots.picture_of_places(content, name, plots.walls_of(content, k), _PLACES, _SHOWN)
    for text in figure.findobj(Text) if dark else ():
        text.set_color(style.ink())  # its grey is meant for a light background
    return figure


def of_series(content: Content) -> list[PagePicture]:
    """The informative time series, a graph each, and the speeds."""
    found = []
    for title, draw in plots.graphs_of(content):
        with style.applied():
            figure = style.picture(*_GRAPH)
            draw(figure.subplots())
            found.append(PagePicture(svg(figure, title), ""))
    return found


def svg(figure: Any, description: str) -> Markup:
    """A figure in the light style as SVG in the colours of the page; `description` is its text for screen readers."""
    buffer = io.StringIO()
    with style.applied(), rc_context({"svg.hashsalt": "swarm"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None}, transparent=False)
    text = buffer.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    if len(text) > _LARGEST:
        return _png(lambda dark: figure, description, variants=False)
    for colour, name in _COLOURS.items():
        text = re.sub(colour, name, text, flags=re.IGNORECASE)
    # Names are unique among all pictures of a page.
    mine = f"g{hashlib.sha256((description + text).encode()).hexdigest()[:12]}-"
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{mine}", text)
    head = re.search(r'viewBox="[^"]*"', text)
    body = text[text.index(">") + 1 :]
    label = Markup('<svg role="img" aria-label="{}" {} xmlns:xlink="http://www.w3.org/1999/xlink">').format(
        description, Markup(head.group() if head else "")
    )
    return label + Markup(body)


def _png(make: Any, description: str, variants: bool = True) -> Markup:
    """A figure as PNG, light and dark; `make` draws it in the current style."""
    data = []
    for dark in (False, True) if variants else (False,):
        buffer = io.BytesIO()
        with style.applied(dark):
            make(dark).savefig(buffer, format="png", dpi=_DPI)
        data.append(base64.b64encode(_smaller(buffer)).decode())
    image = Markup('<img alt="{}" src="data:image/png;base64,{}">').format(description, data[0])
    if not variants:
        return image
    source = Markup('<source media="(prefers-color-scheme: dark)" srcset="data:image/png;base64,{}">').format(data[1])
    return Markup("<picture>") + source + image + Markup("</picture>")


def _smaller(buffer: io.BytesIO) -> bytes:
    """The PNG, with 256 colours if that is smaller."""
    from PIL import Image  # which matplotlib brings

    whole, made = buffer.getvalue(), io.BytesIO()
    Image.open(buffer).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(made, "PNG", optimize=True)
    return min(whole, made.getvalue(), key=len)

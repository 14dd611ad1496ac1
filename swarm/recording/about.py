"""The part of a recording that says what it shows: in words, and as values that pictures are made with."""

from typing import Any

import rerun as rr

from ..pictures import series
from ..pictures.colours import Scale
from ..pictures.drawn import Drawn
from ..state import Floats
from ..words import titles as words
from ..words import verdicts
from ..words.amounts import many
from ..words.content import Content

_PATH = "/about"


def log_about(stream: Any, drawn: Drawn, scale: Scale, stride: int, center: Floats, plane: str | None = None) -> None:
    """Log the meaning of the colours, what is shown of how many, the origin, and the plane of two dimensions."""
    of = f" of {many(drawn.count)}" if drawn.shown < drawn.count else ""
    every = f", every {stride}th frame" if stride > 1 else ""
    name, _, unit = scale.quantity.rstrip("]").partition(" [")
    text = (
        f"**{many(drawn.shown)}{of} {drawn.noun}{every}**, coloured by {name}: {scale.low:g} (dark blue) to "
        f"{scale.high:g} {unit}".rstrip()
        + f" (orange). log10 of 0 is drawn at {series.NOTHING:g}."
    )
    if center.any():
        text += f" Positions are less {tuple(center.tolist())} m."
        stream.log(_PATH, rr.AnyValues(center=center), static=True)
    if plane is not None:
        stream.log(_PATH, rr.AnyValues(plane=plane), static=True)
    stream.log(_PATH, rr.TextDocument(text, media_type="text/markdown"), static=True)
    values = rr.AnyValues(**vars(scale), particles=drawn.count, shown=drawn.shown, stride=stride, noun=drawn.noun)
    stream.log(_PATH, values, static=True)


def log_outcome(stream: Any, content: Content) -> None:
    """Log the run in words, and whether it went well, when it has ended."""
    stream.log(_PATH, rr.AnyValues(title=words.title(content), verdicts=verdicts.marked(content)), static=True)

"""The look of every picture: one style of matplotlib, and one meaning for each colour.

`look.mplstyle` has fonts and sizes; scripts take it by `pyplot.style.use("swarm.pictures.look")`.
"""

import contextlib
import io
from collections.abc import Iterator

import matplotlib as mpl
from matplotlib import style
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure

from . import colours
from .colours import BLUE, CAVITY, CAVITY_LINE, CURVES, ENERGIES, GREEN, ORANGE, PINK, RED, SKY, SOLID, SOLID_LINE

__all__ = [
    "BLUE", "CAVITY", "CAVITY_LINE", "CURVES", "ENERGIES", "GREEN", "GREY", "MAP", "ORANGE", "PINK", "RED", "SKY",
    "SOLID", "SOLID_LINE", "Picture", "applied", "backdrop", "ink", "picture",
]  # fmt: skip
# Lines that guide the eye: laws beside measurements, limits, bands.
GREY = "#8A8A8A"
# Walls of a cavity on a dark background.
_CAVITY_IN_THE_DARK = "#3A4653"
# Particles by their speed, or another number: from slow to fast.
MAP = ListedColormap(colours.table(), name="swarm")


class Picture(Figure):
    """A figure without pyplot, which would choose a backend, keep the figure, and show it twice in a notebook.

    A notebook shows it where it is the last line of a cell, whether or not the cell has chosen a backend.
    """

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


@contextlib.contextmanager
def applied(dark: bool = False) -> Iterator[None]:
    """Draw and save pictures in this context with the look, on a light or a dark background."""
    names = ["swarm.pictures.look", *["swarm.pictures.dark"] * dark]
    with style.context(["default", *names]):
        yield


def picture(width: float, height: float) -> Picture:
    """An empty picture of this size [inches], to be drawn in `applied`."""
    return Picture(figsize=(width, height), layout="constrained")


def backdrop() -> tuple[str, str]:
    """The current background, and the colour of walls of a cavity on it: a light one would glare on a dark page."""
    paper = str(mpl.rcParams["figure.facecolor"])
    return paper, CAVITY if sum(to_rgb(paper)) > sum(to_rgb(CAVITY_LINE)) else _CAVITY_IN_THE_DARK


def ink() -> str:
    """The colour of text, and of the sum of all, on the current background."""
    return str(mpl.rcParams["text.color"])

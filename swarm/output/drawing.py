"""Drawing with matplotlib for contact sheets, plots and films: particles among their walls."""

from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from ..state import Floats
from . import flat
from .colours import Colours
from .framed import around, eye_of, window
from .scenery import NO_TIES, Scenery, Ties, red_green_blue
from .shape import Shape
from .style import MAP
from .triad import INK

LIGHT = INK


def view(figure: Any, across: int | None, *place: int) -> Any:
    """Axes for particles among their walls, or those of a plane across an axis, seen from above."""
    del across
    return figure.add_subplot(*place)


def frame(
    axes: Any,
    points: Floats,
    packed: Colours,
    shapes: list[Shape],
    lines: Ties = NO_TIES,
    faces: Ties = NO_TIES,
    across: int | None = None,
    radius: Floats | None = None,
) -> "Scenery | None":
    """A frame: particles (N, 3) of colours 0xRRGGBBAA, which bodies with faces do not show, and their ties.

    Lines (S, 2, 3) have colours (S,), triangles (T, 3, 3) those of their corners (T, 3). `across` is the axis across
    the plane of a scene of two dimensions, whose axes are `view`s of it; `radius` of balls (n,) [m].
    """
    if across is not None:
        flat.flat(axes, across, points, red_green_blue(packed), shapes, radius=radius)
        return None
    scenery = Scenery(axes, shapes, around(points, shapes, radius))
    scenery.walls()
    scenery.matter(points, packed, lines, faces, radius)
    scenery.near_lines()
    return scenery


def aspect(shapes: list[Shape], points: Floats, across: int | None) -> float:
    """The width of a picture as a part of its height."""
    found = around(points, shapes)
    if across is not None:
        low, high = flat.ends_in_plane(across, found)
    else:
        low, high = window(eye_of(shapes, found), found)
    return float((high - low)[0] / (high - low)[1])


def colour_bar(
    figure: Any, axes: Any, quantity: str, low: float, high: float, packed: list[Colours] | None = None
) -> None:
    """A colour bar for the particles, below these axes; where all have one colour of it, 0xRRGGBBAA, words."""
    every = np.unique(np.concatenate(packed)) if packed else np.empty(0, np.uint32)
    there = every[every & 0xFF > 0]
    if len(there) == 1:
        far = np.abs(np.asarray(MAP(np.arange(MAP.N)))[:, :3] - red_green_blue(there)).sum(axis=1)
        value = low + (int(far.argmin()) + 0.5) / MAP.N * (high - low)
        name, _, unit = quantity.rstrip("]").partition(" [")
        figure.supxlabel(f"all at one {name}, {value:.2g} {unit}".strip(), fontsize=8.5, color=INK)
        return
    bar = figure.colorbar(
        ScalarMappable(Normalize(low, high), MAP), ax=axes, location="bottom", shrink=0.5, aspect=55, pad=0.01
    )
    bar.set_label(quantity, color=INK, fontsize=8.5)
    bar.outline.set_visible(False)
    bar.ax.tick_params(colors=INK, labelsize=7.5, length=2.0)

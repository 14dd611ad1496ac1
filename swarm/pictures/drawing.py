"""Drawing with matplotlib for contact sheets, plots and films: particles among their walls."""

from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from ..state import Floats
from ..triangles.shape import Shape
from . import flat
from .colours import Colours, named
from .framed import around, eye_of, window
from .scenery import NO_TIES, Scenery, Ties, red_green_blue
from .speeds import are_alike
from .style import MAP
from .triad import INK


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
    """Draw a frame: particles (N, 3) of colours 0xRRGGBBAA, or bodies with faces instead, and their ties.

    Lines (S, 2, 3) have colours (S,), triangles (T, 3, 3) have colours of their corners (T, 3). `across` is the axis
    normal to the plane of a scene of two dimensions; `radius` is that of balls (n,) [m].
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
    """The aspect of a picture, its width over its height."""
    found = around(points, shapes)
    if across is not None:
        low, high = flat.ends_in_plane(across, found)
    else:
        low, high = window(eye_of(shapes, found), found)
    return float((high - low)[0] / (high - low)[1])


def colour_bar(
    figure: Any,
    axes: Any,
    quantity: str,
    low: float,
    high: float,
    packed: list[Colours] | None = None,
    values: Floats | None = None,
) -> None:
    """Draw a colour bar below the axes; words if all particles have one colour, 0xRRGGBBAA; nothing without particles.

    The words describe the `values` of the particles or, if these are not known, the values of the colour.
    """
    every = np.unique(np.concatenate(packed)) if packed else np.empty(0, np.uint32)
    there = every[every & 0xFF > 0]
    if packed and not len(there):
        return
    if len(there) == 1:
        caption = _colour_in_words(quantity, low, high, there) if values is None else _values_in_words(quantity, values)
        figure.supxlabel(caption, fontsize=8.5, color=INK)
        return
    bar = figure.colorbar(
        ScalarMappable(Normalize(low, high), MAP), ax=axes, location="bottom", shrink=0.5, aspect=55, pad=0.01
    )
    bar.set_label(quantity, color=INK, fontsize=8.5)
    bar.outline.set_visible(False)
    bar.ax.tick_params(colors=INK, labelsize=7.5, length=2.0)


def _values_in_words(quantity: str, values: Floats) -> str:
    """The values of particles of one colour, in words; NaN marks absent particles."""
    values = values[~np.isnan(values)]
    least, most = float(values.min()), float(values.max())
    name, unit = named(quantity)
    if name == "speed" and most == 0.0:
        return "at rest" if len(values) == 1 else "all at rest"
    if len(values) == 1:
        return f"{name} {most:.4g} {unit}".strip()
    if are_alike(values):
        return f"all at one {name}, {most:.4g} {unit}".strip()
    return f"all at a {name} from {least:.4g} to {most:.4g} {unit}".strip()


def _colour_in_words(quantity: str, low: float, high: float, colour: Colours) -> str:
    """The values of a colour, in words: those of a step of the scale, or all beyond its end."""
    far = np.abs(np.asarray(MAP(np.arange(MAP.N)))[:, :3] - red_green_blue(colour)).sum(axis=1)
    step = int(far.argmin())
    ends = [f"{low + k / MAP.N * (high - low):.4g}" for k in (step, step + 1)]
    name, unit = named(quantity)
    within = f"of at most {ends[1]}" if step == 0 else f"of at least {ends[0]}"
    text = within if step in (0, MAP.N - 1) else f"from {ends[0]} to {ends[1]}"
    return f"all at a {name} {text} {unit}".strip()

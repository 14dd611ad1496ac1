"""A small triad of axes at a corner of a picture, a bar with a length, and the number of particles beyond it."""

import math
from typing import Any

from matplotlib.text import OffsetFrom
from matplotlib.transforms import ScaledTranslation

from ..words.amounts import amount
from .eye import Eye

INK = "#5a5a62"
# The strip below a picture for them [points]; an arrow, the corner where arrows begin, and letters.
STRIP, _ARROW, _CORNER, _LETTERS = 42.0, 19.0, 15.0, 8.0
# The largest width of the bar, as a part of the picture's.
BAR = 0.28
# Arrows with a shorter projection than this part are not drawn.
_SHORT = 0.15


def round_length(most: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is at most a length."""
    power = 10.0 ** math.floor(math.log10(most))
    return next((k * power for k in (5.0, 2.0) if k * power <= most), power)


def draw_triad(axes: Any, eye: Eye, most: float) -> None:
    """Draw the directions of x, y and z at the lower left corner, and a bar of at most this length [m]."""
    corner = OffsetFrom(axes, (0.0, 0.0), unit="points")
    style = {"arrowstyle": "-|>,head_width=0.14,head_length=0.3", "color": INK, "linewidth": 0.9, "shrinkA": 0.0,
             "shrinkB": 0.0}  # fmt: skip
    for k, name in enumerate("xyz"):
        x, y = float(eye.right[k]), float(eye.up[k])
        if math.hypot(x, y) < _SHORT:
            continue
        ends = [(_CORNER + part * x, _CORNER + part * y) for part in (_ARROW, _ARROW + 6.0)]
        axes.annotate("", ends[0], (_CORNER, _CORNER), xycoords=corner, textcoords=corner, arrowprops=style,
                      annotation_clip=False)  # fmt: skip
        axes.annotate(name, ends[1], xycoords=corner, ha="center", va="center", fontsize=_LETTERS, color=INK,
                      annotation_clip=False)  # fmt: skip
    length = round_length(most)
    scale, right = axes.get_figure(root=True).dpi_scale_trans, float(axes.get_xlim()[1]) - 0.05 * length
    bar = axes.get_xaxis_transform() + ScaledTranslation(0.0, 8.0 / 72.0, scale)
    axes.plot([right - length, right], [0.0, 0.0], transform=bar, color=INK, linewidth=2.0, solid_capstyle="butt",
              clip_on=False)  # fmt: skip
    above = bar + ScaledTranslation(0.0, 3.0 / 72.0, scale)
    axes.text(right - 0.5 * length, 0.0, amount(length, "m"), fontsize=_LETTERS, color=INK, ha="center",
              va="bottom", transform=above, clip_on=False)  # fmt: skip


def say_beyond(axes: Any, outside: int) -> list[Any]:
    """Write in a corner how many particles are beyond a picture, if any are; return the artists."""
    if not outside:
        return []
    words = f"{outside} {'is' if outside == 1 else 'are'} beyond this picture"
    return [axes.text(1.0, 1.0, words, transform=axes.transAxes, ha="right", va="top", fontsize=7.5, color=INK,
                      style="italic", zorder=6)]  # fmt: skip

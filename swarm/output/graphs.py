"""Time series in axes of matplotlib."""

from typing import Any

import numpy as np

from ..state import Floats
from . import series
from .style import CURVES


def lines(axes: Any, view: str, logarithm: bool, drawn: dict[str, tuple[Floats, Floats]]) -> None:
    """The time series of one plot, by their names: (times [s], values). Rates have no value at the first frame."""
    axes.set_title(view, fontsize=10)
    if not any(len(times) for times, _values in drawn.values()):
        axes.text(0.5, 0.5, "needs two frames", ha="center", va="center", color="grey", transform=axes.transAxes)
        axes.set_axis_off()
        return
    for colour, (name, (times, values)) in zip(CURVES * (len(drawn) // len(CURVES) + 1), drawn.items(), strict=False):
        shown = 10.0**values if logarithm else values
        axes.plot(times, shown, color=colour, linewidth=1.2, label=name, marker="." if len(times) < 30 else None)
    if logarithm:
        axes.set_yscale("log")
        lowest = min(values.min() for _times, values in drawn.values())
        highest = max(values.max() for _times, values in drawn.values())
        # A decade around the values: a flat line would have no ticks.
        axes.set_ylim(10.0 ** (np.floor(lowest) - 0.3), 10.0 ** (np.floor(highest) + 1.3))
        if lowest == series.NOTHING:
            axes.axhline(10.0**series.NOTHING, color="grey", linewidth=0.6, linestyle=":")
            axes.annotate("none", (1.0, 10.0**series.NOTHING), xycoords=("axes fraction", "data"),
                          xytext=(3, 0), textcoords="offset points", fontsize=8, color="grey", va="center")  # fmt: skip
    else:
        _steady(axes, drawn)
    axes.set_xlabel("time [s]", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.3)
    if len(drawn) > 1:
        axes.legend(fontsize=8)


def _steady(axes: Any, drawn: dict[str, tuple[Floats, Floats]]) -> None:
    """Keep curves that are constant up to round-off flat, instead of scaling round-off to the height of the axes."""
    values = np.concatenate([values for _times, values in drawn.values()])
    middle, half = 0.5 * (values.max() + values.min()), 0.5 * (values.max() - values.min())
    if half <= 1e-6 * abs(middle):
        axes.set_ylim(middle - 0.1 * abs(middle or 1.0), middle + 0.1 * abs(middle or 1.0))
    axes.ticklabel_format(axis="y", useOffset=False, scilimits=(-3, 6))

"""The distribution of speeds at the start and at the end of a run, beside the law of Maxwell."""

from typing import Any

import numpy as np
from scipy.special import chdtr

from ..state import Floats
from ..words.amounts import amount, prefixed
from . import style

# The largest and smallest number of bins of a histogram; and the number of speeds in a bin if there are few.
_BINS, _FEWEST, _EACH = 50, 8, 10
# Speeds with a smaller relative difference are equal: an impact rounds them.
_ALIKE = 1e-9
# Up to this largest difference of the cumulative distributions the law of Maxwell is informative.
_NEAR = 0.1
# A histogram with more than this part in one bin is not informative.
_ALL = 0.8
# The height above a histogram for each row of the legend, relative to its height.
_ROW = 0.16
Spread = dict[str, Floats]


def of_frames(content: Any) -> Spread:
    """The known speeds at the start and at the end; {} if all particles have one speed in each of these frames."""
    found = {}
    for name, frame in content.frames.items():
        values = np.sqrt((frame.velocity**2).sum(axis=0))
        values = values[~np.isnan(values)]
        if len(values):
            found[name] = values
    if not found:
        return {}
    top = _top(found)
    varied = [values for values in found.values() if not are_alike(values)]
    return (
        found if any(np.histogram(values, _BINS, (0.0, top))[0].max() < _ALL * len(values) for values in varied) else {}
    )


def _top(spread: Spread) -> float:
    """The end of the axis of speeds, which leaves out a few that are far faster than all others."""
    return 1.05 * max(min(float(values.max()), 4.0 * float(np.quantile(values, 0.99))) for values in spread.values())


def of_all(content: Any) -> float | None:
    """The common speed of all particles at the end [m/s]; None for a single particle, or if speeds differ."""
    frame = content.frames.get("end", content.frames.get("start"))
    if frame is None or content.body is not None:
        return None
    values = np.sqrt((frame.velocity**2).sum(axis=0))
    values = values[~np.isnan(values)]
    return float(values.mean()) if len(values) > 1 and are_alike(values) else None


def below(speeds: Floats, mean_square: float, dimensions: int) -> Floats:
    """The fraction of speeds below `speeds` in Maxwell's law with this mean square, for particles of one mass.

    Squares of speeds over the mean square of a component have a chi-square distribution.

    >>> [below(np.array(1.0), d, d).round(4).item() for d in (2, 3)]  # 1 - exp(-1/2), and erf(1/sqrt(2)) less a term
    [0.3935, 0.1987]
    """
    return np.asarray(chdtr(dimensions, dimensions * np.maximum(speeds, 0.0) ** 2 / mean_square))


def draw(axes: Any, content: Any, spread: Spread) -> None:
    """Draw histograms of the speeds, and the law of Maxwell of the same mean energy if they are near it."""
    top, bins = _top(spread), min(_BINS, max(_FEWEST, min(map(len, spread.values())) // _EACH))
    factor, unit = prefixed(top, "m/s")
    for name, values in spread.items():
        colour = style.GREY if name == "start" and len(spread) > 1 else style.BLUE
        when = "at the start" if name == "start" else "at the end"
        if are_alike(values):
            place = float(values.mean()) * factor
            axes.axvline(place, color=colour, linewidth=1.4, linestyle="--",
                         label=f"{when} all {amount(float(values.mean()), 'm/s', 3)}")  # fmt: skip
            continue
        counts, edges = np.histogram(values, bins=bins, range=(0.0, top))
        look: dict[str, Any] = {"fill": True, "alpha": 0.35} if colour == style.GREY else {"linewidth": 1.6}
        axes.stairs(100.0 * counts / len(values), edges * factor, color=colour, label=when, **look)
    _law(axes, content, spread, top / bins, factor)
    axes.set_xlim(0.0, top * factor)
    axes.set_ylim(0.0, (1.1 + _ROW * len(axes.get_legend_handles_labels()[0])) * axes.get_ylim()[1])
    axes.set_title("Speeds" if content.body is None else "Speeds of points")
    axes.set_ylabel(f"% in each of {bins} bins")
    axes.set_xlabel(f"speed [{unit}]")
    axes.legend(loc="upper right", fontsize=8)


def _law(axes: Any, content: Any, spread: Spread, bin_width: float, factor: float) -> None:
    """Draw the law of Maxwell of the last speeds, if they are near it."""
    values, frame = list(spread.values())[-1], list(content.frames.values())[-1]
    masses = frame.mass
    if content.body is not None or np.ptp(masses) > 1e-9 * masses.max() or are_alike(values) or len(values) < _BINS:
        return
    dimensions = 3 if content.scene.plane is None else 2
    at, half = np.linspace(0.0, _top(spread), 400), 0.5 * bin_width
    law, low, high = (below(at + more, float((values**2).mean()), dimensions) for more in (0.0, -half, half))
    measured = np.searchsorted(np.sort(values), at) / len(values)
    if np.abs(law - measured).max() < _NEAR:
        axes.plot(at * factor, 100.0 * (high - low), color=style.RED, linewidth=1.2, linestyle=":",
                  label="Maxwell, same energy")  # fmt: skip


def are_alike(values: Floats) -> bool:
    """Whether all values, such as speeds, are the same up to round-off."""
    return bool(np.ptp(values) <= _ALIKE * np.abs(values).max())

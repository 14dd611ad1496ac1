"""Time series in axes of matplotlib."""

import functools
from typing import Any

import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator, ScalarFormatter

from ..state import Floats
from ..words.amounts import many, plain, prefixed
from ..words.verdicts import ROUND_OFF
from . import series
from .colours import BLUE, curve_colour
from .style import GREY, ink

Curves = dict[str, tuple[Floats, Floats]]
End = tuple[float, str, str]

# Units of pressures and forces; below the last value those of molecules are so small that no gauge would show them.
_PRESSES, _MOLECULAR = ("Pa", "N/m", "N"), 1e-12
# The largest number of curves with colours of their own; of more energies only these have one.
_ENERGIES = (*series.ENERGIES, "brought by")
_MOST = 6
# Values above round-off with a larger ratio than this are on a logarithmic axis.
_DECADES = 1e3
# The smallest distance between labels of curves, in heights of the axes.
_APART = 0.085
# The smallest width of a plot [inches].
_CELL = 2.5


def rows_of(count: int, width: float) -> list[int]:
    """The number of plots in each row, as even as possible, the longer rows last: they fill the width."""
    columns = max(1, min(round(width / _CELL), -(-count // 2)))
    rows = max(1, -(-count // columns))
    return [count // rows + (k >= rows - count % rows) for k in range(rows)]


def cells_of(figure: Any, rows: list[int]) -> list[Any]:
    """Create axes for these numbers of plots in the rows of a figure."""
    parts = figure.subfigures(len(rows), 1, squeeze=False).ravel()
    return [
        one
        for part, number in zip(parts, rows, strict=True)
        if number
        for one in part.subplots(1, number, squeeze=False).ravel()
    ]


def lines(axes: Any, graph: series.Graph, drawn: Curves, limit: float | None = ROUND_OFF) -> None:
    """Draw the time series of one graph, (times [s], values) by name. Rates have no value at the first frame.

    Args:
        axes: the axes to draw in.
        graph: the description of the graph.
        drawn: the curves.
        limit: for errors, the largest one that round-off explains; None: no error is round-off.
    """
    axes.set_title(_titled(graph, drawn))
    if not any(len(times) for times, _values in drawn.values()):
        _words(axes, "needs two frames")
        return
    if graph.is_error:
        # The curves of errors are logarithms.
        drawn = {
            name: (times, np.where(values <= series.NOTHING, 0.0, 10.0**values))
            for name, (times, values) in drawn.items()
        }
        if not any(values.any() for _times, values in drawn.values()):
            _words(axes, "none in any frame")
            return
    drawn = _merged(drawn)
    size = max(float(np.abs(values).max()) for _times, values in drawn.values() if len(values))
    # Errors without a unit keep their powers of ten.
    factor, written = prefixed(size, graph.unit) if graph.unit else (1.0, "")
    duration = max(float(times[-1]) for times, _values in drawn.values() if len(times))
    scale, second = prefixed(duration, "s")
    if len(drawn) == 1 and "total, all kinetic" in drawn:
        axes.set_title("Energy of all, kinetic")
    scaled = {name: (times * scale, values * factor) for name, (times, values) in drawn.items()}
    ends = _curves(axes, scaled, graph.is_rate)
    axes.set_xlim(
        min(0.0, *(float(times[0]) for times, _values in scaled.values() if len(times))), duration * scale or 1.0
    )
    axes.set_xlabel(f"time [{second}]")
    axes.set_ylabel(_labelled(graph, written, size))
    if graph.is_error:
        _errors(axes, scaled, None if limit is None else limit * factor, written)
    else:
        _heights(axes, scaled)
    _label(axes, ends)


def _labelled(graph: series.Graph, written: str, size: float) -> str:
    """The label of an axis with its unit. The pressure of molecules is that of the simulated ones; a gas has more."""
    label = f"{graph.label or graph.quantity} [{written}]" if written else graph.label or graph.quantity
    is_molecular = graph.unit in _PRESSES and 0.0 < size < _MOLECULAR
    return f"{label}\nof the simulated particles" if is_molecular else label


def _merged(drawn: Curves) -> Curves:
    """Energies without curves that are round-off of the total, and only the total if all energy is kinetic."""
    if "total" not in drawn or not len(drawn["total"][1]):
        return drawn
    total = drawn["total"][1]
    least = ROUND_OFF * max(float(np.abs(values).max()) for _times, values in drawn.values())
    rest = {name: curve for name, curve in drawn.items() if np.abs(curve[1]).max() > least or name == "total"}
    if "kinetic" not in rest or not np.allclose(total, rest["kinetic"][1], rtol=0.0, atol=least):
        return rest
    return {"total, all kinetic": drawn["total"]} | {
        n: curve for n, curve in rest.items() if n not in ("total", "kinetic")
    }


def _titled(graph: series.Graph, drawn: Curves) -> str:
    """The title of a graph; that of one surface has its name."""
    title = graph.title
    (first, *others) = drawn
    if not others and first == "virial":
        return "Pressure of the balls"
    if not others and "walls" in title and graph.is_rate:
        title = title.replace("the walls", f"the {first}").replace("walls", f"the {first}")
    if graph.is_error and "body" in first:
        title = title.replace("particle", "body")
    return title[:1].upper() + title[1:]


def _words(axes: Any, text: str) -> None:
    """Write words in place of a plot."""
    axes.text(0.5, 0.5, text, ha="center", va="center", color=GREY, transform=axes.transAxes)
    axes.set_axis_off()


# --- Curves ----------------------------------------------------------------------------------------------


def _curves(axes: Any, drawn: Curves, steps: bool) -> list[End]:
    """Draw the curves, return their names, ends and colours; of too many draw all in grey and label their mean."""
    named = [name for name in drawn if name.startswith(_ENERGIES)]
    if len(drawn) - len(named) <= _MOST:
        # The curves of more than `_MOST` walls are grey, with their mean: a single one tells little.
        named = list(drawn)
    ends: list[End] = []
    for name, (times, values) in drawn.items():
        if not len(times):
            continue
        colour = curve_colour(name, named.index(name), ink()) if name in named else GREY
        x, y = _stepped(times, values) if steps else (times, values)
        look: dict[str, Any] = {"linewidth": 1.5, "zorder": 3} if name in named else {"linewidth": 0.6, "alpha": 0.4}
        if name.startswith("total"):
            look["linewidth"] = 2.2
        marker = "." if not steps and len(times) < 30 else None
        axes.plot(x, y, color=colour, marker=marker, drawstyle="steps-pre" if steps else "default", label=name, **look)
        if name in named:
            ends.append((float(values[-1]), name, colour))
    rest = [curve for name, curve in drawn.items() if name not in named and len(curve[0])]
    if rest:
        times, mean = rest[0][0], np.mean([values for _times, values in rest], axis=0)
        x, y = _stepped(times, mean) if steps else (times, mean)
        drawstyle = "steps-pre" if steps else "default"
        axes.plot(x, y, color=BLUE, linewidth=1.8, zorder=3, drawstyle=drawstyle, label="mean")
        ends.append((float(mean[-1]), f"mean of {len(rest)}", BLUE))
    return ends if len(drawn) > 1 else []


def _stepped(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """The values of a rate with a first step that begins one frame earlier."""
    before = max(0.0, 2.0 * times[0] - times[1]) if len(times) > 1 else 0.0
    return np.concatenate([[before], times]), np.concatenate([values[:1], values])


def _label(axes: Any, found: list[End]) -> None:
    """Write the names of curves beside their ends, apart from one another."""
    low, high = axes.get_ylim()
    if axes.get_yscale() == "log":
        low, high = np.log10(low), np.log10(high)
    ends, last = sorted(found, key=lambda end: end[0]), -np.inf
    heights = []
    for value, _name, _colour in ends:
        place = (np.log10(max(value, 10.0**low)) if axes.get_yscale() == "log" else value) - low
        last = max(min(1.0, max(0.0, place / (high - low))), last + _APART)
        heights.append(last)
    # A label above the axes pushes the others down.
    top = 1.0
    for k in range(len(heights) - 1, -1, -1):
        heights[k] = min(heights[k], top)
        top = heights[k] - _APART
    for (_value, name, colour), height in zip(ends, heights, strict=True):
        axes.text(1.015, height, name, color=colour, transform=axes.transAxes, va="center", ha="left", fontsize=8.5)


# --- Axes ------------------------------------------------------------------------------------------------


def _heights(axes: Any, drawn: Curves) -> None:
    """Set a linear axis that includes 0 and all values, so that a constant is seen as constant and with its size."""
    values = np.concatenate([values for _times, values in drawn.values()])
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    room = 0.06 * ((high - low) or 1.0)
    axes.set_ylim(low - room * (low < 0.0), high + room)
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=bool((values == np.round(values)).all()) and high > 3.0))
    axes.yaxis.set_major_formatter(FuncFormatter(functools.partial(_tick, max(-low, high))))
    if low < 0.0 < high:
        axes.axhline(0.0, color=GREY, linewidth=0.7)


def _tick(largest: float, value: float, _place: Any = None) -> str:
    """Format a number at an axis, by the largest one there: 10 000, 250 k, 1.2 M."""
    if largest < 1e5:
        return many(value) if value == int(value) else plain(value)
    factor, unit = prefixed(largest, "~")
    return f"{plain(value * factor)} {unit.removesuffix('~')}" if value else "0"


def _errors(axes: Any, drawn: Curves, limit: float | None, unit: str) -> None:
    """Set the axis of errors: linear with the band of round-off, or logarithmic if they span decades above it."""
    values = np.concatenate([values for _times, values in drawn.values()])
    worst, least = float(values.max()), float(values[values > 0.0].min())
    summary = f"at most {plain(worst, 2)} {unit}".strip()
    if limit is not None and worst > _DECADES * max(least, limit):
        low = 10.0 ** np.floor(np.log10(max(least, 1e-2 * limit)))
        axes.set_yscale("log", nonpositive="mask")
        axes.set_ylim(low, worst * 3.0)
    else:
        axes.set_ylim(0.0, 1.5 * worst)
        formatter = ScalarFormatter(useMathText=True)
        formatter.set_powerlimits((-3, 4))
        axes.yaxis.set_major_formatter(formatter)
        axes.yaxis.set_major_locator(MaxNLocator(4))
    bottom, top = axes.get_ylim()
    if limit is not None and limit > bottom:
        axes.axhspan(bottom, min(limit, top), color=GREY, alpha=0.16, linewidth=0, zorder=0, label="round-off")
        summary += ", round-off" if worst <= limit else ""
        if axes.get_yscale() == "log":
            axes.text(0.99, limit, "round-off below", color=GREY, transform=axes.get_yaxis_transform(), ha="right",
                      va="bottom", fontsize=8)  # fmt: skip
    axes.text(0.5, 0.97, summary, transform=axes.transAxes, ha="center", va="top", fontsize=8.5)

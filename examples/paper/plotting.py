"""How every figure looks, and the panels that several share."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import swarm

from .cases import PENALTY, TOLERANCE, Floats

STYLE: Any = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "figure.titlesize": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.0,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
}
BLUE, RED, GREEN, GREY = "#1f5fa8", "#c8402f", "#2f8f5b", "0.45"
DPI = 150

SWEEP = "sweep of Uzawa's loop"
# Phi1 at which the paper's loop ends, for its alpha of the sphere.
CONSTRAINT_BAR = float(np.sqrt(2.0 * TOLERANCE / PENALTY))


@contextmanager
def page(
    file: Path, title: str, rows: int = 1, columns: int = 1, size: tuple[float, float] = (5.0, 3.5)
) -> Iterator[list[Any]]:
    """Axes, row by row, of a figure that is written to `file` at the end of the block."""
    # Imported here: only drawing needs matplotlib. A Figure without pyplot draws with Agg, whatever the screen.
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size, dpi=DPI, layout="constrained")
        figure.suptitle(title)
        yield list(figure.subplots(rows, columns, squeeze=False).flat)
        # No version in the file: the same numbers give the same bytes.
        figure.savefig(file, metadata={"Software": None})


def sweeps(history: swarm.ContactHistory) -> Floats:
    """1, 2, ..., the x axis of a history."""
    return np.arange(1.0, len(history) + 1.0)


def curve(axes: Any, history: swarm.ContactHistory, values: Floats, **line: Any) -> None:
    """One quantity by sweep; a value that a log axis cannot show is left out."""
    positive = axes.get_yscale() == "log"
    axes.plot(
        sweeps(history), np.where(values > 0.0, values, np.nan) if positive else values, **{"marker": "o", **line}
    )

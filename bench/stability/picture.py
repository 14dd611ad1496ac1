"""What the maps share: heat maps of a table, its words, and its CSV."""

import csv
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .. import figure
from ..report import file_of

Cell = dict[str, Any]  # column -> number or word
OMEGA = r"$\Omega = dt\,\sqrt{\alpha/m}$"


def table(cells: Sequence[Cell], x: str, y: str, value: str) -> tuple[list[float], list[float], np.ndarray]:
    """The values of `x` and of `y`, and the array of `value` over (y, x); NaN where there is no cell."""
    columns, rows = (sorted({cell[axis] for cell in cells}) for axis in (x, y))
    found = np.full((len(rows), len(columns)), np.nan)
    for cell in cells:
        found[rows.index(cell[y]), columns.index(cell[x])] = cell[value]
    return columns, rows, found


def heat(axes: Any, columns: list[str], rows: list[str], values: np.ndarray, low: float, high: float) -> Any:
    """Colours of log10(values) from low to high; a cross where a value is infinite."""
    from swarm.pictures.style import CAVITY, MAP, ink

    with np.errstate(divide="ignore"):
        logarithms = np.log10(np.where(np.isfinite(values), values, np.nan))
    image = axes.imshow(np.clip(logarithms, low, high), origin="lower", aspect="auto", cmap=MAP, vmin=low, vmax=high)
    axes.grid(False)
    axes.set_facecolor(CAVITY)
    crossed, ended = np.nonzero(np.isinf(values))
    axes.plot(ended, crossed, "x", color=ink(), markersize=5)
    # Every second label where there are many.
    every = 1 + len(columns) // 10
    axes.set_xticks(range(0, len(columns), every), columns[::every])
    axes.set_yticks(range(len(rows)), rows)
    return image


def words(axes: Any, image: Any, values: np.ndarray, wording: Callable[[float], str]) -> None:
    """Each finite value in its cell, dark on light and light on dark."""
    from swarm.pictures.style import ink

    for row, column in zip(*np.nonzero(np.isfinite(values)), strict=True):
        light = image.get_array()[row, column] > 0.5 * (image.norm.vmin + image.norm.vmax)
        axes.text(
            column, row, wording(values[row, column]), ha="center", va="center", fontsize=7,
            color=ink() if light else "white",
        )  # fmt: skip


def save(picture: Any, cells: Sequence[Cell], name: str) -> None:
    """The picture as PNG and its cells as CSV; they depend on no machine but for times."""
    path = file_of(f"stability-{name}.png")
    figure.save(picture, path)
    with open(path.with_suffix(".csv"), "w", newline="") as file:
        out = csv.DictWriter(file, list(cells[0]), lineterminator="\n")
        out.writeheader()
        for cell in cells:
            out.writerow({key: f"{one:.4g}" if isinstance(one, float) else one for key, one in cell.items()})

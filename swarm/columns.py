"""Columns of numbers, by their names: from a CSV file, and of observables."""

import csv
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .errors import SceneError
from .extras import needed_by

if TYPE_CHECKING:
    import pandas

_NUMBER = re.compile(r"\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*")
# Columns of numbers above 0.
_POSITIVE = {"mass", "radius", "length", "half_x", "half_y", "half_z", "a", "b", "c"}

# What the last axis of an observable is where it is neither a surface nor a cavity.
COMPONENTS = dict.fromkeys(
    ("momentum", "angular_momentum", "wall_position", "wall_velocity", "wall_spin"), ("x", "y", "z")
) | {"wall_orientation": ("w", "x", "y", "z")}


def flattened(observables: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """A column for each number of observables, which have one entry a frame; "time" first.

    >>> list(flattened({"momentum": np.zeros((2, 3)), "impulse": np.zeros((2, 2)), "time": np.arange(2)}))
    ['time', 'momentum_x', 'momentum_y', 'momentum_z', 'impulse_0', 'impulse_1']
    """
    columns = {}
    for name in sorted(observables, key=lambda name: name != "time"):
        values = np.asarray(observables[name])
        for place in np.ndindex(values.shape[1:]):
            parts = [str(i) for i in place]
            if name in COMPONENTS:
                parts[-1] = COMPONENTS[name][place[-1]]
            columns["_".join([name, *parts])] = values[:, *place]
    return columns


def frame_of(observables: Mapping[str, Any]) -> "pandas.DataFrame":
    """The observables as a pandas frame, a row for each frame."""
    with needed_by("a table", "table"):
        import pandas

    return pandas.DataFrame(flattened(observables))


def read_columns(
    path: str | Path, needed: Sequence[str], optional: Sequence[str], what: str
) -> dict[str, NDArray[np.float64]]:
    """The columns of a CSV file with a header, in any order, one row for each `what`.

    Raises:
        SceneError: the file cannot be read, a column is missing or unknown, or a cell is not a number; names file, row
            and column.
    """
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            table = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise SceneError(f"cannot read {path}: {error}") from error
    header = [name.strip() for name in table[0]] if table else []
    missing = [name for name in needed if name not in header]
    unknown = [name for name in header if name not in (*needed, *optional)]
    if missing or unknown or len(set(header)) < len(header):
        problem = f"column {missing[0]!r} is missing" if missing else f"columns are {', '.join(header)}"
        more = f" and optionally {', '.join(optional)}" if optional else ""
        raise SceneError(f"{path}: expected the columns {', '.join(needed)}{more}; {problem}")
    rows = [(number, cells) for number, cells in enumerate(table[1:], start=2) if cells]
    if not rows:
        raise SceneError(f"{path}: expected at least one {what} below the header, got none")
    values = np.array([_row(path, number, header, cells) for number, cells in rows])
    return dict(zip(header, values.T, strict=True))


def _row(path: str | Path, number: int, header: list[str], cells: list[str]) -> list[float]:
    if len(cells) != len(header):
        raise SceneError(f"{path}, row {number}: expected {len(header)} cells, got {len(cells)}")
    values = []
    for name, cell in zip(header, cells, strict=True):
        # float() also takes what other programs do not write: 1_0, and the digits of all scripts.
        value = float(cell) if _NUMBER.fullmatch(cell) else np.nan
        if not np.isfinite(value):
            raise SceneError(f"{path}, row {number}, column {name!r}: expected a finite number, got {cell[:40]!r}")
        if name in _POSITIVE and value <= 0.0:
            raise SceneError(f"{path}, row {number}, column {name!r}: expected a number above 0, got {cell!r}")
        values.append(value)
    return values

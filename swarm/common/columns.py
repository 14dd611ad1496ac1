"""Named columns of numbers, from a CSV file and of observables."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .catalog import OBSERVABLES
from .checks import path_of
from .extras import needed_by

if TYPE_CHECKING:
    import pandas

_NUMBER = re.compile(r"\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*")
# Columns with numbers above 0.
_POSITIVE = {"mass", "radius", "length", "half_x", "half_y", "half_z", "a", "b", "c"}

# The names of the entries along the last axis of a column of a log.
_OF_LOGS = dict.fromkeys(("position", "velocity_before", "velocity_after", "slip", "image", "spin"), ("x", "y", "z"))


def flattened(observables: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Return a column for each number of a frame's observables, except those of members; "time" is the first.

    >>> list(flattened({"momentum": np.zeros((2, 3)), "impulse": np.zeros((2, 2)), "time": np.arange(2)}))
    ['time', 'momentum_x', 'momentum_y', 'momentum_z', 'impulse_0', 'impulse_1']
    """
    columns = {}
    # The columns of members would be too many.
    written = [name for name in observables if not name.startswith("member_")]
    for name in sorted(written, key=lambda name: name != "time"):
        values = np.asarray(observables[name])
        components = OBSERVABLES[name].components() if name in OBSERVABLES else _OF_LOGS.get(name)
        for place in np.ndindex(values.shape[1:]):
            parts = [str(i) for i in place]
            if components is not None:
                parts[-1] = components[place[-1]]
            columns["_".join([name, *parts])] = values[:, *place]
    return columns


def frame_of(observables: Mapping[str, Any]) -> "pandas.DataFrame":
    """Return the observables as a pandas frame, a row for each frame."""
    with needed_by("a table", "table"):
        import pandas

    return pandas.DataFrame(flattened(observables))


def read_columns(
    path: str | Path, needed: Sequence[str], optional: Sequence[str], what: str, ignored: Sequence[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Return the columns of a CSV file with a header, in any order, one row for each `what`.

    Columns that are `ignored` may have any contents.

    Raises:
        SceneError: the file cannot be read, a column is missing or unknown, or a cell is not a number; it names file,
            row and column.
    """
    rows = _rows_of(path)
    header = [name.strip() for name in rows[0][1]] if rows else []
    missing = [name for name in needed if name not in header]
    unknown = [name for name in header if name not in (*needed, *optional, *ignored)]
    if missing or unknown or len(set(header)) < len(header):
        problem = f"column {missing[0]!r} is missing" if missing else f"columns are {', '.join(header)}"
        more = f" and optionally {', '.join(optional)}" if optional else ""
        hint = _hint(header) if missing else ""
        raise SceneError(f"{path}: expected the columns {', '.join(needed)}{more}; {problem}{hint}")
    if len(rows) < 2:
        raise SceneError(f"{path}: expected at least one {what} below the header, got none")
    values = np.array([_row(path, number, header, cells, ignored) for number, cells in rows[1:]])
    return {name: column for name, column in zip(header, values.T, strict=True) if name not in ignored}


def row_of(path: str | Path, number: int) -> int:
    """Return the row of a CSV file with the particle, or body, of this number."""
    return _rows_of(path)[1 + number][0]


def _rows_of(path: str | Path) -> list[tuple[int, list[str]]]:
    """Return the rows of a CSV file that are not empty, with their numbers, from 1 on."""
    file = path_of("path", path)
    try:
        text = file.read_bytes()
        table = list(csv.reader(io.StringIO(text.decode("utf-8-sig"), newline=""), skipinitialspace=True))
    except UnicodeDecodeError as error:
        row = text[: error.start].count(b"\n") + 1
        raise SceneError(
            f"cannot read {path}, row {row}: expected text in UTF-8, got the byte 0x{text[error.start]:02x}"
        ) from error
    except (OSError, csv.Error) as error:
        raise SceneError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from error
    return [(number, cells) for number, cells in enumerate(table, start=1) if any(cells) or len(cells) > 1]


def _hint(header: list[str]) -> str:
    """Return a guess at the fault in a header."""
    if not header:
        return ": the file is empty"
    got = f" in the first row, {','.join(header)!r:.60}"
    if len(header) == 1 and re.search(r"[;\t ]", header[0]) and not header[0].startswith("#"):
        return f"{got}; write commas between columns, and points in numbers"
    if all(_NUMBER.fullmatch(name) for name in header):
        return f"{got}; write the names of the columns above the numbers"
    return f"{got}; write the names as they are here, without units, and nothing above them"


def _row(path: str | Path, number: int, header: list[str], cells: list[str], ignored: Sequence[str]) -> list[float]:
    if len(cells) != len(header):
        raise SceneError(f"{path}, row {number}: expected {len(header)} cells, got {len(cells)}")
    values = []
    for name, cell in zip(header, cells, strict=True):
        if name in ignored:
            values.append(0.0)
            continue
        # float() also takes forms that other programs do not write: 1_0, and the digits of all scripts.
        value = float(cell) if _NUMBER.fullmatch(cell) else np.nan
        if not np.isfinite(value):
            raise SceneError(f"{path}, row {number}, column {name!r}: expected a finite number, got {cell[:40]!r}")
        if name in _POSITIVE and value <= 0.0:
            raise SceneError(f"{path}, row {number}, column {name!r}: expected a number above 0, got {cell!r}")
        values.append(value)
    return values

"""The folder of a sweep: the table of its runs, its sweep file, and whether it is complete."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..common.extras import needed_by
from ..errors import SceneError
from .plan import STEM
from .results import KEPT, TABLES, status_in

# The columns of a table between its parameters and its observables.
_ABOUT = ("state", "error", "wall_time")


@dataclass(frozen=True)
class SweepFolder:
    """The runs in the folder of a sweep.

    Attributes:
        path: the folder.
        rows: for each run, its values by column of the table: texts, numbers or None.
        parameters: the keys of the sweep.
        observables: the names of the other columns.
        text: the sweep file, or None.
        table: the file of the table, or None.
    """

    path: Path
    rows: list[dict[str, Any]]
    parameters: list[str]
    observables: list[str]
    text: str | None
    table: Path | None

    def varying(self) -> list[str]:
        """The parameters with more than one value."""
        return [name for name in self.parameters if len({str(row.get(name)) for row in self.rows}) > 1]


def found(path: Path) -> SweepFolder:
    """Read the sweep of a folder: its table, with the runs that have ended since it was written.

    Raises:
        SceneError: it is not the folder of a sweep, or the table is damaged.
    """
    files = [path / f"results.{kind}" for kind in TABLES if (path / f"results.{kind}").is_file()]
    table = max(files, key=lambda file: file.stat().st_mtime, default=None)
    try:
        header, rows = _read(table) if table is not None else ([], [])
    except (OSError, ValueError, csv.Error) as error:
        raise SceneError(f"{table} is damaged: {error}") from error
    files = [file for file in sorted(path.glob("*.json")) if STEM.fullmatch(file.stem)]
    statuses = {file.stem: status for file in files if (status := status_in(file)) is not None}
    if table is None and not statuses:
        raise SceneError(
            f"{path} is not the folder of a sweep: expected results.csv or results.parquet in it, got none; "
            "swarm sweep makes one, and of a single run name its file, RUN.h5"
        )
    if table is not None and not {"file", *_ABOUT} <= set(header):
        raise SceneError(f"{table} is not the table of a sweep: expected the columns file, state, error and wall_time")
    if not rows:
        rows = [{"file": f"{stem}.h5", **_parameters(status)} for stem, status in statuses.items()]
        header = list(dict.fromkeys(name for row in rows for name in row)) + list(_ABOUT)
    for row in rows:
        status = statuses.get(Path(str(row["file"])).stem)
        if status is not None:
            row |= {name: status.get(name) for name in _ABOUT} | status["observables"]
    begin, end = header.index("file") + 1, header.index("state")
    parameters = header[begin:end]
    fixed = {"file", *parameters, *_ABOUT}
    observables = list(dict.fromkeys(name for row in rows for name in row if name not in fixed))
    kept = path / KEPT
    text = kept.read_text(encoding="utf-8-sig", errors="replace") if kept.is_file() else None
    return SweepFolder(path, rows, parameters, observables, text, table)


def _parameters(status: dict[str, Any]) -> dict[str, Any]:
    return {
        name: value if isinstance(value, (bool, int, float, str)) else json.dumps(value)
        for name, value in status["parameters"].items()
    }


def _read(table: Path) -> tuple[list[str], list[dict[str, Any]]]:
    """The columns and the rows of a table."""
    if table.suffix == ".parquet":
        with needed_by("a table in Parquet", "parquet"):
            import pandas as pd
        frame = pd.read_parquet(table)
        rows = [{str(name): _plain(value) for name, value in row.items()} for row in frame.to_dict("records")]
        return [str(name) for name in frame.columns], rows
    with table.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        rows = [{name: _value(cell) for name, cell in row.items() if name is not None} for row in reader]
        return list(reader.fieldnames or ()), rows


def _plain(value: Any) -> Any:
    """A cell of pandas as a plain value of Python."""
    value = value.item() if hasattr(value, "item") else value
    return None if value is None or value != value else value


def _value(cell: Any) -> Any:
    """A cell of text as a number if it is one; None if it is empty."""
    if cell in (None, ""):
        return None
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return {"True": True, "False": False}.get(cell, cell)

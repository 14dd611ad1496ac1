"""The results of a sweep: a status file for every run, and one table of all runs."""

import csv
import functools
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..common.columns import flattened
from ..common.extras import needed_by
from ..errors import SceneError
from ..files import marks, paths
from ..files.replaced import replaced
from .plan import STEM, Plan, Variant

TABLES = ("csv", "parquet")
# The copy of the sweep file in the folder.
KEPT = "sweep.toml"
Status = dict[str, Any]


def final(observables: dict[str, Any]) -> dict[str, int | float]:
    """The observables of the last frame as numbers by name: momentum_x, impulse_0, wall_position_0_x."""
    return {name: column[-1].item() for name, column in flattened(observables).items()}


def of_trajectory(path: Path, until: float) -> dict[str, int | float] | None:
    """The observables of the last frame, or None if the trajectory does not reach its end."""
    from ..files.trajectory import load

    try:
        with load(path) as trajectory:
            times = trajectory.times
            return final(trajectory.observed()) if len(times) and times[-1] >= until else None
    except SceneError:
        return None  # damaged: the run is carried out again


class Results:
    """The outcomes of the runs of a plan, in memory and in the folder.

    Args:
        plan: the runs.
        folder: the folder of all files.
        table: "csv" or "parquet".
    """

    def __init__(self, plan: Plan, folder: Path, table: str) -> None:
        self.plan, self.folder = plan, folder
        self.path = folder / f"results.{table}"
        self._statuses: dict[str, Status] = {}
        values = [variant.parameters for variant in plan.variants]
        self._written = {key: _written_as([row[key] for row in values]) for key in values[0]}

    def trajectory(self, variant: Variant) -> Path:
        """The trajectory of a run."""
        return self.folder / f"{variant.stem}.h5"

    def impacts(self, variant: Variant) -> Path | None:
        """The log of impacts of a run, or None."""
        return self.folder / f"{variant.stem}.impacts.h5" if variant.has_impacts else None

    def status_file(self, variant: Variant) -> Path:
        """The file with the outcome of a run."""
        return self.folder / f"{variant.stem}.json"

    def find(self) -> None:
        """Read the status files of the folder."""
        for variant in self.plan.variants:
            # Without a whole status file the state of the run is read from its trajectory.
            if (status := status_in(self.status_file(variant))) is not None:
                self._statuses[variant.stem] = {key: one for key, one in status.items() if key != "parameters"}

    def require_own(self) -> None:
        """Raise a SceneError if the sweep would replace a file that no sweep has made."""
        for path, what in ((self.path, "table"), (self.folder / KEPT, "sweep file")):
            if path.exists() and not (what == "sweep file" and self._is_kept(path)):
                marks.require_own(path, what)
        for variant in self.plan.variants:
            for file, what in ((self.trajectory(variant), "trajectory"), (self.impacts(variant), "impacts")):
                if file is not None and file.exists():
                    marks.require_own(file, what)
            if (file := self.status_file(variant)).exists() and not _is_status(file):
                marks.require_own(file, "status")

    def _is_kept(self, path: Path) -> bool:
        """Whether a sweep file in the folder is that of the plan, or one that an earlier sweep left there."""
        try:
            same = path.read_bytes() == self.plan.path.read_bytes()
        except OSError:
            return False
        there = (self.folder / f"results.{kind}" for kind in TABLES)
        return (
            same
            or bool(self.others())
            or any(file.exists() and marks.is_table(file) for file in there)
            or any(
                self.trajectory(variant).exists() or self.status_file(variant).exists()
                for variant in self.plan.variants
            )
        )

    def remove(self) -> None:
        """Remove the files of the plan's runs, which start again."""
        self._statuses.clear()
        for variant in self.plan.variants:
            files = (self.status_file(variant), paths.checkpoint_of(self.trajectory(variant)), self.trajectory(variant))
            for path in (*files, self.impacts(variant)):
                if path is not None:
                    path.unlink(missing_ok=True)

    def keep_file(self) -> None:
        """Copy the sweep file into the folder, as a description of the runs."""
        with replaced(self.folder / KEPT, "sweep file") as file:
            file.write(self.plan.path.read_bytes())

    def add(self, variant: Variant, status: Status) -> None:
        """Write the outcome of a run."""
        with replaced(self.status_file(variant), "status") as file:
            noted = {"parameters": variant.parameters, **status}
            file.write((json.dumps(noted, indent=1, default=str) + "\n").encode())
        self._statuses[variant.stem] = status

    def of_state(self, state: str) -> list[tuple[Variant, Status | None]]:
        """The runs that are "done", "failed", or "waiting" (have not ended), and their statuses."""
        every = [(variant, self._statuses.get(variant.stem)) for variant in self.plan.variants]
        return [(variant, status) for variant, status in every if (status["state"] if status else "waiting") == state]

    def others(self) -> list[str]:
        """The runs in the folder that are not in the plan."""
        mine = {variant.stem for variant in self.plan.variants}
        there = {path.stem for path in self.folder.glob("*.h5") if STEM.fullmatch(path.stem)}
        return sorted(there - mine)

    def rows(self) -> list[dict[str, Any]]:
        """The table, a row for every run of the plan in its order."""
        made = []
        for variant in self.plan.variants:
            status = self._statuses.get(variant.stem, {})
            parameters = {key: self._written[key](value) for key, value in variant.parameters.items()}
            about: Status = {"state": "waiting", "error": None, "wall_time": None, "observables": {}} | status
            observables = about.pop("observables")
            made.append({"file": self.trajectory(variant).name, **parameters, **about, **observables})
        return made

    def frame(self) -> Any:
        """The table as a pandas frame."""
        import pandas as pd

        rows = self.rows()
        return pd.DataFrame(rows, columns=_columns(rows))

    def write(self) -> None:
        """Replace the table in the folder."""
        rows = self.rows()
        with replaced(self.path, "table") as file:
            if self.path.suffix == ".csv":
                text = io.StringIO(newline="")
                writer = csv.DictWriter(text, _columns(rows), lineterminator="\n")
                writer.writeheader()
                writer.writerows(rows)
                file.write(text.getvalue().encode())
            else:
                self.frame().to_parquet(file, engine="pyarrow", index=False)


def status_in(file: Path) -> Status | None:
    """The content of a status file; None if it is missing or incomplete."""
    try:
        status = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    known = {"parameters", "state", "error", "wall_time", "observables"}
    return status if isinstance(status, dict) and known <= status.keys() else None


def _is_status(path: Path) -> bool:
    """Whether a file is a status file; an incomplete one counts."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return path.read_bytes()[:1] in (b"", b"{")
    return isinstance(found, dict) and "state" in found and "parameters" in found


def require_written(table: str) -> None:
    """Raise a SceneError if a package that writes this kind of table is missing."""
    if table == "parquet":
        with needed_by("a table in Parquet", "parquet"):
            import pandas  # noqa: F401
            import pyarrow  # noqa: F401


def _columns(rows: list[dict[str, Any]]) -> list[str]:
    """The names of all columns, in the order of their first occurrence."""
    return list(dict.fromkeys(name for row in rows for name in row))


def _written_as(values: list[Any]) -> Callable[[Any], Any]:
    """The function that converts the values of a column to one type; to JSON if no type of column holds them."""
    kinds = {_type_of(value) for value in values}
    if kinds == {"whole", "number"}:
        return float
    holds = len(kinds) == 1 and None not in kinds
    if kinds == {"whole"}:
        # 64 bits, with or without a sign.
        least, most = min(values), max(values)
        holds = least >= -(2**63) and most < (2**63 if least < 0 else 2**64)
    return (lambda value: value) if holds else functools.partial(json.dumps, default=str)


def _type_of(value: Any) -> str | None:
    """The name of the type of a value; None for lists and tables."""
    kinds = {bool: "truth", int: "whole", float: "number", str: "text"}
    return next((name for kind, name in kinds.items() if isinstance(value, kind)), None)

"""The report of a sweep, and of a run or folder at any path."""

import os
import shlex
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ..common.catalog import ERRORS
from ..common.checks import path_of
from ..common.extras import needed_by

if TYPE_CHECKING:
    from ..pages.html import Page


def report(
    path: str | os.PathLike[str], output: str | os.PathLike[str] | None = None, *, overwrite: bool = False
) -> "Page":
    """A page of a run, or of a sweep: one file in HTML for any browser, which a notebook shows.

    The page of a run is that of `Trajectory.report`. The page of a sweep has the table of all runs, which a click on a
    column sorts, with links to their files; graphs of the mean and the spread of the main observables over each
    parameter; the sweep file; and a command that reproduces it.

    Args:
        path: a trajectory, or the folder of a sweep.
        output: `.html`, where the page is written; None: the page is only returned.
        overwrite: replace an existing file.

    Returns:
        A `Page`, which has `html`, the text, and `save(path)`. Links to files are relative to `output`, or to the
        parent of the sweep's folder.

    Raises:
        SceneError: the path is neither a trajectory nor the folder of a sweep, its content is damaged, the file
            exists or has another suffix, or jinja2, matplotlib or scikit-image is not installed.
        FileError: the file cannot be written.

    >>> import swarm, tempfile
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> start = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run = swarm.simulate(cavity, start, swarm.Impact(), until=1.0, trajectory=folder + "/run.h5")
    ...     page = swarm.report(folder + "/run.h5")
    >>> page.title
    '1 particle in a sphere: Impact, 1 s'
    """
    source = path_of("path", path)
    with needed_by("a report", "report"):
        from ..pages import html
    target = None if output is None else path_of("output", output)
    return html.written(lambda: page_of(source, target), target, overwrite, () if source.is_dir() else (source,))


def page_file(source: Path) -> Path:
    """The default file of the report of a run or a folder."""
    return (
        source.resolve().with_name(f"{source.resolve().name}.html") if source.is_dir() else source.with_suffix(".html")
    )


def page_of(source: Path, target: Path | None) -> "Page":
    """The report of a run or of a folder; its links are relative to the file `target`."""
    with needed_by("a report", "report"):
        from ..pages import of_run as run
    if source.is_dir():
        return of_folder(source, source.resolve().parent if target is None else target.resolve().parent)
    from ..files.trajectory import load

    run.require_trajectory(source)
    with load(source) as trajectory:
        return run.of_trajectory(trajectory)


def of_folder(folder: Path, place: Path) -> "Page":
    """The report of the folder of a sweep; its links are relative to the folder `place`."""
    from ..pages.html import Page, filled
    from . import curves
    from .folder import found

    sweep = found(folder)
    states = [str(row["state"]) for row in sweep.rows]
    counts = ", ".join(f"{states.count(state)} {state}" for state in ("done", "failed", "waiting") if state in states)
    spent = sum(row["wall_time"] for row in sweep.rows if isinstance(row["wall_time"], (int, float)))
    name = folder.resolve().name
    title = (
        f"Sweep {name}: {len(states)} run{'s' * (len(states) != 1)}, over {' and '.join(sweep.varying()) or 'nothing'}"
    )
    failed = ["error"] * ("failed" in states)
    shown = [*sweep.parameters, "state", *failed, "wall_time", *curves.main_observables(sweep)]
    shown += [one for one in ERRORS if one in sweep.observables and one not in shown]
    page = filled(
        "sweep.html.j2",
        title=title,
        about=f"folder {name} · {counts} · {spent:.3g} s of runs in all",
        notes=_notes(sweep, states),
        failures=[(row["file"], row["error"], _given(row, sweep)) for row in sweep.rows if row["state"] == "failed"],
        columns=["file", *shown],
        rows=[[(row["file"], _link(folder / str(row["file"]), place)), *(_cell(row.get(one)) for one in shown)]
              for row in sweep.rows],
        table=None if sweep.table is None else (sweep.table.name, _link(sweep.table, place)),
        left_out=len(set(sweep.observables) - set(shown)),
        graphs=curves.drawn(sweep),
        worst=[("runs", counts), *curves.worst(sweep), ("wall time", f"{spent:.4g} s of all runs together")],
        sweep_file=sweep.text or "",
        command=_command(sweep),
        name=name,
    )  # fmt: skip
    return Page(title, page)


def _given(row: dict[str, Any], sweep: Any) -> str:
    return ", ".join(f"{key} = {row.get(key)}" for key in sweep.parameters)


def _notes(sweep: Any, states: list[str]) -> list[Any]:
    """Notes that say whether the sweep is running or was stopped."""
    from ..files.lock import is_written
    from ..words.unfinished import Note

    waiting = states.count("waiting")
    if sweep.table is not None and is_written(sweep.table):
        return [Note(f"The sweep runs now: {waiting} of {len(states)} runs have not ended.")]
    if waiting:
        again = f"swarm sweep {shlex.quote(str(sweep.path / 'sweep.toml'))} -o {shlex.quote(str(sweep.path))} --resume"
        return [
            Note(f"The sweep is not complete: {waiting} of {len(states)} runs have not ended. Go on with it:", again)
        ]
    if sweep.table is None:
        return [Note("The sweep was killed before its table was written: runs that had not ended are not here.")]
    return []


def _command(sweep: Any) -> str:
    """The command that carries out the sweep again, or "" without a sweep file."""
    if sweep.text is None:
        return ""
    from ..pages.reproduce import plugins_of

    try:
        plugins = plugins_of(tomllib.loads(sweep.text))
    except ValueError:
        plugins = ""
    return f"swarm sweep again.toml -o again{plugins}"


def _link(file: Path, place: Path) -> str:
    """The address of a file relative to a folder, or "" if the file does not exist."""
    if not file.is_file():
        return ""
    try:
        return quote(os.path.relpath(file.resolve(), place).replace(os.sep, "/"))
    except ValueError:  # another drive of Windows
        return file.resolve().as_uri()


def _cell(value: Any) -> tuple[str, Any]:
    """A cell's text, and its key for sorting."""
    if isinstance(value, float):
        return f"{value:.6g}", repr(value)
    return ("", "") if value is None else (str(value), str(value))

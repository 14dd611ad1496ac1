"""The report of one run."""

import datetime
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import SceneError
from ..words import facts, verdicts
from ..words import titles as words
from ..words.amounts import amount, many
from ..words.content import Content, content_of
from ..words.statements import Statement
from ..words.unfinished import Note, unfinished
from . import html, pictures, reproduce
from .html import Page, filled

# The largest number of numbers, and of surfaces, on the first screen.
_NUMBERS, _SURFACES = 4, 3


class Answer(NamedTuple):
    """The verdict on a run, in words."""

    text: str
    holds: bool


def report(trajectory: Any, path: Any, overwrite: bool) -> Page:
    """Make the report of a `Trajectory`, and write it if a path is given; see `Trajectory.report`."""
    return html.written(functools.partial(of_trajectory, trajectory), path, overwrite, (trajectory.path,))


def report_of_content(content: Content, wall_time: float, path: Any, overwrite: bool) -> Page:
    """Make the report of a run that wrote no trajectory, and write it if a path is given."""
    return html.written(functools.partial(of_content, content, wall_time), path, overwrite, ())


def of_trajectory(trajectory: Any) -> Page:
    """The report of a `Trajectory`.

    Raises:
        SceneError: it is damaged, or has no frame.
    """
    trajectory.require_frames()
    content, makers, wall_times = content_of(trajectory), trajectory.makers, trajectory.wall_times
    spent = None if wall_times is None else float(wall_times[-1])
    about = " · ".join([trajectory.path.name, *_when(makers, trajectory.path), facts.file_size(trajectory.path)])
    speed = _speed(content, spent, trajectory.threads) + _versions(makers, trajectory.seed)
    cut = unfinished(trajectory)
    notes = [] if cut is None else [cut]
    made = _filled(content, spent, about, notes, speed, reproduce.of_trajectory(trajectory))
    return Page(words.title(content), made, (trajectory.path,))


def of_content(content: Content, wall_time: float) -> Page:
    """The report of a run without a trajectory, with its wall time [s]."""
    from ..files.provenance import makers

    why = "It cannot be reproduced from this page: it was run in Python and has written no trajectory; keep the script."
    speed = _speed(content, wall_time, None) + _versions(makers(), None)
    made = _filled(content, wall_time, "a run without a trajectory", [], speed, reproduce.Again([why]))
    return Page(words.title(content), made)


def _filled(content: Content, spent: float | None, about: str, notes: list[Note], speed: Any, again: Any) -> str:
    """The page of a run, with the wall time `spent` [s] if it is known."""
    return filled(
        "run.html.j2",
        title=words.title(content),
        about=about,
        notes=notes,
        **_first_screen(content, spent),
        places=pictures.of_places(content),
        series=pictures.of_series(content),
        scene=facts.of_setting(content),
        numbers=facts.of_numbers(content.seen),
        speed=speed,
        again=again,
    )


def _first_screen(content: Content, spent: float | None) -> dict[str, Any]:
    """The part of a page that is visible without scrolling: verdict, counts, and setting, in short."""
    judged = verdicts.judged(content)
    happened = [(one.label, one.text) for one in facts.of_numbers(content.seen)[:_NUMBERS]]
    what = [(one.label, one.text) for one in facts.of_setting(content, _SURFACES)]
    return {
        "verdicts": judged,
        "answer": _answer(judged),
        "happened": happened + _speed(content, spent, None)[:1],
        "what": [row for row in what if not row[0].startswith("counter")],
    }


def _answer(judged: Sequence[Statement]) -> Answer:
    """The verdict that sums up the checks."""
    checked = [one.verdict for one in judged if one.verdict is not None]
    failed = checked.count(False)
    if failed:
        return Answer(f"✗ no: {failed} of {len(checked)} checks fail{'s' * (failed == 1)}", False)
    return Answer("✓ yes: it holds" if len(checked) == 1 else f"✓ yes: all {len(checked)} checks hold", True)


def _when(makers: dict[str, str], path: Path) -> list[str]:
    """The day of the run."""
    if "date" in makers:
        moment = datetime.datetime.fromisoformat(makers["date"])
        return [f"run on {moment.day} {moment:%B %Y, %H:%M} UTC"]
    moment = datetime.datetime.fromtimestamp(path.stat().st_mtime, datetime.UTC)
    return [f"file of {moment.day} {moment:%B %Y, %H:%M} UTC"]


def _speed(content: Content, spent: float | None, threads: int | None) -> list[tuple[str, str]]:
    """The wall time of a run and its pace, as far as known."""
    if spent is None:
        return [("wall time", "not kept: an older version of swarm, or a cluster, has written the file")]
    events = float(content.seen["impacts"][-1]) + float(content.seen.get("collisions", [0.0])[-1])
    rows = [("wall time", f"{amount(spent, 's', 3)}, compilation included")]
    if events and spent > 0.0:
        rows.append(("impacts a second of it", many(float(f"{events / spent:.3g}"))))
    return rows + ([] if threads is None else [("threads", str(threads))])


def _versions(makers: dict[str, str], seed: int | None) -> list[tuple[str, str]]:
    """The versions of the software, and the machine, of a run."""
    names = {"version": "swarm", "python": "Python", "numpy": "NumPy", "numba": "Numba", "hdf5": "HDF5"}
    rows = [(title, makers[name]) for name, title in names.items() if name in makers]
    rows += [("machine", makers["machine"])] if "machine" in makers else []
    return rows + ([] if seed is None else [("seed of thermal walls", str(seed))])


def require_trajectory(path: Path) -> None:
    """Raise a SceneError if a file is a log of impacts, which has no report."""
    from ..files.stored import is_log

    if is_log(path):
        raise SceneError(f"{path} is a log of impacts, of which there is no report; take the trajectory of the run")

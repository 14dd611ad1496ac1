"""A sweep as a whole: its file, its folder, its workers and its table."""

import math
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..common import checks, interrupt
from ..common.checks import path_of
from ..common.extras import needed_by
from ..errors import FileError, SceneError
from ..files.lock import only_writer
from ..run.options import cores
from ..serialization.plugins import checked_modules
from .plan import Plan, read
from .pool import Pool
from .results import TABLES, Results, require_written
from .shown import shown

if TYPE_CHECKING:
    import pandas as pd

# The main thread looks so often for signals and at the time [s].
_GLANCE = 0.1
# The table is written during a sweep so often at most [s], and so much longer than it takes to write.
_TABLE_EVERY, _TABLE_SHARE = 10.0, 50.0


@dataclass(frozen=True)
class SweepOptions:
    """The options of a sweep; `sweep` describes each, `walltime` as of `simulate`."""

    folder: str | os.PathLike[str] | None = None
    processes: int | None = None
    threads: int | None = None
    resume: bool = False
    overwrite: bool = False
    progress: bool = False
    table: str = "csv"
    walltime: float | None = None
    plugins: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("processes", "threads"):
            if getattr(self, name) is not None:
                checks.count(name, getattr(self, name))
        for name in ("resume", "overwrite", "progress"):
            checks.flag(name, getattr(self, name))
        checks.one_of("table", self.table, TABLES)
        if self.walltime is not None:
            checks.positive("walltime", self.walltime)
        if self.resume and self.overwrite:
            raise SceneError("resume and overwrite contradict each other: leave one of them out")


@dataclass(frozen=True)
class Outcome:
    """The end of a sweep: its results, why it was stopped ("interrupted", "walltime") or "", and its seconds."""

    results: Results
    stopped: str
    wall_time: float


def sweep(  # noqa: PLR0913  the keywords are the public interface
    path: str | os.PathLike[str],
    folder: str | os.PathLike[str] | None = None,
    *,
    processes: int | None = None,
    threads: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    table: str = "csv",
    plugins: Sequence[str] = (),
) -> "pd.DataFrame":
    """Carry out the runs of a sweep file, a scene file with a [sweep] table, and return the table of their results.

        [sweep]
        combine = "product"                          # every value with every other; or "zip"
        "surface.0.restitution" = [0.5, 0.7, 0.9]    # a key of the scene file: a table or list and what is in it
        "particles.seed" = {range = 20}              # 0 to 19; {linspace = [a, b, n]}, {geomspace = [a, b, n]}

    Every run is an ordinary one, with its trajectory STEM.h5, its checkpoint, and STEM.json, which notes its end; the
    stem is a digest of its scene, so that lists can be made longer later. A run that fails is a row with its sentence
    and stops no other. The scripts of callers need no `if __name__ == "__main__"`.

    Args:
        path: the sweep file.
        folder: of all files, made if it is not there; None: the name of the file without .toml, in the current folder.
        processes: number of worker processes; None: the cores that this process may use.
        threads: of each run whose file does not say how many; None: the cores for each process. Results do not depend
            on it, nor on `processes`.
        resume: go on with what the folder holds: runs that are done are not run again, others go on from their
            checkpoint or begin anew, also those that have failed.
        overwrite: replace the runs that the folder holds.
        progress: True for one progress bar of all runs.
        table: the file results.csv or results.parquet in the folder, "csv" or "parquet". It is replaced now and then
            during the sweep, and at its end.
        plugins: the modules whose code the file may name, as "module:Name": laws, surfaces, methods, observables.

    Returns:
        The table, a row for each run in the order of the file (of a product the last key changes first): file,
        the keys of the sweep, state ("done", "failed" or "waiting"), error, wall_time [s], and the observables of the
        last frame, vectors as momentum_x, values of surfaces as impulse_0.

    Raises:
        SceneError: bad input: the sweep file, the scene of any run, a folder that holds runs; nothing has run.
        FileError: a file cannot be written, or another sweep uses the folder.
        RunError: the worker processes cannot be started.
        KeyboardInterrupt: SIGINT or SIGTERM came; the runs have saved checkpoints, and the table is written.
    """
    with needed_by("the table of a sweep in Python", "table"):
        import pandas  # noqa: F401
    options = SweepOptions(
        folder, processes, threads, resume, overwrite, progress, table, plugins=checked_modules(plugins)
    )
    outcome = carry_out(path, options)
    if outcome.stopped:
        raise KeyboardInterrupt
    return outcome.results.frame()


def carry_out(path: str | os.PathLike[str], options: SweepOptions) -> Outcome:
    """Carry out a sweep; an interrupt or the wall time limit ends it with its table written."""
    began = time.monotonic()
    require_written(options.table)
    source = path_of("path", path)
    folder = Path(source.stem) if options.folder is None else path_of("folder", options.folder)
    plan = read(source, options.plugins)
    results = Results(plan, folder, options.table)
    _require_free(results, options)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot make the folder {folder}: {error.strerror}") from error
    with only_writer(results.path, "table"):
        if options.overwrite:
            results.remove()
        results.find()
        results.keep_file()
        stopped = _run(plan, results, options, began)
        results.write()
    return Outcome(results, stopped, time.monotonic() - began)


def _require_free(results: Results, options: SweepOptions) -> None:
    """Raise a SceneError if the folder cannot be used, or holds what may not be replaced."""
    folder = results.folder
    if folder.exists() and not folder.is_dir():
        raise SceneError(f"folder: expected the name of a folder, got the file {folder}")
    if not folder.exists():
        return
    if options.resume or options.overwrite:
        results.require_own()
        return
    files = (file(run) for run in results.plan.variants for file in (results.trajectory, results.status_file))
    if results.path.exists() or results.others() or any(file.exists() for file in files):
        raise SceneError(
            f"folder: {folder} holds the runs of a sweep; go on with them (--resume, resume=True), replace them "
            "(--overwrite, overwrite=True), or choose another folder"
        )
    results.require_own()


def _run(plan: Plan, results: Results, options: SweepOptions, began: float) -> str:
    """Carry out what is left; why it was stopped, or ""."""
    mine = cores()
    left = len(plan.variants) - len(results.of_state("done"))
    processes = min(options.processes or mine, max(1, left))
    pool = Pool(results, processes, options.threads or max(1, mine // processes), options.resume)
    reasons: list[str] = []

    def stop(reason: str = "interrupted") -> None:
        reasons.append(reason)
        pool.stop()

    end = math.inf if options.walltime is None else began + options.walltime
    due, longest = time.monotonic() + _TABLE_EVERY, _TABLE_EVERY
    with interrupt.taken_by(stop), shown(options.progress) as show:

        def glance() -> None:
            nonlocal due, longest
            show(pool.progress())
            now = time.monotonic()
            if now >= end and not reasons:
                stop("walltime")
            if now >= due:
                results.write()
                longest = max(_TABLE_EVERY, _TABLE_SHARE * (time.monotonic() - now))
                due = time.monotonic() + longest

        pool.run(_GLANCE, glance)
    return reasons[0] if reasons and results.of_state("waiting") else ""

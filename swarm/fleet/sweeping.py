"""A sweep as a whole: its file, its folder, its fleet, and its table."""

import contextlib
import math
import os
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ..common import interrupt
from ..common.checks import path_of
from ..common.extras import needed_by
from ..common.validated import Count, Flag, Positive, Validated, choice
from ..errors import FileError, SceneError
from ..files.lock import only_writer
from ..run.options import cores
from ..run.progress import Pace, ProgressListener, progress_listener
from ..serialization.plugins import checked_modules
from . import sent_modules
from .connection import Workers, connected, require_known, require_read, require_same_versions, require_shared
from .jobs import Fleet, FleetJob, Stop
from .plan import Plan, Variant, read
from .processes import Place, Processes
from .results import TABLES, Results, require_written
from .sweep_run import RunOrder, run_variant

if TYPE_CHECKING:
    import pandas as pd

# The table is written during a sweep after this time [s] at least, and after this multiple of the time to write it.
_TABLE_EVERY, _TABLE_SHARE = 10.0, 50.0
# The window of the pace for the ETA [s]: several runs.
_WINDOW = 120.0


@dataclass(frozen=True)
class SweepOptions(Validated):
    """The options of a sweep; `sweep` describes each, `walltime` is that of `simulate`."""

    folder: str | os.PathLike[str] | None = None
    processes: Count | None = None
    threads: Count | None = None
    resume: Flag = False
    overwrite: Flag = False
    progress: Flag = False
    table: Annotated[str, choice(*TABLES)] = "csv"
    walltime: Positive | None = None
    plugins: tuple[str, ...] = ()
    cluster: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.resume and self.overwrite:
            raise SceneError("resume and overwrite contradict each other: leave one of them out")
        if self.cluster is not None:
            require_known(self.cluster)
            if self.processes is not None:
                raise SceneError(
                    f"processes must be None with a cluster, got {self.processes}: the runs are carried out by its "
                    "workers; leave one of the two out"
                )


@dataclass(frozen=True)
class Outcome:
    """The end of a sweep: its results, the reason of a stop ("interrupted", "walltime") or "", and wall time [s]."""

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
    cluster: Any = None,
) -> "pd.DataFrame":
    """Carry out the runs of a sweep file, a scene file with a [sweep] table, and return the table of their results.

        [sweep]
        combine = "product"     # every value with every other; or "zip"
        # keys of the scene file: a table or list, and its entry
        "surface.0.restitution" = [0.5, 0.7, 0.9]
        "particles.seed" = {range = 20}    # 0 to 19
        "run.until" = {linspace = [1.0, 2.0, 5]}    # or geomspace

    Every run is an ordinary one, with its trajectory STEM.h5, its checkpoint, and STEM.json, which notes its end; the
    stem is a digest of its scene, so that lists can be made longer later. A run that fails has its error
    in its row, and does not stop the others. Scripts need no `if __name__ == "__main__"`.

    Args:
        path: the sweep file.
        folder: the folder of all files, made if it is missing; None: named like the file, in the current folder.
        processes: number of worker processes; None: the cores that this process may use.
        threads: the threads of each run, unless its file has them; None: the cores for each process, 1 on a cluster.
            Results depend neither on it nor on `processes`.
        resume: continue in an existing folder: runs that are done are not run again, others continue from their
            checkpoint or start again, also those that have failed.
        overwrite: replace the runs in the folder.
        progress: True for one progress bar of all runs.
        table: the file results.csv or results.parquet in the folder, "csv" or "parquet". It is replaced now and then
            during the sweep, and at its end.
        plugins: the modules with code that the file may name, as "module:Name": laws, surfaces, methods, observables.
        cluster: where to run, as for `simulate`: None for processes of this machine; "local:N"; the address of a
            scheduler of Dask; or a `distributed.Client`. A worker carries out a run for each of its threads. The
            folder, and the files that the scene names, must be on storage that all workers share. The files are the
            same as without a cluster; a run on a worker that died is resumed from its checkpoint.

    Returns:
        The table, a row for each run in the order of the file (in a product the last key changes first): file,
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
        folder,
        processes,
        threads,
        resume,
        overwrite,
        progress,
        table,
        plugins=checked_modules(plugins),
        cluster=cluster,
    )
    outcome = carry_out_sweep(path, options)
    if outcome.stopped:
        raise KeyboardInterrupt
    return outcome.results.frame()


def carry_out_sweep(path: str | os.PathLike[str], options: SweepOptions, first: Place | None = None) -> Outcome:
    """Carry out a sweep; after an interrupt or at the wall time limit the table is written too.

    `first` is a process of this machine that may already have started.
    """
    began = time.monotonic()
    require_written(options.table)
    source = path_of("path", path)
    folder = Path(source.stem) if options.folder is None else path_of("folder", options.folder)
    plan = read(source, options.plugins)
    results = Results(plan, folder, options.table)
    _require_free(results, options)
    stop = Stop()
    with contextlib.ExitStack() as stack:
        stack.enter_context(interrupt.taken_by(stop.interrupt))
        client = None if options.cluster is None else stack.enter_context(connected(options.cluster, stop))
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"cannot make the folder {folder}: {error.strerror}") from error
        stack.enter_context(only_writer(results.path, "table"))
        if client is not None:
            require_same_versions(client)
            require_shared(client, folder.absolute())
            require_read(client, plan.named)
        if options.overwrite:
            results.remove()
        results.find()
        results.keep_file()
        _Runs(plan, results, options, stop, began).carry_out(client, first)
        results.write()
    stopped = stop.reason if results.of_state("waiting") else ""
    return Outcome(results, stopped, time.monotonic() - began)


def _require_free(results: Results, options: SweepOptions) -> None:
    """Raise a SceneError if the folder cannot be used, or has files that may not be replaced."""
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


class _Runs:
    """The remaining runs of a plan."""

    def __init__(self, plan: Plan, results: Results, options: SweepOptions, stop: Stop, began: float) -> None:
        self._plan, self._results, self._options, self._stop = plan, results, options, stop
        self._left = [variant for state in ("failed", "waiting") for variant, _status in results.of_state(state)]
        self._done, self._failed = len(results.of_state("done")), 0
        self._end = math.inf if options.walltime is None else began + options.walltime
        self._due = time.monotonic() + _TABLE_EVERY
        self._pace, self._stops = Pace(_WINDOW), False

    def carry_out(self, client: Any, first: Place | None) -> None:
        """Carry out the runs, by the workers of a client, or by processes of this machine."""
        fleet: Fleet
        if client is None:
            mine = cores()
            processes = min(self._options.processes or mine, max(1, len(self._left)))
            fleet, threads, modules = Processes(self._stop, processes, first), max(1, mine // processes), None
        else:
            fleet, threads = Workers(client, self._stop), 1
            modules = sent_modules.pickled() if self._plan.plugins else None
        threads = self._options.threads or threads
        orders = ((one.number, self._order(one, threads, modules)) for one in _in_order(self._left))
        made = (FleetJob(number, run_variant, (order,)) for number, order in orders)
        shown = progress_listener(sentences_stay=True) if self._options.progress else contextlib.nullcontext()
        with fleet, shown as show:
            fleet.run(made, self._note, lambda: self._look(fleet, show))

    def _order(self, variant: Variant, threads: int, modules: bytes | None) -> RunOrder:
        impacts = self._results.impacts(variant)
        return RunOrder(
            self._plan.text(variant), self._plan.path.absolute(), self._results.trajectory(variant).absolute(),
            None if impacts is None else impacts.absolute(), threads, self._plan.plugins, modules,
        )  # fmt: skip

    def _note(self, number: int, outcome: dict[str, Any]) -> None:
        """Write the outcome of a run, unless the run continues in the next session."""
        if outcome["state"] == "stopped" or (outcome["state"] == "failed" and self._stop.reason):
            return
        about = {"state": "", "error": None, "wall_time": None, "observables": {}} | outcome
        about.pop("lost", None)
        self._results.add(self._plan.variants[number], about)
        self._done += outcome["state"] == "done"
        self._failed += outcome["state"] == "failed"

    def _look(self, fleet: Fleet, show: ProgressListener | None) -> None:
        """Check the time, show the progress if wanted, and write the table now and then."""
        now = time.monotonic()
        if now >= self._end:
            self._stop.because("walltime")
        sentences = fleet.new_sentences()
        if self._stop.reason and not self._stops:
            self._stops = True
            sentences = ["stopping: the runs under way save checkpoints; a second Ctrl-C ends them at once"]
        if show is not None:
            if sentences:
                show.say("\n".join(sentences))
            show.put(*line_of(self._pace, len(self._plan.variants), self._done, self._failed, fleet.shares.values()))
        if now >= self._due:
            self._results.write()
            self._due = time.monotonic() + max(_TABLE_EVERY, _TABLE_SHARE * (time.monotonic() - now))


def line_of(pace: Pace, runs: int, done: int, failed: int, shares: Collection[float]) -> tuple[float, str]:
    """The progress of all runs, including those under way, and a line about it with the ETA."""
    ended = done + failed
    share = (ended + sum(shares)) / runs
    pace.note(share)
    return share, f"{ended}/{runs} runs  {len(shares)} running{f'  {failed} failed' * bool(failed)}{pace.eta(1.0)}"


def _in_order(variants: list[Variant]) -> Iterator[Variant]:
    """The first variant of each kind, then the others: workers compile kernels of several kinds at the same time."""
    kinds: set[str] = set()
    rest: list[Variant] = []
    for variant in sorted(variants, key=lambda one: one.number):
        if variant.kind in kinds:
            rest.append(variant)
        else:
            kinds.add(variant.kind)
            yield variant
    yield from rest

"""A run on this machine: the loop over frames, and their observers."""

import contextlib
import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import interrupt
from ..frames import Frame
from ..kernel.cache import kernels_compiled
from ..particles import Multipliers, Particles
from .compiling import Compilations
from .impacts import Impacts, log_of
from .options import Task
from .outputs import recorder_of, writer_of
from .runs import AnyRun, run_of
from .session import Session
from .tally import Watched, tally_of

if TYPE_CHECKING:
    from ..output.background import Background
    from .progress import Display

_LOG = logging.getLogger("swarm")
# The observable that holds the sums over chunks of a shard: those of all shards are joined from it.
CHUNK_SUMS = "chunk_sums"


class End(NamedTuple):
    """How a run ended; `simulation.Result` describes each."""

    particles: Particles
    observables: dict[str, NDArray[Any]]
    wall_time: float
    multipliers: Multipliers | None
    impacts: NDArray[np.int64]
    escape_time: NDArray[np.float64]
    members: list[NDArray[np.int64]] | None


def carry_out(task: Task, session: Session) -> End:
    """Carry out a run that is checked."""
    if task.scene.is_open() and not task.is_shard:
        warn_open()

    from .progress import display  # rich is imported only when it is shown

    recorder = recorder_of(task)
    log, tally = log_of(task), tally_of(task)
    runs: list[AnyRun] = []

    def stop() -> None:
        session.stop()
        for one in runs:
            one.halt()

    shown, compilations = display(task.options.progress), Compilations()
    with (
        session,
        interrupt.taken_by(stop),
        shown as show,
        kernels_compiled(show.compiling, compilations.sentence),
    ):
        session.prepare(task, log)
        _require_room(task, session)
        run = run_of(task, Watched(log, tally))
        runs.append(run)
        compilations.calls = run.calls
        session.restore(run)
        writer = writer_of(task, session, recorder, log)
        history = _frames(task, session, run, writer, show, log)
        session.finish()
        return End(
            task.particles,
            _observables(task, history),
            session.wall_time(),
            run.state.multipliers,
            run.state.impacts,
            np.full(len(task.particles), np.nan) if run.state.escape_time is None else run.state.escape_time,
            None if tally is None else tally.of_members(),
        )


def _observables(task: Task, history: list[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    """Those of all frames; none of a shard, which are joined to those of the others."""
    if task.is_shard:
        return {}
    trajectory = task.options.trajectory
    return _columns(history) if trajectory is None else read_back(trajectory)


def warn_open() -> None:
    """Warn that the scene is open."""
    _LOG.warning("the scene is open: particles may fly to infinity; the observable 'escaped' counts them")


def _frames(
    task: Task, session: Session, run: AnyRun, writer: "Background | None", show: "Display", log: Impacts | None
) -> list[dict[str, Any]]:
    """All frames of this session: their observables, if no trajectory holds them."""
    history: list[dict[str, Any]] = []
    until, span_of = task.options.until, task.method.span
    with run, writer or contextlib.nullcontext(lambda *frame: None) as write:
        for number, before, moment in task.options.times:
            session.require_same_time(number, moment)
            if number < session.first:
                continue
            if number == 0:
                run.observe()
            else:
                span = span_of("time", moment) - span_of("time", before)
                if log is not None:
                    log.begin = before
                while not run.advance(span, moment, *_meanwhile(session, writer, show)):
                    show.within(before + run.share_done(span) * (moment - before), until)
                    session.look(run, writer, number - 1, before, moment)
            seen = {"time": moment, **run.seen()}
            if task.is_shard:
                seen[CHUNK_SUMS] = run.chunk_sums()
            run.require_admissible(seen, moment)
            if task.options.trajectory is None:
                history.append(seen)
            if log is not None:
                log.ends[number] = log.total
            write(number, moment, run.state, seen)
            show.frame(Frame(number, moment, until, seen, writer.written if writer else 0))
            if moment < until:
                session.look(run, writer, number, moment, None)
    return history


def _meanwhile(session: Session, writer: "Background | None", show: "Display") -> tuple[float, float]:
    """For `Run.advance`: the time to write a frame [s], and when to return at the latest."""
    return writer.seconds if writer else 0.0, min(session.latest, time.monotonic() + show.every)


def _require_room(task: Task, session: Session) -> None:
    """Raise a SceneError if the frames do not fit on the disk or in memory."""
    options, storage = task.options, task.options.storage
    numbers, packed = storage.bytes_of(len(task.particles)), storage.compression != "none"
    options.times.require_room(session.first, options.trajectory, numbers, len(task.scene.surfaces), packed)


def _columns(history: list[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    return {name: np.array([seen[name] for seen in history]) for name in history[0]}


def read_back(trajectory: Path) -> dict[str, NDArray[Any]]:
    """All frames of all sessions. During the run they are not kept in memory, which would grow without limit."""
    from ..output.trajectory import load

    with load(trajectory) as written:
        return written.observables

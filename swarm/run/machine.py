"""A run on this machine: the loop over frames, and its observers."""

import contextlib
import functools
import logging
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..common import interrupt
from ..common.catalog import CHUNK_SUMS, Observables
from ..common.frames import Frame
from ..common.snapshot import NOTHING, Read, Snapshot
from ..kernel.cache import kernels_compiled
from ..kernel.compiling import Compilations
from ..particles import ARRAYS, Particles
from ..scene import Scene
from ..state import Floats
from . import failures
from .base import BaseRun
from .engines import run_of
from .impacts import log_of
from .measures import Measures
from .options import Task
from .outputs import recorder_of, writer_of
from .preflight import hints
from .progress import LOOK, Display, Standstill, display
from .result import Result
from .session import Session
from .tally import Watched, tally_of

if TYPE_CHECKING:
    from ..files.background import Background

_LOG = logging.getLogger("swarm")
# The frames after which observables are packed into arrays: as Python objects they take 3 kB a frame.
_PACKED = 1024


class Columns:
    """The observables of all frames, each as an array with one entry for each frame."""

    def __init__(self) -> None:
        self._frames: list[dict[str, Any]] = []
        self._packed: list[dict[str, NDArray[Any]]] = []

    def add(self, seen: dict[str, Any]) -> None:
        """Add a frame."""
        self._frames.append(seen)
        if len(self._frames) == _PACKED:
            self._pack()

    def _pack(self) -> None:
        if self._frames:
            self._packed.append({name: np.array([seen[name] for seen in self._frames]) for name in self._frames[0]})
            self._frames = []

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the observables of all frames, in the order of a file: the time, then the others by their names."""
        self._pack()
        names = sorted(self._packed[0], key=lambda name: (name != "time", name)) if self._packed else []
        return {name: np.concatenate([part[name] for part in self._packed]) for name in names}


def carry_out_task(task: Task, session: Session) -> Result:
    """Carry out a checked run, frame by frame."""
    if task.scene.is_open() and not task.scene.is_open_upwards_only() and not task.is_shard:
        warn_open()
    if not task.is_shard:
        hints.give(task)
    until, span_of, kept = task.options.until, task.method.span, Columns()
    still = Standstill(lambda: failures.unproved(task.scene))
    with failures.explained(task), _begun(task, session) as (run, writer, show, (log, tally, _counters), measures):
        with run, writer or contextlib.nullcontext(lambda *frame: None) as write:
            for number, before, moment in session.frames(task.options.times):
                if number == 0:
                    run.observe()
                else:
                    span = span_of("time", moment) - span_of("time", before)
                    if log is not None:
                        log.begin = before
                    while not run.advance(span, moment, *_meanwhile(session, writer, show)):
                        share = run.share_done(span)
                        still.look(number, share, run.furthest_behind(), session.compiled.seconds)
                        show.within(before + share * (moment - before), until)
                        session.look(run, writer, number - 1, before, moment)
                seen = {"time": moment, **run.seen()}
                seen |= tally.seen(run.state.absorbed_wall, task.is_shard) if tally else {}
                run.require_admissible(seen, moment)
                read = functools.partial(getattr, run.state)
                seen |= measures.of(number, moment, _snapshot_of(task, read, moment)) if measures else {}
                # The file of a shard has its sums; the observables of the run are made of the sums of all shards.
                if task.is_shard:
                    seen |= {} if task.is_coupled else {CHUNK_SUMS: run.chunk_sums()}
                else:
                    kept.add(seen)
                if log is not None:
                    log.ends[number] = log.total
                write(number, moment, run.state, seen)
                shown = _snapshot_of(task, read, moment) if callable(task.options.progress) else NOTHING
                show.frame(Frame(number, moment, until, Observables(seen), writer.written if writer else 0, shown))
                shown.end()
                if moment < until:
                    session.look(run, writer, number, moment, None)
        session.finish()
        return _end(task, session, run, kept)


@contextlib.contextmanager
def _begun(task: Task, session: Session) -> Iterator[tuple[BaseRun, Any, Display, Watched, Measures]]:
    """Yield a run at its start or checkpoint, its `Background` writer or None, display, records and measures.

    Until the context ends, signals stop the run and its files are locked.
    """
    recorder, watched = recorder_of(task), Watched(log_of(task), tally_of(task), task.options.counters)
    runs: list[BaseRun] = []

    def stop() -> None:
        session.stop()
        for one in runs:
            one.halt()

    shown, compilations = display(task.options.progress), Compilations()
    with (
        session, interrupt.taken_by(stop), shown as show,
        kernels_compiled(show.compiling, compilations.sentence, _why_slow(task.scene)) as session.compiled,
    ):  # fmt: skip
        session.prepare(task, watched.log)
        measures = _measures_of(task, session)
        options, storage = task.options, task.options.storage
        options.times.require_room(
            session.first, options.trajectory, storage.bytes_of(len(task.particles)), len(task.scene.surfaces),
            storage.compression != "none", measures.size() + (watched.tally.size() if watched.tally else 0),
        )  # fmt: skip
        runs.append(run := run_of(task, watched))
        compilations.calls = run.calls
        session.restore(run)
        yield run, writer_of(task, session, recorder, watched.log), show, watched, measures


def _why_slow(scene: Scene) -> str:
    """Return the sentence on why kernels of a scene may take long to compile; "" for fewer than two such walls."""
    rough = sum(one.motion is not None and bool(one.friction) for one in scene.surfaces)
    if rough < 2:
        return ""
    return f"each of the {rough} walls that move and have friction adds some seconds; the triangles of one Mesh do not"


def _measures_of(task: Task, session: Session) -> Measures:
    """Return the user-defined observables of a run, with shapes from the start, or from a resumed trajectory."""
    made = Measures(task.options.observables, task.options.until)
    if made and session.first == 0:
        made.begin(0, 0.0, start_of(task))
    elif made:
        from ..files.trajectory import load

        with load(task.options.trajectory) as written:
            made.expect({name: values.shape[1:] for name, values in written.observables_of(slice(1)).items()})
    return made


def start_of(task: Task) -> Snapshot:
    """Return the particles of a run at its start."""
    arrays: dict[str, Any] = {name: getattr(task.particles, name) for name in ARRAYS}
    arrays["impacts"] = np.zeros(len(task.particles), np.int64)
    arrays["collisions"] = None if task.particles.radius is None else np.zeros(len(task.particles), np.int64)
    return _snapshot_of(task, arrays.get, 0.0)


def _snapshot_of(task: Task, read: Read, moment: float) -> Snapshot:
    """Return the particles of a run in the scene at a moment [s]."""
    scene, births = task.scene, task.particles.births
    born = read("born_time")
    there: Any = None if births is None else births.there(moment)
    there = there if born is None else ~np.isnan(born)
    return Snapshot(read, scene.gravity, scene.period, there)


def _end(task: Task, session: Session, run: BaseRun, kept: Columns) -> Result:
    state, particles = run.state, task.particles
    born = birth_times(particles) if state.born_time is None else state.born_time
    # Balls that were not born have no place.
    particles.position[:, np.isnan(born)] = particles.velocity[:, np.isnan(born)] = np.nan
    is_whole, never = session.first == 0 or task.is_shard, np.full(len(particles), np.nan)
    return Result(
        particles,
        Observables(kept.arrays() if is_whole else read_back(task.options.trajectory)),
        session.wall_time(),
        task.options.trajectory,
        state.multipliers,
        state.impacts,
        never if state.escape_time is None else state.escape_time,
        never.copy() if state.absorbed_time is None else state.absorbed_time,
        None if task.bodies is None else task.bodies.moved(particles),  # type: ignore[arg-type]
        task.scene,
        task.method,
        born,
        state.collisions,
        session.compiled.seconds,
    )


def birth_times(particles: Particles) -> Floats:
    """Return the birth time of each particle [s], 0 for particles of the start."""
    return np.zeros(len(particles)) if particles.births is None else particles.births.time


def warn_open() -> None:
    """Warn that the scene is open."""
    _LOG.warning("the scene is open: particles may fly to infinity; the observable 'escaped' counts them")


def _meanwhile(session: Session, writer: "Background | None", show: Display) -> tuple[float, float]:
    """Return the last arguments of `BaseRun.advance`: the time to write a frame [s], and the latest time to return."""
    return writer.seconds if writer else 0.0, min(session.latest(writer), time.monotonic() + min(show.every, LOOK))


def read_back(trajectory: Path) -> dict[str, NDArray[Any]]:
    """Return the observables of all frames of all sessions."""
    from ..files.trajectory import load

    with load(trajectory) as written:
        return written.observables

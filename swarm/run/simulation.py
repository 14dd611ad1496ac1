"""From a scene to frames: the loop over frames, and their observers."""

import contextlib
import logging
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import interrupt
from ..bodies.state import Bodies
from ..frames import Frame
from ..kernel.cache import kernels_compiled
from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from .admission import task_of
from .impacts import Impacts, log_of
from .options import RunOptions, Task
from .outputs import recorder_of, writer_of
from .result import Result
from .runs import AnyRun, run_of
from .session import Session
from .tally import Watched, tally_of

if TYPE_CHECKING:
    from ..output.background import Background
    from .progress import Display

_LOG = logging.getLogger("swarm")


def simulate(  # noqa: PLR0913  the keywords are the public interface
    scene: Scene,
    particles: Particles | Bodies,
    method: Method,
    *,
    until: float,
    every: float | None = None,
    trajectory: str | os.PathLike[str] | None = None,
    recording: str | os.PathLike[str] | None = None,
    impacts: str | os.PathLike[str] | None = None,
    impact_particles: str | int | Sequence[int] = "all",
    member_impacts: bool = False,
    record_particles: int = 5000,
    record_color: str = "speed",
    record_megabytes: float = 100.0,
    live: bool | str = False,
    threads: int | None = None,
    progress: bool | Callable[[Frame], None] = False,
    overwrite: bool = False,
    scene_text: str | None = None,
    block_size: int | None = None,
    frames: str | int = "all",
    precision: str = "float64",
    compression: str = "none",
    checkpoint: float | None = None,
    resume: bool = False,
    walltime: float | None = None,
    compile: str = "auto",
    seed: int = 0,
) -> Result:
    """Advance particles in a scene and observe them at frames.

        check everything
        for each frame: 0, every, 2 every, ..., until
            advance all blocks to the frame   (not for the first)
            observe; fail if a number is not finite, or a particle outside rigid walls
            copy the frame; a background thread writes and flushes it
            update the progress display
            save a checkpoint if one is due (within a long frame too)

    Args:
        scene: the walls and gravity.
        particles: the start, particles or bodies; it is not changed.
        method: how to advance; bodies by Impact with a dt, Penalty, or AugmentedLagrangian with adaptive=True.
        until: end of the run [s], above 0.
        every: time between frames [s], at most `until`; None: only the first and the last.
        trajectory: HDF5 file to write; its folder must exist.
        recording: Rerun file to write; its folder must exist. Needs the packages of the extra "record".
        impacts: HDF5 file for a log of every impact, by Impact; see `load_impacts`. Its folder must exist.
        impact_particles: those whose impacts it has, "all", k for every k-th one, or a list of their numbers.
        member_impacts: True to count the impacts on each member of each surface, by Impact; see `Result`.
        record_particles: the most particles recorded, evenly chosen.
        record_color: what their colour shows, "speed" or "energy-error".
        record_megabytes: largest size of the recording, above 0; of too many frames every k-th is recorded.
        live: True to show the run in a Rerun viewer on this machine, or the URL of a viewer.
        threads: number of threads; None: all cores this process may use. Results have the same bits for any number.
        progress: True for a progress bar, or a function that is called with every `Frame`.
        overwrite: replace an existing recording, and an existing trajectory as soon as the first frame is complete.
        scene_text: the scene file's text, kept in the trajectory; None: it is written from the objects.
        block_size: particles that a thread takes at a time. Results do not depend on it.
        frames: what the trajectory keeps of the particles: "all", "none", or k, every k-th one.
        precision: "float64", or "float32" for frames, and rows of the log of impacts, of half the size; observables,
            checkpoints and the times of impacts stay exact.
        compression: of the frames, "none", "gzip" or "lzf".
        checkpoint: seconds of wall time from one checkpoint to the next, above 0; None: none. It is the
            file TRAJECTORY.checkpoint, until the run is complete.
        resume: continue from that checkpoint, with the same bits as if the run had never stopped; start a new run if
            there is neither a checkpoint nor a trajectory.
        walltime: seconds of wall time after which the run stops.
        compile: "auto": kernels that an earlier run compiled are used; others run in plain Python, with the same bits,
            and after about a second the rest of the run is compiled. "always": compiled from the start. "never":
            plain Python only.
        seed: of the random numbers of thermal walls, from 0 to 2**64 - 1: the same seed gives the same bits.

    Returns:
        A `Result`.

    Raises:
        SceneError: bad input, or a checkpoint of another run; nothing has run or been written.
        FileError: the trajectory or the recording cannot be written, or another run is writing it.
        RunError: a step failed; the frames before it are in the trajectory.
        KeyboardInterrupt: SIGINT or SIGTERM came; the frames before it are in the trajectory.
        WallTimeError: the wall time limit is reached; the frames before it are in the trajectory.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> result = swarm.simulate(cavity, swarm.fill(cavity, 10, speed=1.0), swarm.Impact(), until=2.0, every=0.5)
    >>> result.observables["time"]
    array([0. , 0.5, 1. , 1.5, 2. ])
    """
    # So far the only local names are the arguments.
    keywords = {name: value for name, value in locals().items() if name not in ("scene", "particles", "method")}
    return carry_out(scene, particles, method, RunOptions(**keywords))


def carry_out(scene: Scene, particles: Particles | Bodies, method: Method, options: RunOptions) -> Result:
    """`simulate` with its keywords as `RunOptions`."""
    session = Session(options)
    task = task_of(scene, particles, method, options)
    if scene.is_open():
        _LOG.warning("the scene is open: particles may fly to infinity; the observable 'escaped' counts them")

    from .progress import display  # rich is imported only when it is shown

    recorder = recorder_of(task)
    log, tally = log_of(task), tally_of(task)
    runs: list[AnyRun] = []

    def stop() -> None:
        session.stop()
        for one in runs:
            one.halt()

    with session, interrupt.taken_by(stop), display(options.progress) as show, kernels_compiled(show.compiling):
        session.prepare(task, log)
        _require_room(task, session)
        run = run_of(task, Watched(log, tally))
        runs.append(run)
        session.restore(run)
        writer = writer_of(task, session, recorder, log)
        history = _frames(task, session, run, writer, show, log)
        session.finish()
        return Result(
            task.particles,
            _columns(history) if options.trajectory is None else _read_back(options.trajectory),
            session.wall_time(),
            options.trajectory,
            run.state.multipliers,
            run.state.impacts,
            np.full(len(task.particles), np.nan) if run.state.escape_time is None else run.state.escape_time,
            None if tally is None else tally.of_members(),
            None if task.bodies is None else task.bodies.moved(task.particles),
            scene,
            method,
        )


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


def _read_back(trajectory: Path) -> dict[str, NDArray[Any]]:
    """All frames of all sessions. During the run they are not kept in memory, which would grow without limit."""
    from ..output.trajectory import load

    with load(trajectory) as written:
        return written.observables

"""From a scene to frames: checks, the loop over frames, and who is told of them."""

import contextlib
import logging
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import checks, interrupt
from ..errors import SceneError
from ..frames import Frame, FrameTimes
from ..kernel.cache import kernels_compiled
from ..methods.base import Method, check_surfaces
from ..output import paths
from ..output.storage import Storage
from ..particles import Multipliers, Particles
from ..scene import Scene
from ..surfaces.formulas.own import require_compiled
from . import tiers, workload
from .engine import Run
from .session import Session

if TYPE_CHECKING:
    from ..output.beside import Beside, Writer
    from .progress import Display

_LOG = logging.getLogger("swarm")
# A particle this many times round-off of the scene's size outside a rigid wall still counts as on it at the start.
_ON_THE_WALL = 64.0 * np.finfo(np.float64).eps


@dataclass(frozen=True)
class Result:
    """The end of a run.

    Attributes:
        particles: the particles at `until`.
        observables: name -> array with one entry a frame; "momentum" and "angular_momentum" (frames, 3), "impulse"
            (frames, surfaces).
        wall_time: seconds the run took in all its sessions, compilation included.
        trajectory: the file that was written, or None.
        multipliers: for a method with multipliers, what their loops took of each particle; else None.
    """

    particles: Particles
    observables: dict[str, NDArray[Any]]
    wall_time: float
    trajectory: Path | None
    multipliers: Multipliers | None


def simulate(
    scene: Scene,
    particles: Particles,
    method: Method,
    *,
    until: float,
    every: float | None = None,
    trajectory: str | os.PathLike[str] | None = None,
    recording: str | os.PathLike[str] | None = None,
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
) -> Result:
    """Advance particles in a scene and observe them at frames.

        check everything
        for each frame: 0, every, 2 every, ..., until
            advance all blocks to the frame   (not for the first)
            observe; stop if a number is not finite, or a particle outside rigid walls
            copy the frame; a thread beside writes and flushes it
            tell the progress display
            save a checkpoint if one is due (within a long frame too)

    Args:
        scene: the walls and gravity.
        particles: the start; it is not changed.
        method: how to advance.
        until: end of the run [s], above 0.
        every: time between frames [s], at most `until`; None: only the first and the last.
        trajectory: HDF5 file to write; its folder must exist.
        recording: Rerun file to write; its folder must exist. Needs the packages of the extra "record".
        record_particles: at most so many are recorded, evenly chosen.
        record_color: what colours them, "speed" or "energy-error".
        record_megabytes: how large the recording may become, above 0: of too many frames every k-th is recorded.
        live: True to show the run in a Rerun viewer on this machine, or the URL of a viewer.
        threads: number of threads; None: all cores this process may use. Results have the same bits for any number.
        progress: True for a progress bar, or a function that is called with every `Frame`.
        overwrite: replace an existing recording, and an existing trajectory as soon as the first frame is whole.
        scene_text: the scene file's text, kept in the trajectory; None: it is written from the objects.
        block_size: particles that a thread takes on at once. Results do not depend on it.
        frames: what the trajectory keeps of the particles: "all", "none", or k, every k-th one.
        precision: "float64", or "float32" for frames of half the size; observables and checkpoints stay exact.
        compression: of the frames, "none", "gzip" or "lzf".
        checkpoint: seconds of wall time from one checkpoint to the next, above 0; None: none is made. It lies beside
            the trajectory, as TRAJECTORY.checkpoint, until the run is complete.
        resume: go on from that checkpoint, with the same bits as if the run had never stopped; begin where there is
            neither a checkpoint nor a trajectory.
        walltime: seconds of wall time after which the run stops.
        compile: "auto": kernels that an earlier run compiled are used; others run in plain Python, with the same bits,
            and what is not done after about a second goes on compiled. "always": compiled from the start. "never":
            plain Python only.

    Returns:
        A `Result`.

    Raises:
        SceneError: bad input, or a checkpoint of another run; nothing has run or been written.
        FileError: the trajectory or the recording cannot be written, or another run is writing it.
        RunError: a step failed; the frames before it are in the trajectory.
        KeyboardInterrupt: SIGINT or SIGTERM came; the frames before it are in the trajectory.
        WallTimeError: the wall time is over; the frames before it are in the trajectory.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> result = swarm.simulate(cavity, swarm.fill(cavity, 10, speed=1.0), swarm.Impact(), until=2.0, every=0.5)
    >>> result.observables["time"]
    array([0. , 0.5, 1. , 1.5, 2. ])
    """
    target = None if trajectory is None else paths.target_of("trajectory", trajectory)
    recorded = None if recording is None else paths.target_of("recording", recording)
    paths.check_distinct(
        {"trajectory": target, "checkpoint": target and paths.checkpoint_of(target), "recording": recorded}, {}
    )
    session = Session(target, checkpoint, resume, walltime)
    times = FrameTimes(until, every)
    threads = _threads(threads)
    if block_size is not None:
        checks.count("block_size", block_size)
    checks.one_of("compile", compile, tiers.CHOICES)
    particles = _checked(scene, particles, method, times, compile)

    if scene.is_open():
        _LOG.warning("the scene is open: particles may fly to infinity; the observable 'escaped' counts them")

    from .progress import display  # rich is imported only when it is shown

    storage = Storage(frames, precision, compression)
    shown = {"particles": record_particles, "color": record_color, "megabytes": record_megabytes, "live": live}
    recorder = _recording(recorded, overwrite, resume, scene, method, particles, times, shown)
    runs: list[Run] = []

    def stop() -> None:
        session.stop()
        for run in runs:
            run.halt()

    with session, interrupt.taken_by(stop), display(progress) as show, kernels_compiled(show.compiling):
        session.prepare(scene, method, storage, particles, times.until, overwrite)
        numbers = storage.bytes_of(len(particles))
        times.require_room(session.first, target, numbers, len(scene.surfaces), storage.compression != "none")

        run = Run(scene, particles, method, threads, block_size, compile)
        runs.append(run)
        session.restore(run)
        history: list[dict[str, Any]] = []
        writer = _output(
            _trajectory(target, storage, scene, method, particles, scene_text, session),
            storage.kept(),
            recorder,
            len(particles),
        )
        writing = writer or contextlib.nullcontext(lambda *frame: None)

        with run, writing as write:
            for number, before, moment in times:
                session.require_same_time(number, moment)
                if number < session.first:
                    continue
                _reach(run, session, writer, method, show, number, before, moment, times.until)
                seen = {"time": moment, **run.seen()}
                run.require_admissible(seen, moment)
                if target is None:
                    history.append(seen)
                write(number, moment, run.state, seen)
                show.frame(Frame(number, moment, times.until, seen, writer.written if writer else 0))
                if moment < times.until:
                    session.look(run, writer, number, moment, None)
        session.finish()
        return Result(
            Particles.of(run.state),
            _columns(history) if target is None else _read_back(target),
            session.wall_time(),
            target,
            run.state.multipliers,
        )


def _reach(
    run: Run, session: Session, writer: "Beside | None", method: Method, show: "Display",
    number: int, before: float, moment: float, until: float,
) -> None:  # fmt: skip
    """Advance from one frame to the next, and observe it; the first is the start."""
    if number == 0:
        run.observe()
        return
    span = method.span("time", moment) - method.span("time", before)
    while not run.advance(
        span, moment, writer.seconds if writer else 0.0, min(session.latest, time.monotonic() + show.every)
    ):
        show.within(before + run.share_done(span) * (moment - before), until)
        session.look(run, writer, number - 1, before, moment)


def _columns(history: list[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    return {name: np.array([seen[name] for seen in history]) for name in history[0]}


def _read_back(trajectory: Path) -> dict[str, NDArray[Any]]:
    """All frames of all sessions. They are not kept in memory too, which would grow without end."""
    from ..output.trajectory import load

    with load(trajectory) as written:
        return written.observables


def _threads(threads: int | None) -> int:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores if threads is None else checks.count("threads", threads)


def _checked(scene: Scene, particles: Particles, method: Method, times: FrameTimes, compile: str) -> Particles:
    """The particles as they will run, all arguments being right."""
    for name, value, kind in (("scene", scene, Scene), ("particles", particles, Particles), ("method", method, Method)):
        if not isinstance(value, kind):
            raise SceneError(f"{name} must be a swarm.{kind.__name__}, got {type(value).__name__}")
    # The arrays of Particles may have been changed since it checked them.
    particles = particles.checked()
    check_surfaces(method, scene)
    if compile != "never":
        require_compiled(scene.surfaces)
    method.check(scene, particles)
    assert times.every is not None
    method.span("until", times.until)
    method.span("every", times.every)
    outside = scene.outside(particles.position, _ON_THE_WALL * _magnitude(scene, particles))
    if outside.size:
        first = int(outside[0])
        point = particles.position[:, first : first + 1]
        distances = scene.distances_outside(point)[:, 0]
        wall = int(np.argmax(np.where(np.isnan(distances), np.inf, distances)))
        phi = float(scene.surfaces[wall].phi(point)[0])
        raise SceneError(
            f"particles must start inside their walls, got {outside.size} of {len(particles)} outside; the first "
            f"is particle {first} at {tuple(point[:, 0].tolist())}, where phi = {phi:.6g} of surfaces[{wall}] "
            f"({type(scene.surfaces[wall]).__name__})"
        )
    workload.check(scene, particles, method, times.until, times.every)
    return particles


def _magnitude(scene: Scene, particles: Particles) -> float:
    """The size whose round-off a position on a wall has."""
    return max(float(particles.position.max()), -float(particles.position.min()), scene.finite_size())


def _trajectory(
    path: Path | None,
    storage: Storage,
    scene: Scene,
    method: Method,
    particles: Particles,
    scene_text: str | None,
    session: Session,
) -> "Writer | None":
    if path is None:
        return None
    from ..output.writer import TrajectoryWriter  # h5py takes 0.2 s to import

    return TrajectoryWriter(path, storage, scene, method, particles, scene_text, session.start, session.first > 0)


def _recording(
    path: Path | None,
    overwrite: bool,
    resume: bool,
    scene: Scene,
    method: Method,
    particles: Particles,
    times: FrameTimes,
    shown: dict[str, Any],
) -> "Writer | None":
    """What records for Rerun, if anything is to be."""
    if path is None and not shown["live"]:
        return None
    if resume:
        raise SceneError(
            "recording and live cannot go on with a run that was stopped; leave them out, and make the recording from "
            "the trajectory: swarm record RUN.h5 -o OUT.rrd"
        )
    from ..output.extras import needed_by

    with needed_by("a recording", "record"):
        from ..output.recording import RecordingWriter, Settings  # rerun takes half a second

    return RecordingWriter(path, overwrite, scene, method, particles, times.count, Settings(**shown))


def _output(trajectory: "Writer | None", kept: slice, recording: "Writer | None", n: int) -> "Beside | None":
    """A context that gives the function which writes a frame, in a thread of its own."""
    outputs = [(one, some) for one, some in ((trajectory, kept), (recording, slice(None))) if one is not None]
    if not outputs:
        return None
    from ..output.beside import Beside, Several

    return Beside(Several(outputs), n) if len(outputs) > 1 else Beside(outputs[0][0], n, outputs[0][1])

"""From a scene to frames: checks, the loop over frames, and what hears of them."""

import contextlib
import logging
import os
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import checks, interrupt
from .errors import SceneError
from .methods.base import Method
from .particles import Multipliers, Particles
from .run import Run
from .scene import Scene

if TYPE_CHECKING:
    from .output.beside import Beside
    from .output.trajectory import WriteFrames

_LOG = logging.getLogger("swarm")
# Frames nearer to `until` than this part of `every` are `until`.
_SAME_TIME = 1e-9
# A particle this many times round-off of the scene's size outside a rigid wall still counts as on it at the start.
_ON_THE_WALL = 64.0 * np.finfo(np.float64).eps


@dataclass(frozen=True)
class Frame:
    """What is known when a frame is done: for progress displays."""

    number: int
    time: float
    until: float
    observables: dict[str, Any]


@dataclass(frozen=True)
class Result:
    """The end of a run.

    Attributes:
        particles: the particles at `until`.
        observables: name -> array with one entry a frame; "momentum" and "angular_momentum" (frames, 3), "impulse"
            (frames, surfaces).
        wall_time: seconds the run took, compilation included.
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
) -> Result:
    """Advance particles in a scene and observe them at frames.

        check everything
        for each frame: 0, every, 2 every, ..., until
            advance all blocks to the frame   (not for the first)
            observe; stop if a number is not finite
            copy the frame; a thread beside writes and flushes it
            tell the progress display

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
        overwrite: replace an existing trajectory and recording.
        scene_text: the scene file's text, kept in the trajectory; None: it is written from the objects.
        block_size: particles that a thread takes on at once. Results do not depend on it.

    Returns:
        A `Result`.

    Raises:
        SceneError: bad input; nothing has run or been written.
        FileError: the trajectory or the recording cannot be written.
        RunError: a step failed; the frames before it are in the trajectory.
        KeyboardInterrupt: SIGINT came; the frames before it are in the trajectory.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> result = swarm.simulate(cavity, swarm.fill(cavity, 10, speed=1.0), swarm.Impact(), until=2.0, every=0.5)
    >>> result.observables["time"]
    array([0. , 0.5, 1. , 1.5, 2. ])
    """
    started = time.perf_counter()
    times = _frame_times(until, every)
    threads = _threads(threads)
    if block_size is not None:
        checks.count("block_size", block_size)
    _check(scene, particles, method, until, every)

    if scene.is_open():
        _LOG.warning("the scene is open: particles may fly to infinity; the observable 'escaped' counts them")

    from .progress import display  # rich is imported only when it is shown

    run = Run(scene, particles, method, threads, block_size)
    history: list[dict[str, Any]] = []
    writers = _trajectory(trajectory, overwrite, scene, method, particles, scene_text)
    if recording is not None or live:
        shown = {"particles": record_particles, "color": record_color, "megabytes": record_megabytes, "live": live}
        writers += _recording(recording, overwrite, scene, method, particles, _frame_count(until, every), shown)
    writer = _beside(writers, len(particles))
    writing = writer or contextlib.nullcontext(lambda *frame: None)
    with run, interrupt.taken_by(run.halt), writing as write, display(progress) as show:
        now = method.span("time", 0.0)
        for number, moment in enumerate(times):
            clock = method.span("time", moment)
            if number > 0:
                run.advance(clock - now, moment, writer.seconds if writer else 0.0)
            else:
                run.observe()
            now = clock
            seen = {"time": moment, **run.seen()}
            run.require_finite(seen, moment)
            history.append(seen)
            write(number, moment, run.state, seen)
            show(Frame(number, moment, until, seen))
    columns = {name: np.array([seen[name] for seen in history]) for name in history[0]}
    return Result(
        Particles.of(run.state),
        columns,
        time.perf_counter() - started,
        None if trajectory is None else Path(trajectory),
        run.state.multipliers,
    )


def _frame_times(until: float, every: float | None) -> Iterator[float]:
    """0, every, 2 every, ..., until."""
    end = checks.number("until", until)
    if end <= 0.0:
        raise SceneError(f"until must be after the start, 0 s, got {end:g}")
    gap = end if every is None else checks.positive("every", every)
    if gap > end:
        raise SceneError(f"every must be at most until = {end:g}, got {gap:g}")

    def times() -> Iterator[float]:
        number = 0
        while number * gap < end - _SAME_TIME * gap:
            yield number * gap
            number += 1
        yield end

    return times()


def _threads(threads: int | None) -> int:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores if threads is None else checks.count("threads", threads)


def _check(scene: Scene, particles: Particles, method: Method, until: float, every: float | None) -> None:
    for name, value, kind in (("scene", scene, Scene), ("particles", particles, Particles), ("method", method, Method)):
        if not isinstance(value, kind):
            raise SceneError(f"{name} must be a swarm.{kind.__name__}, got {type(value).__name__}")
    # The arrays of Particles may have been changed since it checked them.
    particles = Particles(particles.position, particles.velocity, particles.mass)
    method.check(scene, particles)
    method.span("until", until)
    method.span("every", until if every is None else every)
    distances = _distances_outside(scene, particles)
    outside = distances.max(axis=0) > _ON_THE_WALL * _magnitude(scene, particles)
    if outside.any():
        first = int(np.argmax(outside))
        wall = int(distances[:, first].argmax())
        phi = float(scene.surfaces[wall].phi(particles.position[:, first : first + 1])[0])
        raise SceneError(
            f"particles must start inside their walls, got {int(outside.sum())} of {len(particles)} outside; the first "
            f"is particle {first} at {tuple(particles.position[:, first].tolist())}, where phi = {phi:.6g} of "
            f"surfaces[{wall}] ({type(scene.surfaces[wall]).__name__})"
        )


def _distances_outside(scene: Scene, particles: Particles) -> NDArray[np.float64]:
    """Gap over its gradient for every surface and particle."""
    gaps = scene.gaps(particles.position)
    slopes = [np.sqrt((surface.gradient(particles.position) ** 2).sum(axis=0)) for surface in scene.surfaces]
    return np.asarray(gaps / np.maximum(slopes, np.finfo(np.float64).tiny))


def _magnitude(scene: Scene, particles: Particles) -> float:
    """The size whose round-off a position on a wall has."""
    return max(float(np.abs(particles.position).max()), scene.finite_size())


def _frame_count(until: float, every: float | None) -> int:
    return sum(1 for _moment in _frame_times(until, every))


def _beside(writers: "list[AbstractContextManager[WriteFrames]]", n: int) -> "Beside | None":
    """A context that gives the function which writes a frame, in a thread of its own."""
    if not writers:
        return None
    from .output.beside import Beside, Several

    return Beside(Several(writers), n)


def _trajectory(
    path: str | os.PathLike[str] | None,
    overwrite: bool,
    scene: Scene,
    method: Method,
    particles: Particles,
    scene_text: str | None,
) -> "list[AbstractContextManager[WriteFrames]]":
    if path is None:
        return []
    from .output.trajectory import TrajectoryWriter  # h5py takes 0.2 s to import

    return [TrajectoryWriter(Path(path), overwrite, scene, method, particles, scene_text)]


def _recording(
    path: str | os.PathLike[str] | None,
    overwrite: bool,
    scene: Scene,
    method: Method,
    particles: Particles,
    frames: int,
    shown: dict[str, Any],
) -> "list[AbstractContextManager[WriteFrames]]":
    from .output.extras import needed_by

    with needed_by("a recording", "record"):
        from .output.recording import RecordingWriter, Settings  # rerun takes half a second

    target = None if path is None else Path(path)
    return [RecordingWriter(target, overwrite, scene, method, particles, frames, Settings(**shown))]

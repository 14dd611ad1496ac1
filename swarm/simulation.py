"""The run: frames, blocks, threads. The one border between Python objects and kernels."""

import functools
import logging
import math
import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import blocks, checks, interrupt, lanes, observables
from .errors import RunError, SceneError
from .methods.base import Method
from .particles import Multipliers, Particles, State
from .scene import Scene
from .status import Status

_LOG = logging.getLogger("swarm")
# Blocks a thread and frame: enough that uneven ones even out, few enough that lanes stay full.
_BLOCKS = 4
_LARGEST_BLOCK = 1 << 16
# Frames nearer to `until` than this part of `every` are `until`.
_SAME_TIME = 1e-9
# A particle this many times the scene's extent away from the origin has escaped from an open scene.
_FAR = 100.0
# A particle this many times round-off of the scene's size outside a rigid wall still counts as on it at the start.
_ON_THE_WALL = 64.0 * np.finfo(np.float64).eps
# One thread computes in the caller's while frames are shorter than this [s]; in longer ones, and in the first, the
# caller's is free to take an interrupt.
_SHORT_FRAME = 0.05


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
        recording: Rerun file to write (not yet supported).
        threads: number of threads; None: all cores this process may use. Results have the same bits for any number.

        progress: True for a progress bar, or a function that is called with every `Frame`.
        overwrite: replace an existing trajectory.
        scene_text: the scene file's text, kept in the trajectory; None: it is written from the objects.
        block_size: particles a block; None: by number of particles and threads. Results do not depend on it.

    Returns:
        A `Result`.

    Raises:
        SceneError: bad input; nothing has run or been written.
        FileError: the trajectory exists or cannot be written.
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
    if recording is not None:
        raise SceneError("recording is not supported yet, got a file name; leave it out and use trajectory=")
    _check(scene, particles, method, until, every)

    if scene.is_open():
        _LOG.warning("the scene is open: particles may fly to infinity; the observable 'escaped' counts them")

    from .progress import display  # rich is imported only when it is shown

    run = Run(scene, particles, method, threads, block_size)
    history: list[dict[str, Any]] = []
    writer = _output(trajectory, overwrite, scene, method, particles, scene_text)
    with run, interrupt.taken_by(run.halt), writer as write, display(progress) as show:
        now = method.span("time", 0.0)
        for number, moment in enumerate(times):
            clock = method.span("time", moment)
            if number > 0:
                run.advance(clock - now, moment)
            now = clock
            seen = {"time": moment, **run.observe()}
            run.require_finite(seen, moment)
            history.append(seen)
            write(number, moment, run.state, seen)
            show(Frame(number, moment, until, seen))
    columns = {name: np.array([seen[name] for seen in history]) for name in history[0]}
    return Result(
        Particles(run.state.position, run.state.velocity, run.state.mass),
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


def _output(
    path: str | os.PathLike[str] | None,
    overwrite: bool,
    scene: Scene,
    method: Method,
    particles: Particles,
    scene_text: str | None,
) -> Any:
    """A context that gives the function which writes a frame."""
    import contextlib

    if path is None:
        return contextlib.nullcontext(lambda *frame: None)
    from .output.beside import Beside
    from .output.trajectory import TrajectoryWriter  # h5py takes 0.2 s to import

    return Beside(TrajectoryWriter(Path(path), overwrite, scene, method, particles, scene_text), len(particles))


def _no_sweeps(n: int) -> Multipliers:
    counts = np.zeros((3, n), np.int64)
    return Multipliers(counts[0], counts[1], counts[2], np.zeros(n), np.zeros(n))


class Run:
    """The state of a run and the threads that advance it."""

    def __init__(
        self, scene: Scene, particles: Particles, method: Method, threads: int, block_size: int | None
    ) -> None:
        n = len(particles)
        self.state = State(
            particles.position.copy(),
            particles.velocity.copy(),
            particles.mass.copy(),
            np.empty(n),
            np.empty(n),
            np.zeros(n, np.int64),
            np.zeros((len(scene.owners()), n)),
            np.zeros(0 if scene.restitution() is None else n),
            _no_sweeps(n) if method.has_multipliers() else None,
        )
        self._far = _FAR * scene.extent() if scene.is_open() else math.inf
        self._too_fast = functools.partial(method.too_fast, scene)
        self._failure, self._owners = method.failure, scene.owners()
        self._method, self._law = method.numbers(scene), method.law()
        self._chain, self._gravity = scene.chain(), scene.pull()
        observables.start_energies(self._law, self._chain, self._gravity, scene.finite_size(), self.state)
        share = math.ceil(n / (_BLOCKS * threads)) if threads > 1 else n
        # Whole chunks of observables, so that a block observes what it has just advanced.
        chunk = observables.CHUNK
        size_wanted = block_size or min(share, _LARGEST_BLOCK)
        self._block = chunk * max(1, math.ceil(size_wanted / chunk))
        self._starts = range(0, n, self._block)
        self._partial = np.zeros((math.ceil(n / chunk), observables.ROWS))
        self._halt = np.zeros(1, np.int8)
        self._done = np.zeros(n, np.bool_)
        self._hard = None if method.seldom_hard(scene) else blocks.Hard(blocks.MOST_HITS)
        self._threads = min(threads, len(self._starts))
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="swarm")
        self._frame_seconds = math.inf

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *error: object) -> None:
        self.halt()
        self._pool.shutdown(wait=True)

    def halt(self) -> None:
        """Let the kernels return before their frame is done, and `advance` raise KeyboardInterrupt."""
        self._halt[0] = 1

    def advance(self, span: float, moment: float) -> None:
        """Advance every particle by `span` in the method's unit."""

        def block(start: int, stop: int) -> tuple[int, int]:
            job = self.state, self._done, span, start, stop, self._halt, lanes.room()
            # Without the compiler too, a division by zero is an infinity that a select throws away.
            with np.errstate(divide="ignore", invalid="ignore"):
                status, particle = blocks.advance_block(self._method, self._chain, self._gravity, self._hard, *job)
                if status == Status.HARD_CONTACT:
                    self._hard = blocks.Hard(blocks.MOST_HITS)
                    status, particle = blocks.advance_block(self._method, self._chain, self._gravity, self._hard, *job)
            return status, particle

        began = time.perf_counter()
        self._done.fill(False)
        status, particle = max(self._for_blocks(block))
        self._frame_seconds = time.perf_counter() - began
        if self._halt[0]:
            raise KeyboardInterrupt
        if status != Status.DONE:
            told = f"the frame at {moment:g} s failed at particle {particle}: {Status(status).sentence}"
            if status == Status.TOO_FAST:
                told += f", {self._too_fast()}"
            multipliers = self.state.multipliers
            if status == Status.UNCONVERGED and multipliers is not None:
                left, stored = multipliers.left[particle], multipliers.stored_energy[particle]
                told += f" {self._failure(moment, left, multipliers.sweeps[particle], stored)}"
            raise RunError(told)

    def observe(self) -> dict[str, Any]:
        """The observables now."""

        def block(start: int, stop: int) -> None:
            observables.observe_block(self._law, self._chain, self._gravity, self.state, start, stop, self._partial)

        self._for_blocks(block)
        seen = observables.summary(self._partial, self.state, self._owners)
        escaped = 0
        if self._far < math.inf:
            with np.errstate(divide="ignore", invalid="ignore"):
                escaped = int(observables.count_escaped(self._chain, self._gravity, self._far, self.state))
        return {**seen, "escaped": escaped}

    def require_finite(self, seen: dict[str, Any], moment: float) -> None:
        """Raise a RunError that names the first particle whose state is not finite."""
        # Whatever is not finite spreads to the energy or, if it is a position, to the angular momentum.
        if math.isfinite(seen["total_energy"] + seen["angular_momentum"].sum()):
            return
        good = np.isfinite(self.state.position).all(axis=0) & np.isfinite(self.state.velocity).all(axis=0)
        raise RunError(
            f"the frame at {moment:g} s failed at particle {int(np.argmin(good))}: {Status.NOT_FINITE.sentence}"
        )

    def _for_blocks(self, work: Callable[[int, int], Any]) -> list[Any]:
        """Results of `work(start, stop)` for all blocks; threads take the next block when they are free."""
        n = len(self.state.mass)
        if self._threads == 1 and self._frame_seconds < _SHORT_FRAME:
            return [work(start, min(start + self._block, n)) for start in self._starts]
        lock, following, results = threading.Lock(), iter(self._starts), []

        def worker() -> None:
            while True:
                with lock:
                    start = next(following, None)
                if start is None:
                    return
                results.append(work(start, min(start + self._block, n)))

        jobs = [self._pool.submit(worker) for _ in range(self._threads)]
        for job in jobs:
            job.result()
        return results

"""The outlook on the run of a scene file, without running it: its setting, hints, sizes, and estimated time."""

import contextlib
import logging
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import scene_file
from ..ball_numbers import balls_volume
from ..common.checks import PARTICLE, in_bytes
from ..errors import SceneError
from ..files import marks
from ..files.background import CHUNK_FRAMES, waiting_bytes
from ..files.writer import size_of
from ..fleet.plan import Plan, in_one_line
from ..fleet.plan import read as plan_of
from ..kernel import cache
from ..run.engines import run_of
from ..run.impacts import chosen
from ..run.machine import warn_open
from ..run.options import Task
from ..run.preflight import hints, knows, workload
from ..run.preflight.admission import task_of
from ..scene_file import Job
from ..serialization.plugins import allowed
from ..words import facts
from ..words.amounts import listed, many
from ..words.content import Content
from ..words.statements import rows_of
from .file_run import named_alone

# Bytes of a row of a log of impacts, and of Python with NumPy, Numba and HDF5.
_ROW, _PROGRAM = 112, 2e8
# The cost of a frame besides its impacts: of each particle [s], and the pace of writing to the disk [bytes/s].
_SEEN, _WRITTEN = 7e-8, 3e8
# Times of one core [s], from `bench/results`: an impact on a wall in straight flights, in a fall, if a flight takes
# steps, on one of many bodies or triangles; an impact of balls; a step of a ball by Penalty, of a point by springs and
# by multipliers, and of a point or link of a body; an impact on a wall, or on one of many, with non-uniform
# motion. A step of a ball in a union takes this time for each of its rooms: with 2 to 4 rooms 3 to 9 times as long.
_STRAIGHT, _FALL, _STEPS, _FIELD = 4e-9, 2e-8, 5e-7, 1e-7
_MOVED, _MOVED_FIELD = 1e-6, 5e-6
_BALLS, _GRAIN, _SPRING, _SWEEPS, _PART = 2e-7, 2e-6, 5e-10, 5e-7, 2e-8
# Steps of a sliding particle in a crossing of the scene, and the time of each, also at rest on a moving wall [s].
_STEPS_A_CROSSING, _SLIDING = 150, 1e-6
# In plain Python: an impact, and a step of a point or link of a body. Compilation of a kernel, and of that of bodies.
# The start and end of a run, and of the next run of a sweep [s].
_PYTHON, _PYTHON_PART, _COMPILING, _COMPILING_BODIES, _BEGINNING, _NEXT = 1e-4, 4e-4, 1.2, 7.0, 0.5, 0.03
# The time that a run stays in plain Python, see run/tiers.py [s].
_IN_PYTHON = 1.0
# The largest number of particles for which kernels are determined; the number of runs that stand for a sweep.
_MOST, _MOST_RUNS = 200_000, 24


class Workload(NamedTuple):
    """The work of a run.

    Attributes:
        events: the number of events.
        noun: their name.
        cost: the time of one [s of a core].
        shared: whether threads share the events.
        plain: the time of one in plain Python [s].
    """

    events: float
    noun: str
    cost: float
    shared: bool = True
    plain: float = _PYTHON


def outlook(job: Job, target: Path, makes_folder: bool = False) -> dict[str, str]:
    """The outlook on the run of a job with the trajectory `target`, in a folder that may be created: rows of a table.

    Raises:
        SceneError: the run would be refused.
    """
    start = job.start()
    try:
        task = task_of(job.scene, start, job.method, job.run)
    except SceneError as error:
        raise job.located(error) from None
    content = _content(task, start, target.name)
    with _caught() as warnings:
        if job.scene.is_open():
            warn_open()
        hints.give(task)
    made = rows_of(facts.of_setting(content, facts.MOST))
    made |= {"hints": "\n".join(f"· {one}" for one in warnings) or "none"}
    there = "" if makes_folder and not target.parent.exists() else _there(target, "trajectory")
    return made | _sizes(task, target, there) | _time(task)


def outlook_of_file(
    path: Path, output: Path | None = None, threads: int | None = None, plugins: Iterable[str] = ()
) -> dict[str, str]:
    """The outlook on a scene file for `swarm run`, or on the first run of a sweep file for `swarm sweep`.

    Raises:
        SceneError: it would be refused.
    """
    document = scene_file.document_of(scene_file.text_of(path), path)
    if scene_file.SWEEP in document:
        plan = plan_of(path, plugins)
        first, folder = plan.variants[0], Path(path.stem) if output is None else output
        with allowed(plugins):
            text = plan.text(first)
            job, target = scene_file.job_of(scene_file.document_of(text, path), text, path), folder / f"{first.stem}.h5"
        kinds = len({variant.kind for variant in plan.variants})
        over = f"{many(len(plan.variants))} over {listed(list(first.parameters))}"
        runs = f"{over}, {many(kinds)} kind{'s' * (kinds != 1)} of scene, each compiled once"
        about = {"runs": runs, "all runs": _of_all(plan, path, plugins, threads)}
        about["first run"] = f"{in_one_line(first.parameters)}; the other rows are of this one"
    else:
        job, about = scene_file.read(path, plugins), {}
        stored = path.with_suffix(".h5").name if job.run.trajectory is None else job.run.trajectory
        target = Path(output or stored)
        named_alone(job, trajectory=output)
    options = replace(job.run, trajectory=target, threads=job.run.threads if threads is None else threads)
    return about | outlook(replace(job, run=options), target, makes_folder=bool(about))


def _of_all(plan: Plan, path: Path, plugins: Iterable[str], threads: int | None) -> str:
    """The size of the trajectories of a sweep and the time of its runs, estimated from a few if there are many."""
    some = plan.variants[:: -(-len(plan.variants) // _MOST_RUNS)]
    size = seconds = 0.0
    with allowed(plugins):
        for variant in some:
            text = plan.text(variant)
            job = scene_file.job_of(scene_file.document_of(text, path), text, path)
            options = job.run if threads is None else replace(job.run, threads=threads)
            task = task_of(job.scene, job.start(), job.method, options)
            size += _on_disk(task)
            _loads, compiled, python = _work(task)
            seconds += (python if options.compile == "never" else compiled) - _BEGINNING + _NEXT
    share = len(plan.variants) / len(some)
    most = "at most " * (task.options.storage.compression != "none")
    every = f"about {_about(seconds * share)} one after the other, besides {_BEGINNING:g} s to begin and what compiles"
    return f"trajectories {most}{in_bytes(size * share)}, {every}"


def _content(task: Task, start: Any, name: str) -> Content:
    """The content at the start for sentences."""
    times = task.options.times
    ends = np.linspace(0.0, times.until, min(times.count, 10_000_000))
    body = None if task.bodies is None else start.body
    seen: dict[str, Any] = {"time": ends}
    return Content(
        name, task.scene, task.method, body, len(task.particles), seen, {"start": task.particles},
        counters=task.options.counters,
    )  # fmt: skip


@contextlib.contextmanager
def _caught() -> Iterator[list[str]]:
    """Collect the warnings of the package, in place of printing them."""
    log, found = logging.getLogger("swarm"), list[str]()
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: found.append(record.getMessage())  # type: ignore[method-assign]
    handlers, passes = log.handlers, log.propagate
    log.handlers, log.propagate = [handler], False
    try:
        yield found
    finally:
        log.handlers, log.propagate = handlers, passes


# --- Sizes -----------------------------------------------------------------------------------------------


def _sizes(task: Task, target: Path, there: str) -> dict[str, str]:
    options, n = task.options, len(task.particles)
    storage, surfaces = options.storage, len(task.scene.surfaces)
    size = _on_disk(task)
    most = "at most " * (storage.compression != "none")
    files = [(f"trajectory {target}", f"{most}{in_bytes(size)}", there)]
    if options.impacts is not None:
        logged = chosen(options.impact_particles, n)
        rows = _impacts(task) * (1.0 if logged is None else float(logged.mean()))
        there = _there(options.impacts, "impacts")
        files.append((f"log of impacts {options.impacts}", f"about {in_bytes(_ROW * rows)}", there))
    if options.recording is not None:
        there = _there(options.recording, "recording")
        files.append((f"recording {options.recording}", f"at most {options.record_megabytes:g} MB", there))
    # HDF5 buffers a chunk of frames until it is full.
    held = min(options.times.count, 1 if storage.compression != "none" else CHUNK_FRAMES) * storage.bytes_of(n)
    memory = PARTICLE * n + options.times.in_memory(surfaces) + held + waiting_bytes(n)
    return {
        "files": "\n".join(f"{name}, {size}{there}" for name, size, there in files),
        "memory": f"at most {in_bytes(memory)}, besides the {in_bytes(_PROGRAM)} of Python, Numba and HDF5",
    }


def _on_disk(task: Task) -> float:
    """The bytes of the trajectory without compression."""
    times, storage = task.options.times, task.options.storage
    return times.on_disk(len(task.scene.surfaces)) + size_of(task.scene, task.particles, storage, times.count)


def _there(path: Path, what: str) -> str:
    """The obstacle to a new file, or ""."""
    try:
        marks.check_target(path, False, what)
    except SceneError as error:
        return f" ({str(error).removeprefix(f'{what}: ')})"
    return ""


# --- Time ------------------------------------------------------------------------------------------------


def _time(task: Task) -> dict[str, str]:
    """The estimated time of the run, from the flights at its start and the costs of `bench/results`."""
    (loads, seconds, python), options = _work(task), task.options
    threads = options.thread_count()
    compiling = _COMPILING if task.bodies is None else _COMPILING_BODIES
    work = " and ".join(f"{many(float(f'{one.events:.2g}'))} {one.noun}" for one in loads)
    stated = {"work": f"about {work}"} if work else {}
    missing, kernels, begins_plain = _kernels(task)
    is_plain = begins_plain and python < _BEGINNING + _IN_PYTHON
    # Balls that settle collide with one another and walls far more often than the start shows.
    more = ", and more where balls settle" if task.particles.radius is not None and _settles(task) else ""
    if options.compile == "never" or is_plain:
        return stated | {"time": f"about {_about(python)}, in plain Python{more}"}
    on = f" on {threads} threads" if threads > 1 and any(one.shared for one in loads) else ""
    once = f", and once {_about(compiling * missing)} to compile {missing} of {kernels} kernels" if missing else ""
    if once and task.bodies is None and task.particles.radius is None and _settles(task):
        once += ", and others where particles come to slide"
    return stated | {"time": f"about {_about(seconds)}{on}{once}{more}; from the start, to a factor of a few"}


def _work(task: Task) -> tuple[list[Workload], float, float]:
    """The work of a run, and its time with compiled kernels and in plain Python [s]."""
    n, options, loads = len(task.particles), task.options, _loads(task)
    threads = options.thread_count()
    frames = _BEGINNING + options.times.count * (_SEEN * n + options.storage.bytes_of(n) / _WRITTEN)
    compiled = sum(one.events * one.cost / (threads if one.shared else 1) for one in loads)
    return loads, frames + compiled, frames + sum(one.events * one.plain for one in loads)


def _about(seconds: float) -> str:
    """A time in a suitable unit, with the digits of an estimate."""
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{float(f'{seconds:.1g}') if seconds < 10.0 else round(seconds):g} s"


def _loads(task: Task) -> list[Workload]:
    """The work of a run, estimated from its start."""
    options, method, n = task.options, task.method, len(task.particles)
    engine = knows.engine_of(knows.Asked(task.scene, task.bodies or task.particles, method, options))
    dt = getattr(method, "dt", None)
    steps = options.until / dt if dt else 0.0
    if task.bodies is not None:
        body = task.bodies.body
        parts = len(body) + len(body.links) + len(body.springs)
        return [Workload(steps * len(task.bodies), "steps of bodies", _PART * parts, plain=_PYTHON_PART * parts)]
    if engine == knows.GRAINS:
        rooms = sum(len(one.rooms) for one in task.scene.surfaces if len(one.rooms) > 1)
        return [Workload(steps * n, "steps of balls", _GRAIN * (1 + rooms), shared=False)]
    impacts = _impacts(task)
    if engine in (knows.BALLS, knows.HEAVY):
        noun = "impacts and collisions before balls settle" if _settles(task) else "impacts and collisions"
        return [Workload(impacts + _collisions(task), noun, _BALLS, shared=False)]
    if engine in (knows.SOFT, knows.BASELINE):
        return [Workload(steps * n, "steps of particles", _SPRING)]
    if engine == knows.PAPER:
        return [Workload(impacts, "contacts", _SWEEPS)]
    flights = Workload(impacts, "impacts", _cost_of_an_impact(task), engine != knows.MASSIVE)
    return [flights, *_sliding(task)]


def _settles(task: Task) -> bool:
    """Whether particles settle: under gravity, at walls that take energy in impacts."""
    laws = task.compiled.laws
    return task.scene.gravity is not None and laws is not None and laws.restitution is not None


def _sliding(task: Task) -> list[Workload]:
    """The steps of particles that will slide."""
    scene = task.scene
    if scene.gravity is None or not _settles(task):
        return []
    crossing = math.sqrt(scene.finite_size() / math.hypot(*scene.gravity))
    a_second = _STEPS_A_CROSSING / crossing
    if scene.moves() and not scene.reacts():
        # A particle at rest moves with its wall in steps of this time.
        a_second = max(a_second, 1.0 / task.compiled.walls().at(0.0).shortest_time_scale())
    steps = len(task.particles) * task.options.until * a_second
    return [Workload(steps, "steps of sliding at most", _SLIDING)]


def _impacts(task: Task) -> float:
    """The impacts on walls, if particles go on with the flights of the start; 0 if no particle flies."""
    if not task.scene.surfaces or not len(task.particles):
        return 0.0
    if not task.scene.moves():
        between = workload.time_between(task.compiled, task.particles)
    else:
        # A crossing of the scene at the mean speed, after a fall under gravity.
        between = task.scene.finite_size() / speed if (speed := _speed(task)) > 0.0 else math.inf
    return len(task.particles) * task.options.until / between if 0.0 < between < math.inf else 0.0


def _speed(task: Task) -> float:
    """The mean speed at the start, with that of a fall through the scene [m/s]."""
    speed, scene = float(np.sqrt((task.particles.velocity**2).sum(axis=0)).mean()), task.scene
    pull = 0.0 if scene.gravity is None else math.hypot(*scene.gravity)
    return math.hypot(speed, math.sqrt(pull * scene.finite_size()))


def _collisions(task: Task) -> float:
    """The collisions of balls in a gas: N (N/V) pi d^2 sqrt(2) |v| t / 2, times Enskog's factor.

    The factor is that of Carnahan and Starling, or in a plane that of Henderson.
    """
    balls, scene = task.particles, task.scene
    assert balls.radius is not None
    volume = balls.volume
    if scene.period is not None and all(length is not None for length in scene.period):
        volume = float(np.prod([length for length in scene.period if length is not None]))
    if volume is None or not volume > 0.0:
        return 0.0
    width, part = 2.0 * float(np.nanmean(balls.radius)), balls_volume(scene, balls.radius) / volume
    if scene.plane is not None:
        across, near = 2.0 * width, (1.0 - 7.0 / 16.0 * part) / (1.0 - part) ** 2
    else:
        across, near = math.pi * width**2, (1.0 - 0.5 * part) / (1.0 - part) ** 3
    return 0.5 * len(balls) ** 2 / volume * across * near * math.sqrt(2.0) * _speed(task) * task.options.until


def _cost_of_an_impact(task: Task) -> float:
    walls, falls = task.compiled.walls(), task.scene.gravity is not None
    if walls.accelerate:
        return _MOVED_FIELD if walls.fields() else _MOVED * max(1, len(walls.each))
    if walls.fields():
        return _FIELD * (2.0 if falls else 1.0)
    each = _STEPS if walls.in_steps() else _FALL if falls else _STRAIGHT
    return each * max(1, len(walls.each))


def _kernels(task: Task) -> tuple[int, int, bool]:
    """The number of kernels that are not compiled yet, of known kernels of the run, and whether it starts without them.

    The result is (0, 0, False) if there are too many particles for this.
    """
    if len(task.particles) > _MOST:
        return 0, 0, False
    with run_of(task) as run:
        calls = list(run.calls())
        return sum(not cache.is_compiled(*call) for call in calls), len(calls), run.is_plain()

"""Speed, memory, start-up and accuracy, each figure beside its bar.

Times are of the kernels (`Run.advance`) unless the row says otherwise: minimum and median of the repeats. The bars are
for a 2-core x86-64 with AVX-512; `ratio` is the figure over the bare loop in C of the same run, which is
comparable from machine to machine.
"""

import itertools
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import swarm
from swarm.run.engine import Run

from . import yardstick
from .report import ROOT, Row, as_usual, child, in_turn, repeated, show, tier, write

SPHERE = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
ELLIPSOID = swarm.Scene(surfaces=[swarm.Ellipsoid(semi_axes=(0.3, 0.3, 0.6))])
SLICE = swarm.Scene(
    surfaces=[swarm.Sphere(radius=0.5), swarm.Plane((0.0, 0.0, -1.0), 0.3), swarm.Plane((0.0, 0.0, 1.0), 0.3)]
)
FALL = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)], gravity=(0.0, 0.0, -1.0))
SPEED = 0.5


def advance_seconds(
    scene: swarm.Scene,
    method: swarm.Impact | swarm.Penalty,
    n: int,
    until: float,
    threads: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> Callable[[], tuple[float, int]]:
    """A measurement: seconds of the kernels for one frame of `until`, and impacts."""
    return advance_of(scene, swarm.fill(scene, n, speed=SPEED, seed=1), method, until, threads, clock)


def advance_of(
    scene: swarm.Scene,
    particles: swarm.Particles,
    method: swarm.Impact | swarm.Penalty,
    until: float,
    threads: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> Callable[[], tuple[float, int]]:
    """The same for these particles."""
    span = method.span("until", until)

    def measure() -> tuple[float, int]:
        with Run(scene.compiled(), particles.copy(), method, threads, None, tier()) as run:
            run.advance(0.0, 0.0)  # compiles, and touches the arrays
            start = clock()
            run.advance(span, until)
            return clock() - start, int(run.state.impacts.sum())

    return measure


def per_impact(measure: Callable[[], tuple[float, int]]) -> float:
    """Seconds an impact."""
    seconds, count = measure()
    return seconds / count


def impacts(n: int, until: float, repeats: int) -> list[Row]:
    """Nanoseconds per impact, beside those of a bare loop in C and of one that does all that a lane of ours does."""
    cases = [
        ("Impact, sphere", SPHERE, swarm.Impact(), "4"),
        ("Impact, ellipsoid", ELLIPSOID, swarm.Impact(), "5"),
        ("Impact, sphere with gravity", FALL, swarm.Impact(), "25"),
        ("Impact, sphere and two planes", SLICE, swarm.Impact(), "8"),
        ("Impact(contact_step=1e-3), sphere", SPHERE, swarm.Impact(contact_step=1e-3), "10"),
        ("Impact(contact_step=1e-3), ellipsoid", ELLIPSOID, swarm.Impact(contact_step=1e-3), "14"),
    ]
    if n < 10_000:  # a quick run: every scene compiles kernels of its own
        cases = cases[:1]
    measures = {what: advance_seconds(scene, method, n, until) for what, scene, method, _bar in cases}
    turns: dict[str, Callable[[], float]] = {
        what: lambda one=one: per_impact(one) * 1e9 for what, one in measures.items()
    }
    bare, lane = "bare loop in C, sphere", "loop in C with all of a lane, sphere"
    in_c = yardstick.bare("impact") != []
    if in_c:
        turns |= {bare: lambda: min(yardstick.bare("impact")), lane: lambda: min(yardstick.bare("lane"))}
    figures = in_turn(turns, 3 * repeats)

    def over(what: str, other: str) -> list[float]:
        return [one / two for one, two in zip(figures[what], figures[other], strict=True)]

    rows = [Row(what, *figures[what], "ns/impact", "", over(what, bare)[0]) for what in (bare, lane) if in_c]
    for what, _scene, _method, bar in cases:
        rows.append(Row(what, *figures[what], "ns/impact", bar, over(what, bare)[0] if in_c else None))
    if in_c:
        rows.append(Row("  Impact, sphere, over all of a lane in C", *over("Impact, sphere", lane), "x", "1.3"))
    return rows


def multipliers(n: int, until: float, repeats: int) -> list[Row]:
    """The augmented Lagrangian in State I: particles through the centre of a sphere: their contacts are all alike."""
    random = np.random.default_rng(1)
    directions = random.standard_normal((3, n))
    directions /= np.sqrt((directions**2).sum(axis=0))
    particles = swarm.Particles(0.2 * directions, SPEED * directions)
    rows = []
    cases = [("none", 1e-10, "400"), ("secant", 1e-10, ""), ("reflection", 1e-10, "100"), ("none", 1e-28, "")]
    dt = 0.025
    for acceleration, tolerance, bar in cases:
        method = swarm.AugmentedLagrangian(
            dt=dt, penalty=1e4, tolerance=tolerance, adaptive=True, acceleration=acceleration
        )
        times, sweeps = [], 0.0
        for _ in range(repeats):
            with Run(SPHERE.compiled(), particles.copy(), method, 1, None, tier()) as run:
                run.advance(0.0, 0.0)
                start = time.perf_counter()
                run.advance(until, until)
                seconds = time.perf_counter() - start
                counts = run.state.multipliers
                assert counts is not None
                times.append(seconds / counts.contacts.sum() * 1e9)
                sweeps = float(counts.sweeps.sum() / counts.contacts.sum())
        what = f'Uzawa, State I, sphere, V <= {tolerance:g}, "{acceleration}": {sweeps:.1f} sweeps'
        rows.append(Row(what, min(times), statistics.median(times), "ns/contact", bar))
    chord = advance_of(SPHERE, particles, swarm.Impact(contact_step=dt), until)
    best, median = repeated(lambda: per_impact(chord) * 1e9, repeats)
    rows.append(Row("  the same contacts by Impact(contact_step=dt)", best, median, "ns/contact"))
    return rows


def two_threads(n: int, until: float, repeats: int) -> list[Row]:
    """Speed of two threads over one, alternating in one run; and of two bare loops in C at once over one."""
    rows = []
    for name, scene in (("sphere", SPHERE), ("sphere with gravity", FALL))[: 1 if n < 10_000 else 2]:
        one, two = (advance_seconds(scene, swarm.Impact(), n, until, threads=k) for k in (1, 2))
        pairs = [(one()[0], two()[0]) for _ in range(repeats)]
        ratio = min(a for a, _ in pairs) / min(b for _, b in pairs)
        median = statistics.median(a / b for a, b in pairs)
        rows.append(Row(f"two threads over one, {name}", ratio, median, "x", ">= 1.8"))
    bare = [(yardstick.bare("impact"), yardstick.bare("impact", processes=2)) for _ in range(repeats)]
    if bare[0][0]:
        ratios = [2.0 * statistics.median(one) / statistics.median(both) for one, both in bare]
        rows.append(Row("  two bare loops in C over one", max(ratios), statistics.median(ratios), "x"))
    return rows


def scale(small: int, large: int) -> list[Row]:
    """What an impact costs among many particles, over what it costs among few: two threads, ten impacts each."""
    measures = {
        str(n): advance_seconds(SPHERE, swarm.Impact(), n, until=10.0 * 4.0 / 3.0 * 0.5 / SPEED, threads=2)
        for n in (small, large)
    }
    figures = in_turn({name: lambda one=one: per_impact(one) for name, one in measures.items()}, 5)
    (few, few2), (many, many2) = figures.values()
    return [Row(f"an impact among {large:.0e} over one among {small:.0e}", many / few, many2 / few2, "times", "1.15")]


def penalty(n: int, steps: int, repeats: int) -> list[Row]:
    """Nanoseconds per particle-step, and the worst energy error; beside plain Verlet."""
    rows = []
    for dt, bar in ((1e-3, "0.6"), (0.025, "1.8")):
        method = swarm.Penalty(dt=dt, penalty=1e4)
        measure = advance_seconds(SPHERE, method, n, until=steps * dt)
        best, median = repeated(lambda measure=measure: measure()[0] / (n * steps) * 1e9, repeats)
        rows.append(Row(f"Penalty, sphere, dt={dt:g}", best, median, "ns/particle-step", bar))
        particles = swarm.fill(SPHERE, n, speed=SPEED, seed=1)

        def verlet(dt: float = dt, particles: swarm.Particles = particles) -> float:
            position, velocity = particles.position.copy(), particles.velocity.copy()
            start = time.perf_counter()
            yardstick.plain_verlet(position, velocity, 0.5, 1e4, dt, steps)
            return (time.perf_counter() - start) / (n * steps) * 1e9

        verlet()
        best, median = repeated(verlet, repeats)
        rows.append(Row(f"  plain Verlet in Numba, dt={dt:g}", best, median, "ns/particle-step"))
        result = swarm.simulate(SPHERE, particles, method, until=steps * dt, every=steps * dt / 10)
        worst = float(result.observables["energy_error"].max())
        rows.append(Row(f"  energy, worst particle, {steps} steps", worst, worst, "relative", "5e-12"))
    return rows


def overhead(n: int, frames: int, repeats: int) -> list[Row]:
    """What a frame of `simulate` without a file takes over the kernels' own time."""
    every = 0.1
    particles = swarm.fill(SPHERE, n, speed=SPEED, seed=1)

    def seconds() -> tuple[float, float]:
        with Run(SPHERE.compiled(), particles.copy(), swarm.Impact(), 1, None, tier()) as run:
            run.advance(every, every)
            start = time.perf_counter()
            for _ in range(frames):
                run.advance(every, every)
            kernel = time.perf_counter() - start
        start = time.perf_counter()
        swarm.simulate(SPHERE, particles, swarm.Impact(), until=frames * every, every=every, threads=1)
        return time.perf_counter() - start, kernel

    seconds()
    runs, kernels = zip(*(seconds() for _ in range(repeats)), strict=True)
    rows = []
    for what, part, bar in (("a frame less its kernels", 1.0, "200"), ("  less 1.3 x its kernels", 1.3, "50")):
        best, median = ((pick(runs) - part * pick(kernels)) / frames * 1e6 for pick in (min, statistics.median))
        rows.append(Row(f"{what}, {n} particles, {frames} frames", best, median, "us/frame", bar))
    return rows


def recording(n: int, frames: int, repeats: int) -> list[Row]:
    """The speed of a run of so many particles with a recording over that without, and the recording's size and seconds.

    All particles are recorded, then half of them: of 10 000 that is `record_particles = 5000`, the default.
    """
    from swarm.recording.writer import RecordingWriter, Settings

    crossing = 4.0 / 3.0 * 0.5 / SPEED
    particles = swarm.fill(SPHERE, n, speed=SPEED, seed=1)
    # Of a run: a recording ends with verdicts, which read whatever observables they judge by.
    whole = swarm.simulate(SPHERE, particles, swarm.Impact(), until=crossing).observables
    seen = {name: values[-1] for name, values in whole.items()}

    def run(every: float, path: Path | None, shown: int) -> float:
        start = time.perf_counter()
        swarm.simulate(
            SPHERE, particles, swarm.Impact(), until=frames * every, every=every, recording=path,
            record_particles=shown, overwrite=True,
        )  # fmt: skip
        return time.perf_counter() - start

    def written(path: Path) -> float:
        start = time.perf_counter()
        settings = Settings(particles=n)
        with RecordingWriter(path, True, SPHERE, swarm.Impact(), particles, frames, settings) as write:
            for first in range(0, frames, 10):
                write([(k, float(k), particles, seen) for k in range(first, min(first + 10, frames))])
        return time.perf_counter() - start

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.rrd"
        run(crossing, path, n)
        for impacts, shown in itertools.product((10, 30, 100) if n == 10_000 else (10,), (n, n // 2)):
            every = impacts * crossing
            cases = {"none": lambda e=every: run(e, None, 1), "recorded": lambda e=every, s=shown: run(e, path, s)}
            (none, none2), (recorded, recorded2) = in_turn(cases, repeats).values()
            what = f"speed of {frames} frames, {impacts} impacts each, {shown} particles recorded over not"
            rows.append(Row(what, none / recorded, none2 / recorded2, "x", ">= 0.7"))
        seconds, seconds2 = repeated(lambda: written(path), repeats)
        rows.append(Row(f"  {n} particles, {frames} frames, recorded alone", seconds, seconds2, "s", "2"))
        size = path.stat().st_size / 1e6
        rows.append(Row("  its file", size, size, "MB", "70"))
    return rows


def output(n: int, frames: int, repeats: int) -> list[Row]:
    """A run that writes so many particles every 10 impacts each, over one that writes nothing, and over h5py alone."""
    import h5py

    every = 10.0 * 4.0 / 3.0 * 0.5 / SPEED
    particles = swarm.fill(SPHERE, n, speed=SPEED, seed=1)

    def run(trajectory: Path | None) -> float:
        start = time.perf_counter()
        swarm.simulate(SPHERE, particles, swarm.Impact(), until=frames * every, every=every, trajectory=trajectory)
        return time.perf_counter() - start

    def raw(path: Path) -> float:
        rows = np.ascontiguousarray(particles.position.T)
        start = time.perf_counter()
        with h5py.File(path, "w") as file:
            shape, chunks = (0, n, 3), (10, min(n, 1000), 3)
            values = [
                file.create_dataset(k, shape, np.float64, maxshape=(None, n, 3), chunks=chunks) for k in ("r", "v")
            ]
            for frame in range(frames + 1):
                for value in values:
                    value.resize(frame + 1, axis=0)
                    value[frame] = rows
                file.flush()
        return time.perf_counter() - start

    with tempfile.TemporaryDirectory() as folder:
        files = (Path(folder) / f"{number}.h5" for number in itertools.count())
        figures = in_turn(
            {"none": lambda: run(None), "written": lambda: run(next(files)), "h5py": lambda: raw(next(files))}, repeats
        )
    (none, none2), (written, written2), (h5py_, h5py2) = figures.values()
    return [
        Row(
            f"run of {frames} frames, 10 impacts each, written over not", written / none, written2 / none2, "x", "1.25"
        ),
        Row("  h5py alone over that run", h5py_ / written, h5py2 / written2, "x", "or > 0.7"),
    ]


# VmHWM and not ru_maxrss, which a process inherits from the one that started it.
_MEMORY = """
import re, sys, swarm
n = int(sys.argv[1])
scene = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
particles = swarm.fill(scene, n, speed=0.5, seed=1)
swarm.simulate(scene, particles, swarm.Impact(), until=0.1, every=0.05, threads=2)
print(1024 * int(re.search(r"VmHWM:\\s+([0-9]+) kB", open("/proc/self/status").read())[1]))
"""


def set_up(n: int, repeats: int) -> list[Row]:
    """What a run takes in which nothing is hit: checks, copies, and two frames observed; one thread."""
    rows = []
    for name, scene in (("sphere", SPHERE), ("sphere and two planes", SLICE)):
        particles = swarm.fill(scene, n, speed=SPEED, seed=1)

        def seconds(scene: swarm.Scene = scene, particles: swarm.Particles = particles) -> float:
            start = time.perf_counter()
            swarm.simulate(scene, particles, swarm.Impact(), until=1e-9, threads=1)
            return time.perf_counter() - start

        seconds()
        least, median = repeated(seconds, repeats)
        rows.append(Row(f"a run in which nothing is hit, {name}", least / n * 1e9, median / n * 1e9, "ns/particle"))
    return rows


def memory(n: int) -> list[Row]:
    """Peak bytes a particle of a whole run: caller's particles and engine's state."""
    small, large = (float(child(_MEMORY, str(k))) for k in (1000, n))
    each = (large - small) / n
    return [Row(f"memory, {n:,} particles".replace(",", " "), each, each, "bytes/particle", "200")]


_FIRST_FRAME = """
import time; start = time.perf_counter()
from swarm import scene_file
from swarm import simulate
job = scene_file.read(r"{scene}")
class Seen(Exception): pass
def stop(frame):
    if frame.number == 1: raise Seen
try:
    simulate(job.scene, job.start(), job.method, until=job.run.until, every=job.run.every,
             trajectory=r"{target}", overwrite=True, progress=stop, scene_text=job.text)
except Seen:
    print(time.perf_counter() - start)
"""


# What no program that Numba compiles can do without: the imports, and one empty kernel out of the cache.
_EMPTY_KERNEL = """
import numba
@numba.njit(cache=True)
def kernel(x):
    pass
"""
_BARE_START = """
import time; start = time.perf_counter()
import sys; sys.path.insert(0, r"{folder}")
import h5py, numpy
from empty_kernel import kernel
kernel(numpy.zeros(1))
print(time.perf_counter() - start)
"""


def start_up(repeats: int) -> list[Row]:
    """Seconds from the start of Python's imports to the first computed frame of the main job, cold and warm.

    Beside it what an empty kernel takes, of which Numba's import of SciPy is a part wherever SciPy is installed.
    """
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "empty_kernel.py").write_text(_EMPTY_KERNEL)
        bare = _BARE_START.format(folder=folder)
        child(bare, NUMBA_CACHE_DIR=folder)
        scene = ROOT / "examples" / "scenes" / "cavity.toml"
        code = _FIRST_FRAME.format(scene=scene, target=Path(folder) / "cavity.h5")
        cold = float(child(code, NUMBA_CACHE_DIR=folder))
        starts = {"job": code, "bare": bare}
        figures = in_turn(
            {what: lambda one=one: float(child(one, NUMBA_CACHE_DIR=folder)) for what, one in starts.items()}, repeats
        )
    return [
        Row("first frame of the main job, first run", cold, cold, "s", "8"),
        Row("first frame of the main job, later runs", *figures["job"], "s", "0.8"),
        Row("  imports of Numba and h5py, and an empty kernel out of the cache", *figures["bare"], "s"),
        Row("swarm run --help", *repeated(_help, repeats), "s", "0.3"),
    ]


def _help() -> float:
    start = time.perf_counter()
    command = [sys.executable, "-m", "swarm", "run", "--help"]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT, env=as_usual())
    return time.perf_counter() - start


def accuracy(n: int, many: float, frames: int) -> list[Row]:
    """Energy and penetration of Impact after many impacts each."""
    rows = []
    scenes = (("sphere", SPHERE), ("ellipsoid", ELLIPSOID), ("sphere and two planes", SLICE))
    for name, scene in scenes[: 1 if many < 1e3 else 3]:
        particles = swarm.fill(scene, n, speed=SPEED, seed=2)
        one = swarm.simulate(scene, particles, swarm.Impact(), until=100.0).observables["impacts"][-1] / n / 100.0
        until = many / one
        seen = swarm.simulate(scene, particles, swarm.Impact(), until=until, every=until / frames).observables
        mean = seen["impacts"][-1] / n
        worst = float(seen["energy_error"].max())
        ulps = float(seen["max_penetration"].max()) / np.spacing(scene.size())
        rows.append(Row(f"energy, Impact, {name}, {mean:.3g} impacts each", worst, worst, "relative", "1e-12"))
        rows.append(Row(f"  largest penetration at {frames + 1} frames, {name}", ulps, ulps, "ulp of the size", "4"))
    return rows


def main(quick: bool) -> None:
    """Measure, print and, unless quick, write bars-MACHINE.csv."""
    repeats = 1 if quick else 7
    n, until = (10, 10.0) if quick else (100_000, 100.0)
    frames = 20 if quick else 1_000
    rows = impacts(n, until, repeats)
    rows += multipliers(n // 5, 1.0 if quick else 40.0, repeats)
    rows += two_threads(n, until, 3 * repeats)
    rows += penalty(2 if quick else 20_000, 100 if quick else 10_000, repeats)
    rows += overhead(n // 5 if quick else 1_000, frames, repeats)
    rows += overhead(n if quick else 10_000, frames, repeats)
    rows += scale(n, 2 * n if quick else 10_000_000)
    rows += output(n if quick else 10_000, 5 if quick else 500, repeats)
    rows += recording(n if quick else 10_000, 2 if quick else 500, 1 if quick else 3)
    rows += set_up(n if quick else 1_000_000, repeats)
    rows += memory(2_000 if quick else 10_000_000)
    rows += start_up(repeats)
    rows += accuracy(*((10, 10.0, frames) if quick else (100, 1e5, 1_000)))
    show(rows)
    if not quick:
        write(rows, "bars")

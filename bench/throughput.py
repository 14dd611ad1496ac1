"""Impacts and steps a second for every method, scene, number of particles, number of threads and kind of output.

Time counts from the first frame to the end of `simulate`, the file closed. Beside them, of the same run: the bare
loops in C, plain Verlet in Numba, and the machine's limits; `ratio` is a time over that of the bare loop in C that
does the same in a sphere.
"""

import importlib.util
import itertools
import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import swarm
from swarm.methods.base import Method

from . import figure, yardstick
from .report import Row, machine, name_of_machine, show, write

SPEED = 0.5
SCENES = {
    "sphere": swarm.Scene([swarm.Sphere(0.5)]),
    "ellipsoid": swarm.Scene([swarm.Ellipsoid((0.3, 0.3, 0.6))]),
    "box": swarm.Scene([swarm.Box((0.5, 0.4, 0.3))]),
    "sphere, ball": swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.15, (0.1, 0.0, 0.0), "outside")]),
    "sphere, gravity": swarm.Scene([swarm.Sphere(0.5)], (0.0, 0.0, -1.0)),
}
# Flights of a frame: what a particle does between two frames, for methods that go from impact to impact.
_FLIGHTS = 10.0
# Steps of a frame, for methods of fixed step.
_STEPS = 100
_QUICK = 10
_PARTICLES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
# Files of more than a million particles measure the disk, and ten million in every scene the patience.
_MOST_WRITTEN = 1_000_000
_LARGEST_IN = "sphere"
# Steps that are cut at the impact do not support gravity yet.
_REFUSED = {("AugmentedLagrangian, dt=0.025", "sphere, gravity")}
# What a measurement takes [s], and its repeats.
_SECONDS, _REPEATS = 0.15, 3
_MOST_FRAMES = 200
# What is written: nothing, a trajectory of all particles, that and a recording of 5000 of them.
_OUTPUTS = ("none", "HDF5", "HDF5+Rerun")


@dataclass(frozen=True)
class Way:
    """A method, and what its speed is counted in."""

    method: Method
    step: float = 0.0  # [s]; 0: from impact to impact

    def unit(self) -> str:
        """Of its time."""
        return "ns/particle-step" if self.step else "ns/impact"

    def every(self, scene: swarm.Scene) -> float:
        """Between two frames [s]."""
        return _STEPS * self.step if self.step else _FLIGHTS * scene.size() / SPEED


METHODS = {
    "Impact": Way(swarm.Impact()),
    "Impact, contact_step=1e-3": Way(swarm.Impact(contact_step=1e-3)),
    "Penalty, dt=1e-3": Way(swarm.Penalty(dt=1e-3, penalty=1e4), 1e-3),
    "Penalty, dt=0.025": Way(swarm.Penalty(dt=0.025, penalty=1e4), 0.025),
    "AugmentedLagrangian, dt=0.025": Way(
        swarm.AugmentedLagrangian(
            dt=0.025, penalty=1e4, tolerance=1e-10, acceleration="reflection", adaptive=True, on_unconverged="count"
        ),
        0.025,
    ),
}


@dataclass(frozen=True)
class Case:
    """One cell of the table."""

    method: str
    scene: str
    n: int
    threads: int
    output: str  # of _OUTPUTS

    def __str__(self) -> str:
        return f"{self.method}, {self.scene}, {self.n:.0e}, {self.threads} thr, {self.output}".replace("e+0", "e")


def cases(quick: bool) -> Iterator[Case]:
    """All of them; a quick run has one of each kind."""
    outputs = _OUTPUTS if importlib.util.find_spec("rerun") else _OUTPUTS[:2]
    if quick:
        yield from (Case("Impact", "sphere", _QUICK, threads, kind) for threads in (1, 2) for kind in outputs)
        yield Case("Penalty, dt=0.025", "sphere", _QUICK, 1, "none")
        return
    for method, scene, n, threads, kind in itertools.product(METHODS, SCENES, _PARTICLES, (1, 2), outputs):
        if (method, scene) in _REFUSED:
            continue
        if n <= _MOST_WRITTEN or (kind == "none" and scene == _LARGEST_IN):
            yield Case(method, scene, n, threads, kind)


def run(case: Case, particles: swarm.Particles, frames: int, folder: Path) -> tuple[float, float]:
    """Seconds from the first frame to the end, and nanoseconds an impact or step."""
    scene, way = SCENES[case.scene], METHODS[case.method]
    every = way.every(scene)
    clock: list[float] = []
    result = swarm.simulate(
        scene,
        particles,
        way.method,
        until=frames * every,
        every=frames * every if case.output == "none" else every,
        trajectory=folder / "trajectory.h5" if "HDF5" in case.output else None,
        recording=folder / "recording.rrd" if "Rerun" in case.output else None,
        overwrite=True,
        threads=case.threads,
        progress=lambda frame: clock.append(time.perf_counter()),
    )
    seconds = time.perf_counter() - clock[0]
    count = case.n * _STEPS * frames if way.step else int(result.observables["impacts"][-1])
    return seconds, 1e9 * seconds / count


def measure(some: list[Case], particles: swarm.Particles, folder: Path, quick: bool) -> dict[Case, list[float]]:
    """Cases of one method, scene and number of particles, in turn."""
    plain, pilot = some[0], 2
    while True:
        seconds, _each = run(plain, particles, pilot, folder)
        if quick or seconds > 0.2 * _SECONDS or pilot >= _MOST_FRAMES:
            break
        pilot *= 4
    frames = pilot if quick else max(2, min(_MOST_FRAMES, round(pilot * _SECONDS / seconds)))
    repeats = 1 if quick else _REPEATS
    return {
        case: values
        for rounds in [[{case: run(case, particles, frames, folder)[1] for case in some} for _ in range(repeats)]]
        for case in some
        for values in [[one[case] for one in rounds]]
    }


def yardsticks(quick: bool) -> dict[str, list[float]]:
    """Name -> nanoseconds an item; what needs a C compiler only where there is one."""
    found = {}
    for what, name in (
        ("impact", "bare loop in C, sphere"),
        ("verlet", "bare Verlet in C, sphere"),
        ("divide", "limit: a division"),
        ("root", "limit: a square root"),
        ("copy", "limit: a copied double"),
    ):
        values = yardstick.bare(what)
        if values:
            found[name] = values
    steps, n = 1_000, 100 if quick else 2_000
    particles = swarm.fill(SCENES["sphere"], n, speed=SPEED, seed=1)

    def verlet() -> float:
        position, velocity = particles.position.copy(), particles.velocity.copy()
        start = time.perf_counter()
        yardstick.plain_verlet(position, velocity, 0.5, 1e4, 1e-3, steps)
        return (time.perf_counter() - start) / (n * steps) * 1e9

    verlet()
    found["plain Verlet in Numba, sphere"] = [verlet() for _ in range(1 if quick else 7)]
    both = yardstick.bare("impact", processes=2)
    if both:
        found["bare loop in C, two at once"] = both
    return found


def main(quick: bool) -> None:
    """Measure and print; unless quick, write the CSV and the PNG of this machine."""
    limits = yardsticks(quick)
    if importlib.util.find_spec("rerun") is None:
        print('recordings are left out: rerun-sdk is not installed; pip install -e ".[record]"')
    rows = [
        Row(name, min(values), statistics.median(values), f"ns/{_ITEMS.get(name.split(':')[0], 'item')}")
        for name, values in limits.items()
    ]
    show(rows)
    found: dict[Case, list[float]] = {}
    groups = itertools.groupby(cases(quick), key=lambda case: (case.scene, case.n))
    with tempfile.TemporaryDirectory() as folder:
        for (scene, n), group in groups:
            particles = swarm.fill(SCENES[scene], n, speed=SPEED, seed=1)
            for _method, some in itertools.groupby(group, key=lambda case: case.method):
                found.update(measure(list(some), particles, Path(folder), quick))
            print(f"\r{len(found)} cases measured", end="", flush=True)
    print()
    table(found)
    rows += [row_of(case, values, limits) for case, values in found.items()]
    if not quick:
        write(rows, "throughput")
        fixed = [name for name, way in METHODS.items() if way.step]
        figure.throughput(found, limits, fixed, machine(), f"throughput-{name_of_machine()}")


_ITEMS = {
    "bare loop in C, sphere": "impact",
    "bare loop in C, two at once": "impact",
    "bare Verlet in C, sphere": "particle-step",
    "plain Verlet in Numba, sphere": "particle-step",
}


def row_of(case: Case, values: list[float], limits: dict[str, list[float]]) -> Row:
    """A line of the CSV."""
    unit = METHODS[case.method].unit()
    bare = limits.get("bare Verlet in C, sphere" if METHODS[case.method].step else "bare loop in C, sphere")
    best = min(values)
    return Row(str(case), best, statistics.median(values), unit, "", best / min(bare) if bare else None)


def table(found: dict[Case, list[float]]) -> None:
    """Minimum (median), one line a method and scene, one column a number of particles."""
    numbers = sorted({case.n for case in found})
    print("nanoseconds an impact, or a step of a particle: minimum (median)")
    head = "".join(f"{f'N = {n:.0e}'.replace('e+0', 'e'):>18}" for n in numbers)
    tables = {(_OUTPUTS.index(case.output), case.threads) for case in found}
    for kind, threads in [(_OUTPUTS[which], threads) for which, threads in sorted(tables)]:
        print(f"\n{f'{threads} thread{(threads > 1) * chr(115)}, output: {kind}':<50}{head}")
        for method, scene in dict.fromkeys((case.method, case.scene) for case in found):
            cells = [found.get(Case(method, scene, n, threads, kind)) for n in numbers]
            told = "".join(f"{f'{min(v):.3g} ({statistics.median(v):.3g})' if v else '':>18}" for v in cells)
            if told.strip():
                print(f"{f'{method}, {scene}':<50}{told}")
    if len({case.threads for case in found}) > 1:
        ratios = [
            (min(values) / min(found[two]), case)
            for case, values in found.items()
            for two in [Case(case.method, case.scene, case.n, 2, case.output)]
            if case.threads == 1 and case.output == "none" and case.n >= 20_000 and two in found
        ]
        if ratios:
            told = [ratio for ratio, _case in ratios]
            print(
                f"\ntwo threads over one, N >= 20 000, {len(told)} cases: "
                f"least {min(told):.2f} ({min(ratios, key=lambda one: one[0])[1]}), "
                f"median {statistics.median(told):.2f}, most {max(told):.2f}"
            )

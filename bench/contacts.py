"""Contacts that last: sliding, resting, chattering and wedges, each figure beside its bar.

Seconds are of `simulate`, compiled, on two threads, minimum and median of repeats. Beside each scene are `Penalty` and
plain Verlet in it without losses, and the median over the particles of the distance at the end from a refined run.
"""

import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import swarm
from swarm import scene_file
from swarm.lanes.table import LANES
from swarm.methods.base import Method
from swarm.run.engine import Run
from swarm.surfaces import Surface

from .report import ROOT, Row, in_turn, repeated, show, tier, write

GRAVITY = (0.0, 0.0, -9.81)
SPEED = 1.0
FRICTION = 0.4
HOPPER = ROOT / "examples" / "scenes" / "hopper.toml"
# Of `Impact`: what a run is compared with has a hundredth of it.
_TOLERANCE, _REFINED = 1e-9, 1e-11
# Of the fixed-step methods: a grain of 4 m/s is 13 mm deep in a wall so stiff.
_STEP, _STIFFNESS = 1e-3, 1e5
# By then the hopper with friction is at rest [s].
_SETTLED = 10.0
# The impacts in Galperin's wedge where the heavy mass is 100^n times the light one.
_PI_DIGITS = (3, 31, 314, 3141, 31415)
# Composed steps of each lane that are timed together; before them come those of particles that begin to slide.
_STEPS, _BEGIN = 1_000, 100
# Of a quick run: particles, and seconds.
_FEW, _SHORT = 2, 0.4
_THREADS = 2


@dataclass(frozen=True)
class Case:
    """A scene in which contact lasts, and how long it is run."""

    scene: swarm.Scene
    count: int
    until: float
    bar: str = ""

    def particles(self, quick: bool) -> swarm.Particles:
        """At random places; of a quick run a few."""
        return swarm.fill(self.scene, _FEW if quick else self.count, speed=SPEED, seed=0)


def _lossy(surfaces: list[Surface], restitution: float = 0.5) -> swarm.Scene:
    """These walls under gravity, with losses."""
    return swarm.Scene([dataclasses.replace(one, restitution=restitution) for one in surfaces], GRAVITY)


def _with(scene: swarm.Scene, **laws: Any) -> swarm.Scene:
    """The scene with other laws of its walls."""
    return swarm.Scene([dataclasses.replace(one, **laws) for one in scene.surfaces], scene.gravity)


def _impact(**settings: Any) -> swarm.Impact:
    return swarm.Impact(**{"sliding_tolerance": _TOLERANCE, **settings})


def cases() -> dict[str, Case]:
    """The scenes by name."""
    cylinder = _lossy([swarm.Cylinder(0.5, length=1.0)])
    cone = _lossy([swarm.Cone(math.pi / 6.0), swarm.Plane((0.0, 0.0, 1.0), 1.0)])
    bowl = _lossy([swarm.Sphere(0.5)])
    ring = swarm.Torus(0.25, 0.08, side="outside")
    vessel = swarm.Scene([swarm.Cylinder(0.5, length=1.0, restitution=0.95), ring], GRAVITY)
    return {
        "capped cylinder": Case(cylinder, 1_000, 2.0, "0.1"),
        "cone with a lid": Case(cone, 1_000, 2.0, "0.1"),
        "sphere as a bowl": Case(bowl, 1_000, 2.0, "0.1"),
        "vessel with a ring": Case(vessel, 3_000, 3.0, "3"),
        "hopper": Case(_with(scene_file.read(HOPPER).scene, friction=0.0), 5_000, 1.0),
    }


def _run(scene: swarm.Scene, particles: swarm.Particles, method: Method, until: float) -> swarm.Result:
    """The end alone, compiled."""
    return swarm.simulate(scene, particles, method, until=until, threads=_THREADS, progress=False, compile=tier())


def _seconds(scene: swarm.Scene, particles: swarm.Particles, method: Method, until: float) -> Callable[[], float]:
    """A measurement: seconds of a run."""

    def measure() -> float:
        start = time.perf_counter()
        _run(scene, particles, method, until)
        return time.perf_counter() - start

    return measure


def _error(one: swarm.Result, other: swarm.Result) -> float:
    """The median of the distances: of impacts that follow each other some particles are chaotic."""
    away = one.particles.position - other.particles.position
    return float(np.median(np.sqrt((away**2).sum(axis=0))))


def lasting(name: str, case: Case, quick: bool) -> list[Row]:
    """One scene: its time and those of the soft walls, what happened in it, and its error."""
    particles, until = case.particles(quick), _SHORT if quick else case.until
    elastic = _with(case.scene, restitution=1.0)
    ways: dict[str, tuple[swarm.Scene, Method]] = {
        name: (case.scene, _impact()),
        f"  {name}, Penalty, e = 1": (elastic, swarm.Penalty(dt=_STEP, penalty=_STIFFNESS)),
        f"  {name}, plain Verlet, e = 1": (elastic, swarm.Verlet(dt=_STEP, penalty=_STIFFNESS)),
    }
    rows, measures = [], {}
    for what, (scene, method) in ways.items():
        try:
            _run(scene, particles, method, _STEP)
        except swarm.SwarmError as refused:  # what soft walls do not do is a row too
            rows.append(Row(f"{what}: {refused}"[:100], math.nan, math.nan, "s"))
        else:
            measures[what] = _seconds(scene, particles, method, until)
    figures = in_turn(measures, 1 if quick else 5)
    rows += [Row(what, *figures[what], "s", case.bar if what == name else "") for what in measures]
    end = _run(case.scene, particles, _impact(), until)
    refined = _run(case.scene, particles, _impact(sliding_tolerance=_REFINED), until)
    told = {
        "impacts of a particle": (end.observables["impacts"][-1] / len(particles), ""),
        "sliding time of a particle": (end.observables["sliding_time"][-1] / len(particles), "s"),
        "sliding at the end": (end.observables["sliding"][-1], "particles"),
        "median error": (_error(end, refined), "m"),
    }
    return rows + [Row(f"  {name}, {what}", float(one), float(one), unit) for what, (one, unit) in told.items()]


def at_rest(quick: bool) -> list[Row]:
    """The hopper with friction until all rest; and a frame of ten thousand grains that do."""
    hopper = scene_file.read(HOPPER).scene
    grains, until = swarm.fill(hopper, _FEW if quick else 5_000, speed=SPEED, seed=0), _SHORT if quick else _SETTLED
    figures = in_turn({"settling": _seconds(hopper, grains, _impact(), until)}, 1 if quick else 3)
    end = _run(hopper, grains, _impact(), until)
    moving = float(np.any(end.particles.velocity != 0.0, axis=0).sum())
    what = f"hopper, friction {hopper.surfaces[0].friction:g}, {until:g} s"
    rows = [Row(what, *figures["settling"], "s", "5"), Row("  still moving", moving, moving, "particles", "0")]
    box = swarm.Scene([dataclasses.replace(swarm.Box((0.5, 0.5, 0.5)), restitution=0.5)], GRAVITY)
    box = _with(box, friction=FRICTION)
    count, method, frame = (_FEW if quick else 10_000), _impact(), 0.01
    with Run(box.compiled(), swarm.fill(box, count, speed=SPEED, seed=0), method, 1, None, tier()) as run:
        run.advance(0.0, 0.0)
        run.advance(method.span("until", until), until)
        moments = iter(until + frame * k for k in range(1, 1_000))

        def measure() -> float:
            start = time.perf_counter()
            run.advance(method.span("every", frame), next(moments))
            return 1e3 * (time.perf_counter() - start)

        best, median = repeated(measure, 5 if quick else 100)
    return [*rows, Row(f"a frame of {count} grains at rest", best, median, "ms", "1")]


def wedges(quick: bool) -> list[Row]:
    """Galperin's billiard: two masses and a wall are a point in a wedge; its impacts are the digits of pi."""
    rows = []
    for n, exact in enumerate(_PI_DIGITS[: 3 if quick else None]):
        angle = math.atan(10.0**-n)
        walls = [swarm.Plane((0.0, -1.0, 0.0)), swarm.Plane((-math.sin(angle), math.cos(angle), 0.0))]
        start = swarm.Particles(np.array([[1.0], [0.5 * 10.0**-n], [0.0]]), np.array([[-1.0], [0.0], [0.0]]))
        end = swarm.simulate(swarm.Scene(walls), start, swarm.Impact(), until=10.0, threads=1, progress=False)
        count = float(end.observables["impacts"][-1])
        rows.append(Row(f"Galperin's wedge, mass ratio 100^{n}", count, count, "impacts", f"{exact}"))
    return rows


def _along(surface: Surface, points: np.ndarray) -> swarm.Particles:
    """At these points of a wall, at random directions along it."""
    normal = np.asarray(surface.gradient(points))
    normal /= np.sqrt((normal**2).sum(axis=0))
    velocity = np.random.default_rng(1).standard_normal(points.shape)
    velocity -= (velocity * normal).sum(axis=0) * normal
    return swarm.Particles(points, SPEED * velocity / np.sqrt((velocity**2).sum(axis=0)))


def launches(count: int) -> dict[str, tuple[Surface, swarm.Particles]]:
    """Walls on which particles start tangentially, so low that their weight keeps them on it."""
    random = np.random.default_rng(0)
    down = np.vstack([random.uniform(-1.0, 1.0, (2, count)), np.full(count, -1.0)])
    down /= np.sqrt((down**2).sum(axis=0))
    around, along = random.uniform(math.pi / 6.0, 5.0 * math.pi / 6.0, count), random.uniform(0.5, 1.0, count)
    low = np.array([along, 0.5 * np.cos(around), -0.5 * np.sin(around)])
    half = math.pi / 6.0
    wide = along * math.tan(half)
    high = np.array([wide * np.cos(2.0 * around), wide * np.sin(2.0 * around), along])
    axes = (0.5, 0.4, 0.3)
    surfaces: dict[str, tuple[Surface, np.ndarray]] = {
        "sphere": (swarm.Sphere(0.5), 0.5 * down),
        "ellipsoid": (swarm.Ellipsoid(axes), np.array(axes)[:, None] * down),
        "cylinder": (swarm.Cylinder(0.5, (1.0, 0.0, 0.0)), low),
        "cone": (swarm.Cone(half), high),
    }
    return {name: (surface, _along(surface, points)) for name, (surface, points) in surfaces.items()}


def sliding(quick: bool) -> list[Row]:
    """What a composed step costs: of as many particles as two threads have lanes, halted after so many passes."""
    rows, method, forever = [], _impact(), 1e3
    for threads in (1, _THREADS):
        lanes = 1 if quick else LANES
        count, steps, rounds = threads * lanes, 20 if quick else _STEPS, 2 if quick else 20
        for name, (surface, particles) in launches(count).items():
            scene = swarm.Scene([surface], GRAVITY)
            with Run(scene.compiled(), particles, method, threads, lanes, tier()) as run:
                run.advance(0.0, 0.0)

                def measure(run: Run = run, passes: int = steps, count: int = count) -> float:
                    run.halt(passes)
                    start = time.perf_counter()
                    run.advance(method.span("until", forever), forever)
                    return 1e9 * (time.perf_counter() - start) / (passes * count)

                measure(passes=_BEGIN)
                before = run.state.contacts.sliding.sum()
                best, median = repeated(measure, rounds)
                slid = (run.state.contacts.sliding.sum() - before) / count
                each = rounds * steps / slid
            what = f"composed step, {name}, {threads} thread{'s' * (threads > 1)}"
            rows.append(Row(what, best, median, "ns/step", "60" if threads == _THREADS else ""))
            rows.append(Row("  steps in a second", each, each, "a particle"))
    return rows


def main(quick: bool) -> None:
    """Measure, print, and write the table of this machine."""
    rows = [row for name, case in cases().items() for row in lasting(name, case, quick)]
    rows += [*at_rest(quick), *wedges(quick), *sliding(quick)]
    show(rows)
    if not quick:
        write(rows, "contacts")

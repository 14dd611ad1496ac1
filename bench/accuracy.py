"""Speed against accuracy: every method at many settings, in the same scenes, one picture a scene.

Wall time is that of the kernels on one thread, per particle and simulated second. Errors are against billiards between
rigid walls in 50 digits (reference.py): the median distance after about 5, 20 and 64 impacts; beside it the worst
particle's relative energy error and the largest penetration, both of 400 frames.
"""

import csv
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import swarm
from swarm.methods.base import Method
from swarm.run import Run

from . import figure, reference
from .report import RESULTS, ROOT, machine, name_of_machine

# dt sqrt(alpha/m): explicit rules take some twenty steps a contact, the others may be stiffer.
_SOFT, _STIFF = 0.3, 3.0
_STEPS = tuple(2.0**-k for k in range(6, 17, 2))
_CHORDS = tuple(2.0**-k for k in range(4, 17, 3))
# A setting that takes longer than this [s] for 256 particles is not run again for a better time, nor a finer one tried.
_PATIENCE = 2.0
_REPEATS = 3
_FRAMES = 400


@dataclass(frozen=True)
class Point:
    """One method at one setting in one scene."""

    scene: str
    method: str
    setting: str
    seconds: float  # per particle and simulated second
    errors: tuple[float, ...]  # median distance [m] at each of the times
    energy: float
    penetration: float  # over the scene's size


def ways(gravity: bool) -> dict[str, Iterator[tuple[str, Method]]]:
    """Name of a curve -> its settings, each finer than the one before."""

    def soft(cls: type, stiffness: float, **keywords: object) -> Iterator[tuple[str, Method]]:
        for dt in _STEPS:
            yield f"dt=2^{math.log2(dt):.0f} s", cls(dt, (stiffness / dt) ** 2, **keywords)

    found = {
        "Impact": iter([("default", swarm.Impact())]),
        "Impact, contact_step": ((f"2^{math.log2(h):.0f} s", swarm.Impact(contact_step=h)) for h in _CHORDS),
        "Penalty": soft(swarm.Penalty, _STIFF),
        "Verlet": soft(swarm.Verlet, _SOFT),
        "Midpoint": soft(swarm.Midpoint, _SOFT),
        "Trapezoidal": soft(swarm.Trapezoidal, _SOFT),
    }
    if not gravity:  # cutting a step at the impact knows no gravity yet
        found["AugmentedLagrangian"] = soft(
            swarm.AugmentedLagrangian, _STIFF, adaptive=True, acceleration="reflection", on_unconverged="count"
        )
    return found


def seconds_of(scene: swarm.Scene, particles: swarm.Particles, method: Method, until: float) -> float:
    """Of the kernels, one thread, per particle and simulated second."""
    best = math.inf
    for _ in range(_REPEATS):
        with Run(scene, particles, method, 1, None) as run:
            run.advance(0.0, 0.0)
            start = time.perf_counter()
            run.advance(method.span("until", until), until)
            spent = time.perf_counter() - start
        best = min(best, spent)
        if spent > _PATIENCE:
            break
    return best / len(particles) / until


def point(name: str, curve: str, setting: str, method: Method, known: dict[str, np.ndarray]) -> Point:
    """Measure one setting; errors are infinite where the run fails."""
    scene = reference.SCENES[name]
    particles = swarm.Particles(known[f"{name}/position"], known[f"{name}/velocity"])
    times, ends = known[f"{name}/times"], known[f"{name}/end"]
    try:
        seconds = seconds_of(scene, particles, method, float(times[-1]))
        errors = []
        for k, until in enumerate(times):
            end = swarm.simulate(scene, particles, method, until=float(until), threads=1).particles.position
            errors.append(float(np.median(np.linalg.norm(end.T - ends[:, k], axis=1))))
        # As many frames as there are 64ths of a second, at most.
        every = math.ceil(64.0 * times[-1] / _FRAMES) / 64.0
        until = every * math.floor(times[-1] / every)
        seen = swarm.simulate(scene, particles, method, until=until, every=every, threads=1).observables
    except swarm.RunError:
        return Point(name, curve, setting, math.nan, (math.inf,) * len(times), math.inf, math.inf)
    energy, depth = float(seen["energy_error"].max()), float(seen["max_penetration"].max())
    return Point(name, curve, setting, seconds, tuple(errors), energy, depth / scene.size())


def points(name: str, known: dict[str, np.ndarray], quick: bool) -> list[Point]:
    """Every method in one scene."""
    found = []
    for curve, settings in ways(reference.SCENES[name].gravity is not None).items():
        for count, (setting, method) in enumerate(settings):
            found.append(point(name, curve, setting, method, known))
            one = found[-1]
            print(f"{name:<20} {curve:<22} {setting:<12} {one.seconds * 1e9:10.3g} ns/s  {one.errors[-1]:9.2g} m")
            total = one.seconds * float(known[f"{name}/times"][-1]) * known[f"{name}/position"].shape[1]
            if total > _PATIENCE or (quick and count == 1):
                break
    return found


def front(found: list[Point], error: int) -> list[Point]:
    """Those that nothing is both faster and more accurate than, from fast to accurate."""
    best, kept = math.inf, []
    for one in sorted((p for p in found if math.isfinite(p.seconds)), key=lambda p: p.seconds):
        if one.errors[error] < best:
            best = one.errors[error]
            kept.append(one)
    return kept


def advice(found: list[Point]) -> str:
    """In one sentence, what to choose in this scene."""
    impact = next(p for p in found if p.method == "Impact")
    others = [p for p in found if not p.method.startswith("Impact") and math.isfinite(p.seconds)]
    nearest = min(others, key=lambda p: p.errors[0])
    faster = [p for p in others if p.seconds < impact.seconds]
    sentence = (
        f"Impact: {impact.errors[0]:.1g} m after {reference.IMPACTS[0]} impacts; the nearest of the others, "
        f"{nearest.method} at {nearest.setting}, reaches {nearest.errors[0]:.1g} m in "
        f"{nearest.seconds / impact.seconds:.0f} times its time"
    )
    if faster:
        sentence += f"; faster than it, and farther off, are {', '.join(sorted({p.method for p in faster}))}"
    return sentence + "."


def write(name: str, found: list[Point]) -> None:
    """The points of one scene as CSV."""
    path = RESULTS / f"accuracy-{name.replace(' ', '-')}-{name_of_machine()}.csv"
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        errors = [f"median_error_{count}_impacts" for count in reference.IMPACTS]
        table.writerow(["method", "setting", "seconds", *errors, "energy_error", "penetration"])
        for p in found:
            numbers = [p.seconds, *p.errors, p.energy, p.penetration]
            table.writerow([p.method, p.setting, *(f"{one:.4g}" for one in numbers)])
    print(f"written to {path.relative_to(ROOT)}")


def main(quick: bool) -> None:
    """Measure every scene; unless quick, write a CSV and a PNG of each."""
    with np.load(reference.PATH) as file:
        known = dict(file)
    print(machine())
    for name in ("sphere",) if quick else reference.SCENES:
        found = points(name, known, quick)
        print(f"{name}: {advice(found)}")
        if not quick:
            write(name, found)
            figure.accuracy(name, found, [front(found, k) for k in range(len(reference.IMPACTS))], advice(found))

"""Speed against accuracy: every method at many settings, in the same scenes, one picture a scene.

Time is processor time of the kernels on one thread, per particle and simulated second. Distances are from billiards
between rigid walls in 50 digits, in the soft sphere from its own closed form (reference.py): the median of the
particles after about 5, 20 and 64 impacts. Beside them the worst particle's relative energy error and the largest
penetration, both of 400 frames at most.
"""

import csv
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import swarm
from swarm.methods.base import Method

from . import figure, reference
from .contenders import Contender, Ours, Plain
from .report import file_of, machine, name_of_machine

# dt sqrt(alpha/m) of what conserves at any stiffness.
_STIFF = 3.0
_STEPS = tuple(2.0**-k for k in range(6, 21, 2))
_CHORDS = tuple(2.0**-k for k in range(4, 17, 3))
# A setting that takes longer than this [s] for 256 particles is not run again for a better time, nor a finer one tried.
_PATIENCE = 2.0
# The plain loop is given more, so that it is seen where it gets to.
_PLAIN_PATIENCE = 15.0
_REPEATS = 3
_FRAMES = 400
PLAIN = "plain Verlet in Numba"
# Distances below this [m] are round-off of some impacts in scenes of a metre.
_EXACT = 1e-14
# Every method compiles kernels of its own.
_QUICK = ("Impact", "Penalty", PLAIN)
# Particles and frames of a quick run.
_FEW = 2

Known = dict[str, NDArray]


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


def _stiff(dt: float) -> float:
    """alpha of what conserves at any stiffness, for 1 kg: a contact is a step or two."""
    return (_STIFF / dt) ** 2


def _resolved(dt: float) -> float:
    """alpha of the others: the finer the step, the stiffer the wall and the more steps a contact has, ten at first.

    With ten at any dt their energy is off by a quarter after 64 impacts, however stiff the wall.
    """
    stiffness = 0.3 * math.sqrt(dt / _STEPS[0])
    return (stiffness / dt) ** 2


def ways(name: str, scene: swarm.Scene) -> dict[str, Iterator[tuple[str, Contender]]]:
    """Name of a curve -> its settings, each finer than the one before."""

    def penalty(rule: Callable[[float], float], dt: float) -> float:
        return reference.PENALTY if name == reference.SOFT else rule(dt)

    def soft(make: type[Method], rule: Callable[[float], float], **keywords: object) -> Iterator[tuple[str, Contender]]:
        for dt in _STEPS:
            yield _step(dt), Ours(scene, make(dt, penalty(rule, dt), **keywords))

    def plain() -> Iterator[tuple[str, Contender]]:
        for dt in _STEPS:
            yield _step(dt), Plain(dt, penalty(_resolved, dt))

    found = {
        "Penalty": soft(swarm.Penalty, _stiff),
        "Verlet": soft(swarm.Verlet, _resolved),
        "Midpoint": soft(swarm.Midpoint, _resolved),
        "Trapezoidal": soft(swarm.Trapezoidal, _resolved),
    }
    if name in ("sphere", reference.SOFT):
        found[PLAIN] = plain()
    if name == reference.SOFT:
        return found
    if scene.gravity is None:  # cutting a step at the impact does not support gravity yet
        uzawa = {"adaptive": True, "acceleration": "reflection", "on_unconverged": "count"}
        found["AugmentedLagrangian"] = soft(swarm.AugmentedLagrangian, _stiff, **uzawa)
        found["AugmentedLagrangian, centred"] = soft(
            swarm.AugmentedLagrangian, _stiff, **uzawa, contact_start="centred"
        )
    return {
        "Impact": iter([("default", Ours(scene, swarm.Impact()))]),
        "Impact, contact_step": _chords(scene, "impact"),
        "Impact, contact_step, centred": _chords(scene, "centred"),
        **found,
    }


def _chords(scene: swarm.Scene, start: str) -> Iterator[tuple[str, Contender]]:
    """Contact steps that begin at the impact, or half of themselves before it."""
    for h in _CHORDS:
        yield _step(h, "contact_step"), Ours(scene, swarm.Impact(contact_step=h, contact_start=start))


def _step(size: float, name: str = "dt") -> str:
    return f"{name}=2^{math.log2(size):.0f} s"


def scenes() -> dict[str, swarm.Scene]:
    """Those of the reference; the soft sphere is the sphere to methods with springs."""
    return {**reference.SCENES, reference.SOFT: reference.SCENES["sphere"]}


def best_seconds(contender: Contender, particles: swarm.Particles, until: float) -> float:
    """Per particle and simulated second."""
    best = math.inf
    for _ in range(_REPEATS):
        spent = contender.seconds(particles, until)
        best = min(best, spent)
        if spent > _PATIENCE:
            break
    return best / len(particles) / until


def point(name: str, curve: str, setting: str, contender: Contender, known: Known, frames: int) -> Point:
    """Measure one setting; errors are infinite where the run fails."""
    particles = swarm.Particles(known[f"{name}/position"], known[f"{name}/velocity"])
    times, ends = known[f"{name}/times"], known[f"{name}/end"]
    # As many frames as there are 64ths of a second, at most.
    every = math.ceil(64.0 * times[-1] / frames) / 64.0
    try:
        seconds = best_seconds(contender, particles, float(times[-1]))
        found = contender.ends(particles, times)
        off = [np.linalg.norm(end.T - ends[:, k], axis=1) for k, end in enumerate(found)]
        energy, depth = contender.worst(particles, every, math.floor(times[-1] / every))
    except swarm.RunError:
        return Point(name, curve, setting, math.nan, (math.inf,) * len(times), math.inf, math.inf)
    # The reference is no number where a particle touches a spring at that time.
    errors = tuple(float(np.nanmedian(one)) for one in off)
    return Point(name, curve, setting, seconds, errors, energy, depth / scenes()[name].size())


def points(name: str, known: Known, quick: bool) -> list[Point]:
    """Every method in one scene."""
    found = []
    for curve, settings in ways(name, scenes()[name]).items():
        if quick and curve not in _QUICK:
            continue
        patience = _PLAIN_PATIENCE if curve == PLAIN else _PATIENCE
        for count, (setting, contender) in enumerate(settings):
            found.append(point(name, curve, setting, contender, known, _FEW if quick else _FRAMES))
            one = found[-1]
            print(
                f"{name:<20} {curve:<22} {setting:<19} {one.seconds * 1e9:10.3g} ns/s {one.errors[-1]:9.2g} m"
                f" {one.energy:9.2g}"
            )
            total = one.seconds * float(known[f"{name}/times"][-1]) * known[f"{name}/position"].shape[1]
            # Four times the steps at the next.
            if 4.0 * total > patience or (quick and count == 1):
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


def advice(name: str, found: list[Point]) -> str:
    """In one sentence, what to choose in this scene."""
    if name == reference.SOFT:
        return _advice_for_springs(found)
    impact = next(p for p in found if p.method == "Impact")
    others = [p for p in found if not p.method.startswith("Impact") and math.isfinite(p.seconds)]
    chosen = f"Choose Impact: {impact.errors[0]:.1g} m after {reference.IMPACTS[0]} impacts"
    if exact := [p for p in others if p.errors[0] <= _EXACT]:
        first = min(exact, key=lambda p: p.seconds)
        return (
            f"{chosen}; {first.method} is as near, first at {first.setting}, in {first.seconds / impact.seconds:.1f} "
            f"times its time"
        )
    nearest = min(others, key=lambda p: p.errors[0])
    return (
        f"{chosen}; the nearest of the others, "
        f"{nearest.method} at {nearest.setting}, is {nearest.errors[0]:.1g} m off in "
        f"{nearest.seconds / impact.seconds:.1f} times its time"
    )


def _advice_for_springs(found: list[Point]) -> str:
    best = front(found, -1)
    names = " and ".join(sorted({p.method for p in best}))
    return (
        f"Where the wall is a spring, choose Penalty: its energy is exact at every dt (worst "
        f"{max(p.energy for p in found if p.method == 'Penalty'):.0e}); nearest in a given time: {names}"
    )


def reaching(found: list[Point], method: str, error: str, target: float) -> Point | None:
    """The fastest setting of a method with an error of at most so much: "energy", or "distance" after 64 impacts."""
    enough = [p for p in found if p.method == method and (p.energy if error == "energy" else p.errors[-1]) <= target]
    return min(enough, key=lambda p: p.seconds, default=None)


def races(name: str, found: list[Point]) -> list[str]:
    """Processor times at equal error, as sentences."""
    if name == "sphere":
        asked = [("Impact", "distance", 1e-3, 1000), ("Impact", "distance", 1e-6, 1000)]
    elif name == reference.SOFT:
        asked = [("Penalty", "energy", 1e-3, 5)]
    else:
        return []
    told = []
    for ours, error, target, bar in asked:
        what = f"{name}, {error} <= {target:g} (bar: {ours} takes 1/{bar} of {PLAIN})"
        mine, other = (reaching(found, method, error, target) for method in (ours, PLAIN))
        if mine is None:
            told.append(f"{what}: {ours} does not reach it")
        elif other is None:
            last = [p for p in found if p.method == PLAIN][-1]
            told.append(
                f"{what}: {PLAIN} reaches it at no dt tried; {last.setting} takes {last.seconds / mine.seconds:.0f} "
                f"times the processor time"
            )
        else:
            told.append(f"{what}: 1/{other.seconds / mine.seconds:.0f}, {mine.setting} against {other.setting}")
    return told


def write(name: str, found: list[Point]) -> None:
    """The points of one scene as CSV."""
    path = file_of(f"accuracy-{name.replace(' ', '-')}-{name_of_machine()}.csv")
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        errors = [f"median_error_{count}_impacts" for count in reference.IMPACTS]
        table.writerow(["method", "setting", "seconds", *errors, "energy_error", "penetration"])
        for p in found:
            numbers = [p.seconds, *p.errors, p.energy, p.penetration]
            table.writerow([p.method, p.setting, *(f"{one:.4g}" for one in numbers)])
    print(f"written to {path}")


def _of_few(known: Known) -> Known:
    """The reference of the first particles alone."""
    few = {"position": np.s_[:, :_FEW], "velocity": np.s_[:, :_FEW], "end": np.s_[:_FEW], "times": np.s_[:]}
    return {key: values[few[key.split("/")[-1]]] for key, values in known.items()}


def main(quick: bool) -> None:
    """Measure every scene; unless quick, write a CSV and a PNG of each."""
    with np.load(reference.PATH) as file:
        known = _of_few(dict(file)) if quick else dict(file)
    print(machine())
    told = []
    for name in ("sphere",) if quick else scenes():
        found = points(name, known, quick)
        told += [f"{name}: {advice(name, found)}.", *races(name, found)]
        if not quick:
            write(name, found)
            file = f"accuracy-{name.replace(' ', '-')}-{name_of_machine()}"
            figure.accuracy(name, found, front(found, -1), advice(name, found), machine(), file)
    print("\n".join(told))

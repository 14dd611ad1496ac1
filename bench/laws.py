"""Laws of walls and counters: what an impact costs in a sphere with each, beside none, and first calls."""

import tempfile
import time
from collections.abc import Callable
from typing import Any

import swarm
from swarm.kernel.jit import select
from swarm.kernel.vector import either, norm
from swarm.observables import drift

from .report import Row, child, in_turn, show, tier, write

# Impacts of a particle in a run that is timed, about.
_IMPACTS, _QUICK = 400.0, 4.0
_COLD = """
import sys, time, swarm
from bench import laws
scene = swarm.Scene([swarm.Sphere(0.5, **laws.LAWS[sys.argv[1]][0])])
start = swarm.fill(scene, 10, speed=1.0, seed=1)
began = time.process_time()
swarm.simulate(scene, start, swarm.Impact(), until=1e-3, compile="always")
print(time.process_time() - began)
"""


class Diffuse(swarm.WallLaw):
    """`Lambert` as a user may write it."""

    probability: float

    def leave(self, v, n, u, random, mass):
        """|v - u| times a direction of the cosine law, or as from a mirror."""
        drawn, w = random.uniform(0), v - u
        is_diffuse = drawn < self.probability
        way = random.diffuse(n, drawn / select(is_diffuse, self.probability, 1.0), 1)
        mirrored = w - 2.0 * (w.x * n.x + w.y * n.y + w.z * n.z) * n
        return u + either(is_diffuse, norm(w) * way, mirrored)


# The laws of a wall, and the nanoseconds that an impact may cost. Some hardly ever come to pass, so that particles do
# not run out.
LAWS: dict[str, tuple[dict[str, Any], float | None]] = {
    "none": ({}, None),
    "restitution and friction": ({"restitution": 0.999999, "friction": 1e-7}, None),
    "temperature": ({"temperature": 0.3}, None),
    "Lambert": ({"laws": [swarm.Lambert()]}, 25.0),
    "Lambert of half": ({"laws": [swarm.Lambert(0.5)]}, 25.0),
    "Absorb": ({"laws": [swarm.Absorb(1e-12)]}, 25.0),
    "Absorb above a barrier": ({"laws": [swarm.Absorb(barrier=10.0, loss=1e-12)]}, 25.0),
    "CercignaniLampis": ({"laws": [swarm.CercignaniLampis(0.3, 0.8, 0.5)]}, 60.0),
    "Absorb, then Lambert": ({"laws": [swarm.Absorb(1e-12), swarm.Lambert()]}, None),
    "user-defined Lambert": ({"laws": [Diffuse(1.0)]}, 25.0),
}
# Surfaces that count, beside what they cost as walls.
COUNTED: dict[str, swarm.Sphere | swarm.Plane | swarm.Box] = {
    "plane": swarm.Plane((1.0, 0.0, 0.0), 0.1),
    "ball": swarm.Sphere(0.1, side="outside"),
    "box": swarm.Box((0.1, 0.1, 0.1), side="outside"),
}
_FIRST_CALLS = "none", "Lambert", "CercignaniLampis", "user-defined Lambert"


def _impact(walls: list[Any], count: int, impacts: float, **keywords: Any) -> Callable[[], float]:
    """Nanoseconds of processor time an impact, on one thread."""
    scene = swarm.Scene(walls)
    start = swarm.fill(scene, count, speed=1.0, seed=1)

    def measure() -> float:
        began = time.process_time()
        run = swarm.simulate(scene, start, swarm.Impact(), until=0.7 * impacts, compile=tier(), threads=1, **keywords)
        return (time.process_time() - began) / float(run.observables["impacts"][-1]) * 1e9

    return measure


def _unbooked(count: int, until: float) -> tuple[float, float]:
    """Impacts of a gas under laws that take, give and absorb, and the part of its energy that no book has."""
    laws = [swarm.Absorb(1e-5), swarm.CercignaniLampis(0.3, 0.8, 0.5), swarm.Lambert(0.5)]
    scene = swarm.Scene([swarm.Sphere(0.5, laws=laws)])
    start = swarm.fill(scene, count, speed=1.0, seed=1)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=until).observables
    return float(seen["impacts"][-1]), drift(seen)


def main(quick: bool = False) -> None:
    """Measure and report."""
    count, rounds, impacts = (2, 1, _QUICK) if quick else (4000, 7, _IMPACTS)
    runs = {name: _impact([swarm.Sphere(0.5, **wall)], count, impacts) for name, (wall, _bar) in LAWS.items()}
    for name, surface in COUNTED.items():
        runs[f"a {name} that is a wall"] = _impact([swarm.Sphere(0.5), surface], count, impacts)
        runs[f"a {name} that counts"] = _impact([swarm.Sphere(0.5)], count, impacts, counters=[surface])
    found = in_turn(runs, rounds)
    rows: list[Row] = []
    for name, (_wall, bar) in LAWS.items():
        best, median = found[name]
        told = "" if bar is None else f"{bar:g}"
        rows.append(Row(f"{name}, an impact", best, median, "ns", told, best / found["none"][0]))
    for name in COUNTED:
        wall, counter = f"a {name} that is a wall", f"a {name} that counts"
        rows.append(Row(f"{wall}, an impact", *found[wall], "ns"))
        rows.append(
            Row(
                f"{counter}, an impact",
                *found[counter],
                "ns",
                f"{found[wall][0]:.3g}",
                found[counter][0] / found[wall][0],
            )
        )
    hits, unbooked = _unbooked(count, 10.0 if quick else 2.2e4)
    rows.append(Row(f"energy that no book has, {hits:.2g} impacts", unbooked, unbooked, "of all", "1e-13"))
    for name in () if quick else _FIRST_CALLS:
        with tempfile.TemporaryDirectory() as folder:
            cold = [float(child(_COLD, name, NUMBA_CACHE_DIR=f"{folder}/{k}")) for k in range(3)]
        rows.append(Row(f"{name}, first call", min(cold), sorted(cold)[1], "s", "2" if "own" in name else ""))
    show(rows)
    if not quick:
        write(rows, "laws")

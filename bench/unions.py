"""Unions: what an impact costs in several parts, beside one of them, and what the first call compiles."""

import tempfile
import time
from collections.abc import Callable

import swarm

from .report import Row, child, in_turn, show, write

# Impacts of a particle in a run that is timed, about.
_IMPACTS, _QUICK = 400.0, 4.0
_GRAVITY = (0.0, 0.0, -9.81)
BALLS = [swarm.Sphere(0.5, (-0.3, 0.0, 0.0)), swarm.Sphere(0.5, (0.3, 0.0, 0.0))]
BOX = swarm.Box((0.5, 0.5, 0.5), (-1.0, 0.0, 0.0))
TUBE = swarm.Cylinder(0.2, (1.0, 0.0, 0.0), 1.2)
ROOMS = [BOX, TUBE, swarm.Box((0.5, 0.5, 0.5), (1.0, 0.0, 0.0))]
_COLD = """
import sys, time, swarm
from bench import unions
surfaces = [swarm.Union(unions.ROOMS)] if sys.argv[1] == "union" else [unions.BOX]
scene = swarm.Scene(surfaces, unions._GRAVITY if sys.argv[2] == "falls" else None)
start = swarm.fill(scene, 10, speed=1.0, seed=1)
began = time.process_time()
swarm.simulate(scene, start, swarm.Impact(), until=1e-3, compile="always")
print(time.process_time() - began)
"""
# What is measured: its surfaces, what it is compared with, and how many times that an impact may cost, without gravity
# and under it.
SCENES = {
    "a ball": ([BALLS[0]], None, ()),
    "two balls": ([swarm.Union(BALLS)], "a ball", (2.2, 3.0)),
    "a box": ([BOX], None, ()),
    "a tube": ([TUBE], None, ()),
    "a box, a tube, a box": ([swarm.Union(ROOMS)], "a tube", (4.0, 5.0)),
}


def _impact(
    surfaces: list[swarm.surfaces.Surface], gravity: tuple[float, ...] | None, count: int, impacts: float
) -> Callable[[], float]:
    """Nanoseconds of processor time an impact, on one thread."""
    scene = swarm.Scene(surfaces, gravity)
    start = swarm.fill(scene, count, speed=1.0, seed=1)

    def measure() -> float:
        began = time.process_time()
        run = swarm.simulate(scene, start, swarm.Impact(), until=impacts, every=impacts, threads=1)
        return (time.process_time() - began) / float(run.observables["impacts"][-1]) * 1e9

    return measure


def main(quick: bool = False) -> None:
    """Measure and report."""
    count, rounds, impacts = (4, 1, _QUICK) if quick else (4000, 7, _IMPACTS)
    rows: list[Row] = []
    for k, (name, gravity) in enumerate((("", None), (" under gravity", _GRAVITY))):
        measures = {what: _impact(surfaces, gravity, count, impacts) for what, (surfaces, _of, _bars) in SCENES.items()}
        found = in_turn(measures, rounds)
        for what, (_surfaces, one, bars) in SCENES.items():
            best, median = found[what]
            bar = f"{bars[k]:g} x" if one else ""
            rows.append(Row(f"{what}{name}, an impact", best, median, "ns", bar, best / found[one][0] if one else None))
    if not quick:
        for what in ("box", "union"):
            for falls in ("", "falls"):
                with tempfile.TemporaryDirectory() as folder:
                    cold = float(child(_COLD, what, falls, NUMBA_CACHE_DIR=folder))
                rows.append(Row(f"{what}{falls and ' under gravity'}, first call", cold, cold, "s"))
    show(rows)
    if not quick:
        write(rows, "unions")

"""The log of impacts: how many a second are written, beside the same run without it."""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import swarm

from .report import Row, in_turn, tier

COUNT, FRAMES = 10_000, 10
_BARS = {"float64": 5.0, "float32": 10.0}


def rows(quick: bool) -> list[Row]:
    """Million impacts a second of all particles in a sphere, frames and file and all, two threads."""
    scene, until = swarm.Scene([swarm.Sphere(0.5)]), 2.0 if quick else 600.0
    start = swarm.fill(scene, COUNT // 1000 if quick else COUNT, speed=1.0, seed=1)
    hits = [0.0]
    with tempfile.TemporaryDirectory() as folder:

        def timed(precision: str | None) -> Callable[[], float]:
            log = None if precision is None else Path(folder) / f"{precision}.h5"

            def measure() -> float:
                if log is not None:
                    log.unlink(missing_ok=True)
                began = time.perf_counter()
                end = swarm.simulate(
                    scene, start, swarm.Impact(), until=until, every=until / FRAMES, impacts=log, threads=2,
                    precision=precision or "float64", compile=tier(),
                )  # fmt: skip
                hits[0] = float(end.observables["impacts"][-1])
                return time.perf_counter() - began

            return measure

        names: dict[str, str | None] = {"none": None, "float64": "float64", "float32": "float32"}
        seconds = in_turn({name: timed(precision) for name, precision in names.items()}, 1 if quick else 5)
    rate = {name: tuple(1e-6 * hits[0] / one for one in pair) for name, pair in seconds.items()}
    return [
        Row(f"{COUNT} particles in a sphere without a log", *rate["none"], "million impacts/s"),
        *(
            Row(f"  log of all, {name}", *rate[name], "million impacts/s", f"{bar:g}", rate[name][0] / rate["none"][0])
            for name, bar in _BARS.items()
        ),
    ]

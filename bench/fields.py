"""Scenes of many bodies: what an impact costs among them, what the first call compiles, and what is kept."""

import math
import tempfile
import time
from collections.abc import Callable

import numba
import numpy as np
from numpy.typing import NDArray

import swarm

from . import impact_log, sampled
from .report import Row, child, in_turn, show, tier, write

Floats = NDArray[np.float64]
COUNT, FILLED, BLUR = 20_000, 0.4, 0.999
# Impacts of a particle in a run that is timed, about.
_IMPACTS = 20.0
_COLD = """
import sys, time, numpy as np, swarm
n = int(sys.argv[1])
places = np.random.default_rng(1).uniform(-0.5, 0.5, (n, 3))
scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Spheres(places, 0.2 * n ** (-1 / 3))])
start = swarm.fill(scene, 10, speed=1.0, seed=1)
began = time.perf_counter()
swarm.simulate(scene, start, swarm.Impact(), until=1e-3, compile="always")
print(time.perf_counter() - began)
"""
_GALTON = """
import time, numpy as np, swarm
pegs = [swarm.Cylinder(0.01, (0, 1, 0), center=(0.1 * (k - 0.5 * row), 0, -0.1 * i), side="outside", restitution=0.5)
        for i, row in enumerate(4 * (7, 8)) for k in range(row)]
walls = [swarm.Plane((np.cos(a), 0, np.sin(a)), 2.0) for a in np.linspace(0.0, 6.0, 10)]
walls += [swarm.Slab((0, 1, 0), 0.05), swarm.Slab((1, 0, 0), 1.5)]
assert len(pegs) == 60 and len(walls) == 12
scene = swarm.Scene([*pegs, *walls], gravity=(0, 0, -9.81))
start = swarm.fill(scene, 10, speed=1.0, seed=1)
began = time.perf_counter()
swarm.simulate(scene, start, swarm.Impact(), until=0.5, compile="always")
print(time.perf_counter() - began)
"""


def lattice(side: int) -> tuple[Floats, float]:
    """side^3 balls in a unit cell that repeats, each a little off its place, and their radius."""
    width = 1.0 / side
    places = (np.stack(np.meshgrid(*3 * [np.arange(side)], indexing="ij"), -1).reshape(-1, 3) + 0.5) * width
    off = np.random.default_rng(1).random((side**3, 3)) - 0.5
    return places + off * (width * (1.0 - 2.0 * FILLED) * BLUR), FILLED * width


# --- The loop that a user would write --------------------------------------------------------------------


@numba.njit(error_model="numpy", cache=True)
def _plain(position, velocity, until, first, entries, places, radius, cells):
    """One particle after the other, from cell to cell of a list: how many impacts."""
    hits, width = 0, 1.0 / cells
    for p in range(position.shape[1]):
        x, y, z = position[0, p], position[1, p], position[2, p]
        a, b, c = velocity[0, p], velocity[1, p], velocity[2, p]
        left = until
        i, j, k = int(x * cells), int(y * cells), int(z * cells)
        while left > 0.0:
            tx = ((i + (a > 0.0)) * width - x) / a
            ty = ((j + (b > 0.0)) * width - y) / b
            tz = ((k + (c > 0.0)) * width - z) / c
            t, ball = min(tx, ty, tz, left), -1
            cell = (i * cells + j) * cells + k
            for e in range(first[cell], first[cell + 1]):
                dx, dy, dz = x - places[entries[e], 0], y - places[entries[e], 1], z - places[entries[e], 2]
                half = dx * a + dy * b + dz * c
                under = half * half - (a * a + b * b + c * c) * (dx * dx + dy * dy + dz * dz - radius * radius)
                if half < 0.0 and under > 0.0:
                    when = (-half - math.sqrt(under)) / (a * a + b * b + c * c)
                    if when < t:
                        t, ball = when, entries[e]
            x, y, z, left = x + t * a, y + t * b, z + t * c, left - t
            if ball >= 0:
                hits += 1
                nx, ny, nz = x - places[ball, 0], y - places[ball, 1], z - places[ball, 2]
                f = 2.0 * (nx * a + ny * b + nz * c) / (nx * nx + ny * ny + nz * nz)
                a, b, c = a - f * nx, b - f * ny, c - f * nz
            elif left > 0.0:
                if t == tx:
                    i += 1 if a > 0.0 else -1
                    x, i = x - (i == cells) + (i < 0), (i + cells) % cells
                elif t == ty:
                    j += 1 if b > 0.0 else -1
                    y, j = y - (j == cells) + (j < 0), (j + cells) % cells
                else:
                    k += 1 if c > 0.0 else -1
                    z, k = z - (k == cells) + (k < 0), (k + cells) % cells
        position[0, p], position[1, p], position[2, p] = x, y, z
        velocity[0, p], velocity[1, p], velocity[2, p] = a, b, c
    return hits


def plain(side: int, start: swarm.Particles, until: float) -> Callable[[], float]:
    """Nanoseconds an impact of that loop, with each ball in a cell of its own."""
    places, radius = lattice(side)
    first, entries = np.arange(side**3 + 1), np.arange(side**3)

    def measure() -> float:
        position, velocity = start.position.copy(), start.velocity.copy()
        began = time.perf_counter()
        hits = _plain(position, velocity, until, first, entries, places, radius, side)
        return 1e9 * (time.perf_counter() - began) / hits

    return measure


# --- swarm -----------------------------------------------------------------------------------------------


def _nanoseconds(scene: swarm.Scene, start: swarm.Particles, until: float, threads: int) -> Callable[[], float]:
    """Nanoseconds an impact, less what one with hardly any takes, the least so far: it makes cells and images."""
    least = math.inf

    def seconds(span: float) -> tuple[float, float]:
        began = time.perf_counter()
        end = swarm.simulate(scene, start, swarm.Impact(), until=span, threads=threads, compile=tier())
        return time.perf_counter() - began, float(end.observables["impacts"][-1])

    def measure() -> float:
        nonlocal least
        least = min(least, seconds(1e-3 * until)[0])
        whole, impacts = seconds(until)
        return 1e9 * (whole - least) / impacts

    return measure


def speed(quick: bool) -> list[Row]:
    """Nanoseconds an impact in a lattice that repeats, beside the plain loop."""
    rows = []
    for side, bar in ((3, 80), (10, 80), (40, None), (100, 200)):
        if quick and side > 10:
            continue
        places, radius = lattice(side)
        began = time.perf_counter()
        scene = swarm.Scene([swarm.Spheres(places, radius)], period=(1.0, 1.0, 1.0))
        scene.compiled().walls()
        built = time.perf_counter() - began
        start = swarm.fill(scene, 4 if quick else COUNT, speed=1.0, seed=2)
        until = 4.0 * radius * (2.0 if quick else _IMPACTS)
        measures = {
            "one": _nanoseconds(scene, start, until, 1),
            "two": _nanoseconds(scene, start, until, 2),
            "plain": plain(side, start, until),
        }
        figures = in_turn(measures, 1 if quick else 5)
        own, rest = figures["one"][0], f"{side**3} balls"
        rows += [
            Row(f"{rest}, an impact", *figures["one"], "ns", str(bar or "")),
            Row("  two threads", *figures["two"], "ns", f"{own / 1.5:.3g}", own / figures["two"][0]),
            Row("  the plain loop", *figures["plain"], "ns", f"{2.0 * own:.3g}", figures["plain"][0] / own),
            Row("  cells and images made in", built, built, "s"),
        ]
    return rows


def packing(quick: bool) -> list[Row]:
    """Balls at random that overlap, in a box: nothing gets into one, and the energy is kept."""
    random, n = np.random.default_rng(3), 100 if quick else 1000
    field = swarm.Spheres(random.uniform(-0.5, 0.5, (n, 3)), random.uniform(0.01, 0.05, n))
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), field])
    start = swarm.fill(scene, 4 if quick else COUNT, speed=1.0, seed=4)
    until = 1.0 if quick else 100.0
    # The first call compiles.
    swarm.simulate(scene, start, swarm.Impact(), until=1e-3 * until, threads=2, compile=tier())
    began = time.perf_counter()
    end = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / 4.0, threads=2, compile=tier())
    seconds, seen = time.perf_counter() - began, end.observables
    hits = float(seen["impacts"][-1])
    outside = float((field.phi(end.particles.position) < -1e-12).sum())
    return [
        Row(f"packing of {n} balls that overlap, impacts", hits, hits, ""),
        Row("  an impact, two threads, frames and all", 1e9 * seconds / hits, 1e9 * seconds / hits, "ns"),
        Row("  energy error of a particle", *2 * [float(seen["energy_error"].max())], ""),
        Row("  largest penetration", *2 * [float(seen["max_penetration"].max())], "m"),
        Row("  particles in a ball", outside, outside, "", "0"),
    ]


def _cold(code: str, *arguments: str) -> float:
    """Seconds of the first call in a process without compiled kernels."""
    with tempfile.TemporaryDirectory() as folder:
        return float(child(code, *arguments, NUMBA_CACHE_DIR=folder).split()[-1])


def compiled(quick: bool) -> list[Row]:
    """Seconds of the first call."""
    if quick:
        return []
    rows = []
    for n in (10, 1000, 100_000):
        seconds = _cold(_COLD, str(n))
        rows.append(Row(f"{n} balls in a box, first call", seconds, seconds, "s", "12"))
    seconds = _cold(_GALTON)
    return [*rows, Row("60 pegs and 12 walls, grains under gravity, first call", seconds, seconds, "s", "15")]


def main(quick: bool) -> None:
    """Measure all of it."""
    rows = [row for part in (speed, packing, impact_log.rows, sampled.rows, compiled) for row in part(quick)]
    show(rows)
    if not quick:
        write(rows, "fields")

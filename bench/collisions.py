"""Balls that meet: what a collision costs in gases and liquids of hard spheres, memory, first calls, and how exact."""

import math
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import swarm
from swarm.events.balls_run import CollidingRun
from swarm.kernel.random import Seeding
from swarm.run.tally import Watched

from .report import Row, child, in_turn, show, tier, write

# (name, balls, packing, whether the cell repeats, the microseconds that a collision may take)
SPEEDS = [
    ("8788 balls, packing 0.4, box", 8788, 0.4, False, 1.2),
    ("8788 balls, packing 0.2, box", 8788, 0.2, False, 2.0),
    ("8788 balls, packing 0.4, repeated", 8788, 0.4, True, 1.2),
    ("108000 balls, packing 0.3, box", 108_000, 0.3, False, 3.0),
    ("10^6 balls, packing 0.3, box", 1_000_000, 0.3, False, 4.0),
]
_COLD = """
import time, swarm
scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0))])
start = swarm.Particles([[-0.5, 0.5], [0.0, 0.1], [0.0, 0.0]], [[1.0, -1.0], [0.0, 0.0], [0.0, 0.0]], radius=0.1)
began = time.process_time()
swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="always")
print(time.process_time() - began)
"""
# VmHWM and not ru_maxrss, which a process inherits from the one that started it.
_MEMORY = """
import re, sys
from bench import collisions, report
if sys.argv[2] == "never":
    report.be_quick()
run = collisions.running(int(sys.argv[1]), 0.3, False)
with run:
    run.observe()
    run.advance(1e-3, 1e-3)
    print(1024 * int(re.search(r"VmRSS:\\s+([0-9]+) kB", open("/proc/self/status").read())[1]))
"""


def lattice(n: int, packing: float) -> tuple[Any, float, float]:
    """About so many places (3, N) of a cubic lattice about the origin, its length, and the radius of a packing."""
    side = round(n ** (1.0 / 3.0))
    places = np.arange(side) + 0.5 * (1.0 - side)
    position = np.stack(np.meshgrid(places, places, places, indexing="ij")).reshape(3, -1)
    return position, float(side), 0.5 * (6.0 * packing / math.pi) ** (1.0 / 3.0)


def running(n: int, packing: float, repeats: bool) -> CollidingRun:
    """A run of about so many balls in a cube, or between two plates of a cell that repeats along them."""
    position, side, radius = lattice(n, packing)
    walls, period = [swarm.Box((0.5 * side,) * 3)], None
    if repeats:
        position, period = position + 0.5 * side, (side, side, None)
        walls = [swarm.Plane((0.0, 0.0, sign), max(sign, 0.0) * side) for sign in (-1.0, 1.0)]
    velocity = np.random.default_rng(1).normal(size=position.shape)
    velocity -= velocity.mean(axis=1)[:, None]
    image = np.zeros(position.shape, np.int64) if repeats else None
    start = swarm.Particles(position, velocity, image=image, radius=radius)
    scene = swarm.Scene(walls, period=period)
    return CollidingRun(scene.compiled(), start, swarm.Impact(), 1, None, tier(), Seeding(), Watched())


def rate_of(n: int, packing: float) -> float:
    """Collisions a second of n such balls, by Enskog and Carnahan and Starling."""
    contact = (1.0 - 0.5 * packing) / (1.0 - packing) ** 3
    diameter = (6.0 * packing / math.pi) ** (1.0 / 3.0)
    return 12.0 * n * packing * contact / diameter / math.sqrt(math.pi)


def _speed(n: int, packing: float, repeats: bool, collisions: float) -> Callable[[], float]:
    """Microseconds of processor time a collision, on one thread, of a run that goes on and on."""
    run = running(n, packing, repeats)
    count, times = len(run.state.mass), [0.0]
    span = collisions / rate_of(count, packing)
    run.observe()

    def measure() -> float:
        before, began = run.collisions(), time.process_time()
        run.advance(span, times[-1] + span)
        times.append(times[-1] + span)
        return (time.process_time() - began) / (run.collisions() - before) * 1e6

    return measure


def deepest(position: Any, radius: float, lengths: Any) -> float:
    """How deep two balls of a run overlap at most [m]."""
    from scipy.spatial import cKDTree

    distance, _other = cKDTree(np.ascontiguousarray(position.T), boxsize=lengths).query(position.T, k=2)
    return float(2.0 * radius - distance[:, 1].min())


def _exact(n: int, collisions: float, frames: int) -> list[Row]:
    """Energy, momentum along the cell, and overlaps of a long run."""
    packing, run = 0.3, running(n, 0.3, True)
    _position, side, radius = lattice(n, packing)
    span, depth = collisions / rate_of(len(run.state.mass), packing) / frames, -math.inf
    scale, wrong = float(np.abs(run.state.velocity).sum()), 0.0
    with run:
        run.observe()
        for k in range(frames):
            run.advance(span, (k + 1) * span)
            seen = run.seen()
            lengths = [side, side, 10.0 * side]
            depth = max(depth, deepest(run.state.position, radius, lengths), seen["max_penetration"])
            wrong = max(wrong, float(np.abs(seen["momentum"][:2]).max()) / scale)
    told = f"{run.collisions():.2g} collisions"
    off = seen["energy_error"]
    eps = float(np.spacing(side))
    return [
        Row(f"energy after {told}", off, off, "of all", "1e-13"),
        Row(f"momentum along the cell after {told}", wrong, wrong, "of all", "1e-13"),
        Row(f"overlap at {frames} frames of {told}", depth / eps, depth / eps, "roundings", "4"),
    ]


# Cavities of about the same size: what an event costs of balls in each, beside points in it, and balls in a box; and
# the same of those that fall.
_BOX, _FORMULA = swarm.Box((0.9, 0.9, 0.9)), swarm.Formula("x**4 + y**4 + z**4 - 1")
_GRAVITY = (0.0, 0.0, -1.0)
CAVITIES = {
    "a box": (_BOX, None),
    "an ellipsoid": (swarm.Ellipsoid((1.0, 0.9, 0.95)), None),
    "a formula": (_FORMULA, None),
    "two boxes": (swarm.Union([_BOX, swarm.Box((0.6, 0.6, 0.6), (1.3, 0.0, 0.0))]), None),
    "a box under gravity": (_BOX, _GRAVITY),
    "a formula under gravity": (_FORMULA, _GRAVITY),
}


def _event(scene: swarm.Scene, radius: float | None, count: int, until: float) -> Callable[[], float]:
    """Microseconds of processor time an impact or a collision, on one thread, at a packing of a few thousandths."""
    start = swarm.fill(scene, count, speed=1.0, radius=radius, seed=1)

    def measure() -> float:
        began = time.process_time()
        seen = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until, threads=1).observables
        events = seen["impacts"][-1] + (seen["collisions"][-1] if radius is not None else 0)
        return (time.process_time() - began) / float(events) * 1e6

    return measure


def _cavities(quick: bool) -> list[Row]:
    """An event of balls in cavities of several kinds, over that of points there, which take up to eight at once."""
    count, until = (3, 2.0) if quick else (500, 150.0)
    measures = {}
    for name, (surface, gravity) in CAVITIES.items():
        scene = swarm.Scene([surface], gravity)
        measures[name, "point"] = _event(scene, None, count, until if quick else 40.0 * until)
        measures[name, "ball"] = _event(scene, 0.02, count, until)
    found = in_turn({f"{kind} in {name}": measure for (name, kind), measure in measures.items()}, 1 if quick else 5)
    rows = []
    for what, (best, median) in found.items():
        point = found[what.replace("ball", "point")][0]
        rows.append(Row(f"{what}, an event", best, median, "us", "", best / point if "ball" in what else None))
    for name, (_surface, gravity) in CAVITIES.items():
        nearest = "a box" if gravity is None else "a box under gravity"
        if name != nearest:
            one, other = (np.array(found[f"ball in {where}"]) for where in (name, nearest))
            rows.append(Row(f"ball in {name} over one in {nearest}", *(one / other).tolist(), "", "3"))
    return rows


def main(quick: bool = False) -> None:
    """Measure and report."""
    # 10^6 balls are in so many collisions first, and only then have velocities of a gas.
    runs = {
        name: _speed(20 if quick else n, packing, repeats, 100.0 if quick else max(5e5, 0.5 * n))
        for name, n, packing, repeats, _bar in SPEEDS
    }
    found = in_turn(runs, 1 if quick else 5)
    rows = [Row(f"{name}, a collision", *found[name], "us", f"{bar:g}") for name, *_rest, bar in SPEEDS]
    small, large = (float(child(_MEMORY, str(k), tier())) for k in ((8, 64) if quick else (1000, 1_000_000)))
    each = (large - small) / (64 if quick else 1_000_000)
    rows.append(Row("memory, packing 0.3", each, each, "bytes/particle", "220"))
    rows += _cavities(quick)
    rows += _exact(*((27, 100.0, 5) if quick else (1000, 1e8, 1000)))
    if not quick:
        with tempfile.TemporaryDirectory() as folder:
            cold = [float(child(_COLD, NUMBA_CACHE_DIR=f"{folder}/{k}")) for k in range(3)]
        rows.append(Row("first call, a box", min(cold), sorted(cold)[1], "s", "3"))
    show(rows)
    if not quick:
        write(rows, "collisions")

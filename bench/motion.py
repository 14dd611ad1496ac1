"""Walls that move and walls that are moved: how exact, what is conserved, and nanoseconds an impact."""

import math
import time
from collections.abc import Callable

import numpy as np

import swarm
from examples import fermi, heavy_piston, piston

from .report import Row, in_turn, show, tier, write

UP = (0.0, 0.0, 1.0)
COUNT = 10_000
# How long the runs are that are timed [s]; what a run costs besides is that of one of the shortest.
_TIMED, _SHORT = 200.0, 1e-3
SWING = swarm.Oscillation((0.02, 0.01, 0.03), frequency=1.0)
TURN = swarm.Rotation((1.0, 2.0, 3.0), rate=1.3, center=(0.1, 0.0, -0.05))
DRIFT = swarm.Translation((0.3, -0.2, 0.1))


def _one(what: str, value: float, unit: str = "", bar: str = "") -> Row:
    return Row(what, value, value, unit, bar)


def _run(scene: swarm.Scene, particles: swarm.Particles, until: float, threads: int = 1) -> swarm.Result:
    return swarm.simulate(scene, particles, swarm.Impact(), until=until, threads=threads, compile=tier())


# --- Given motions ---------------------------------------------------------------------------------------


def pistons(quick: bool) -> list[Row]:
    """A gas that a slow piston compresses."""
    count, speed = (10, 0.2) if quick else (4_000, 0.001)
    mixed, straight = (piston.run(count, speed, balls=balls) for balls in (True, False))
    off = mixed.temperature[-1] * mixed.volume[-1] ** (2.0 / 3.0) - 1.0
    error = mixed.error[-1] / mixed.temperature[-1]
    return [
        _one("piston, T V^(2/3) - 1", off),
        _one("  in standard errors", abs(off) / error, "", "3"),
        _one("  straight box, T_z L^2 - 1", straight.along[0] * piston.LEFT**2 - 1.0),
        _one("  impacts", mixed.impacts, "", "1e6"),
        _one("  energy less work, relative", mixed.balance, "", "1e-13"),
    ]


def accelerator(quick: bool) -> list[Row]:
    """Fermi's accelerator: in 50 digits, and its bound."""
    amplitude, speed, impacts = 0.01, 8.0, 20 if quick else 501
    until, wanted = fermi.in_fifty_digits(speed, amplitude, impacts)
    swing = swarm.Oscillation((amplitude, 0.0, 0.0), fermi.FREQUENCY)
    walls = [swarm.Plane((-1, 0, 0), 0.0), swarm.Plane((1, 0, 0), fermi.LENGTH, motion=swing)]
    start = swarm.Particles([0.0, 0.0, 0.0], [speed, 0.0, 0.0])
    # Just before it is back at the wall at rest
    last = _run(swarm.Scene(walls), start, until - 1e-3)
    speeds = np.linspace(0.05, 2.0, 40)
    largest = np.abs(fermi.run(speeds, 5 if quick else 2000)[1]).max(axis=0)
    return [
        _one("Fermi-Ulam, impacts", float(last.observables["impacts"][-1]), "", "1000"),
        _one("  speed, relative to 50 digits", abs(-last.particles.velocity[0, 0] / wanted - 1.0), "", "1e-9"),
        _one("  largest speed of those that begin below 0.3", float(largest[speeds < 0.3].max()), "m/s"),
    ]


def uniform(quick: bool) -> list[Row]:
    """Vessels in uniform motion against the same at rest, after some 50 impacts of each particle."""
    rows = []
    cavities: dict[str, Callable[..., swarm.Scene]] = {
        "sphere": lambda motion: swarm.Scene([swarm.Sphere(0.5, motion=motion)]),
        "box": lambda motion: swarm.Scene([swarm.Box((0.5, 0.4, 0.3), motion=motion)]),
    }
    shift = np.array(DRIFT.velocity)[:, None]
    for name, made in cavities.items():
        count, until = (2, 5.0) if quick else (20, 36.0)
        start = swarm.fill(made(None), count, speed=1.0, seed=3)
        here = _run(made(None), start, until)
        there = _run(made(DRIFT), swarm.Particles(start.position, start.velocity + shift), until)
        off = np.abs(there.particles.position - until * shift - here.particles.position).max()
        rows.append(_one(f"{name} in uniform motion, off that at rest", float(off), "m", "1e-12"))
        rows.append(_one("  impacts a particle", float(here.impacts_per_particle.mean()), "", "50"))
    return rows


def rotating(quick: bool) -> list[Row]:
    """A sphere that turns does nothing, a box heats its gas."""
    count, until = (4, 5.0) if quick else (500, 100.0)
    turn = swarm.Rotation((0.0, 0.3, 1.0), 1.0, (0.0, 0.0, 0.0))
    sphere, box = swarm.Sphere(0.5, motion=turn), swarm.Box((0.5, 0.4, 0.3), motion=turn)
    rows = []
    for name, surface in {"sphere": sphere, "box": box}.items():
        scene = swarm.Scene([surface])
        seen = _run(scene, swarm.fill(scene, count, speed=1.0, seed=3), until).observables
        energy, work = seen["total_energy"], seen["wall_work"].sum(axis=1)
        rows.append(_one(f"rotating {name}, energy gained", float(energy[-1] / energy[0] - 1.0)))
        rows.append(_one("  less the work", float(abs(energy[-1] - work[-1] - energy[0]) / energy[-1]), "", "1e-13"))
    return rows


# --- Walls that are moved --------------------------------------------------------------------------------


def galperin(digits: int) -> tuple[swarm.Scene, swarm.Particles]:
    """A particle of 1 kg at rest between a wall and a piston of 100^digits kg that comes."""
    heavy = swarm.Plane((1, 0, 0), 1.0, mass=100.0**digits, motion=swarm.Guide((1, 0, 0), speed=-1.0))
    return swarm.Scene([swarm.Plane((-1, 0, 0), 0.0), heavy]), swarm.Particles([0.5, 0, 0], [0, 0, 0])


def vessel(mass: float) -> swarm.Scene:
    """Two gases and a piston between them; the ends are planes, so that each has an impulse of its own."""
    sides = [swarm.Slab((1, 0, 0), 0.5), swarm.Slab((0, 1, 0), 0.5)]
    ends = [swarm.Plane((0, 0, -1), 1.0), swarm.Plane(UP, 1.0)]
    return swarm.Scene([*sides, *ends, swarm.Slab(UP, 0.02, side="outside", mass=mass, motion=swarm.Guide(UP))])


def reacting(quick: bool) -> list[Row]:
    """A heavy piston between two gases, and Galperin's counts."""
    count, until = (10, 5.0) if quick else (COUNT, 60.0)
    mass, scene = 1000.0, vessel(1000.0)
    gas = swarm.fill(scene, count, temperature=1.0, seed=1)
    start = swarm.Particles(gas.position, gas.velocity * np.where(gas.position[2] > 0.0, 1.5, 0.7))
    _run(scene, start, 1e-3)
    began = time.perf_counter()
    result = _run(scene, start, until)
    seconds, seen = time.perf_counter() - began, result.observables
    along = seen["momentum"][:, 2] + mass * seen["wall_velocity"][:, 4, 2]
    along += seen["impulse"][:, 3] - seen["impulse"][:, 2]
    whole, hits = float(seen["impulse"][-1, 2:4].sum()), float(seen["impacts"][-1])
    shared = heavy_piston.run(*((10, 5.0, 10.0) if quick else (2_000, 50.0, 800.0)), compile=tier())
    difference, error = heavy_piston.late_difference(shared)
    rows = [
        _one("heavy piston, impacts", hits, "", "1e6"),
        _one("  energy, relative", float(seen["energy_error"].max()), "", "1e-13"),
        _one("  momentum along the guide, over the impulses", abs(along[-1] - along[0]) / whole, "", "1e-13"),
        _one("  impacts a second", hits / seconds, "1/s", "1e6"),
        _one("adiabatic piston, T above less T below", difference, "J"),
        _one("  in standard errors", abs(difference) / error, "", "3"),
        _one("  energy, relative", shared.balance, "", "1e-13"),
    ]
    for digits, counted in enumerate((3, 31, 314, 3141, 31415)[: 3 if quick else None]):
        found = _run(*galperin(digits), 20.0).observables["impacts"][-1]
        rows.append(_one(f"Galperin, 100^{digits} kg", float(found), "impacts", str(counted)))
    return rows


# --- Speed -----------------------------------------------------------------------------------------------


def _nanoseconds(scene: swarm.Scene, start: swarm.Particles, until: float) -> Callable[[], float]:
    def measure() -> float:
        seconds, impacts = [], 0.0
        for span in (_SHORT, until):
            began = time.perf_counter()
            impacts = float(_run(scene, start, span).observables["impacts"][-1])
            seconds.append(time.perf_counter() - began)
        return 1e9 * (seconds[1] - seconds[0]) / impacts

    return measure


def speed(quick: bool) -> list[Row]:
    """Nanoseconds an impact, one thread, all ways in turn."""
    count, until = (4, 2.0) if quick else (COUNT, _TIMED)
    rows = []
    for name, made in {
        "sphere": lambda motion: swarm.Sphere(0.5, motion=motion),
        "box": lambda motion: swarm.Box((0.5, 0.4, 0.3), motion=motion),
    }.items():
        start = swarm.fill(swarm.Scene([made(None)]), count, speed=1.0, seed=3)
        ways = {"at rest": None, "in uniform motion": DRIFT, "oscillating": SWING, "rotating": TURN}
        scenes = {way: swarm.Scene([made(motion)]) for way, motion in ways.items()}
        drift = np.array(DRIFT.velocity)[:, None]
        carried = swarm.Particles(start.position, start.velocity + drift)
        measures = {
            way: _nanoseconds(scene, carried if way == "in uniform motion" else start, until)
            for way, scene in scenes.items()
        }
        figures = in_turn(measures, 1 if quick else 5)
        rest = figures["at rest"][0]
        bars = {"in uniform motion": f"{1.5 * rest:.3g}", "oscillating": "60", "rotating": "60"}
        rows += [
            Row(f"{name} {way}, an impact", *figures[way], "ns", bars.get(way, ""), figures[way][0] / rest)
            for way in ways
        ]
    return rows


def main(quick: bool) -> None:
    """Measure all of it."""
    rows = [row for part in (pistons, accelerator, uniform, rotating, reacting, speed) for row in part(quick)]
    if not all(math.isfinite(row.best) for row in rows):
        raise ValueError("a figure of the table is not a number")
    show(rows)
    if not quick:
        write(rows, "motion")

"""Soft balls that press on one another: microseconds a grain and step, at rest and as they fall, and exactness."""

import time

import numpy as np

import swarm

from .report import Row, repeated, show, tier, write

G, DIAMETER = 9.81, 0.01
MASS = 2500.0 * np.pi / 6.0 * DIAMETER**3


def _one(what: str, value: float, unit: str = "", bar: str = "") -> Row:
    return Row(what, value, value, unit, bar)


def lattice(n: int, across: int, spacing: float) -> np.ndarray:
    """Places of balls on a lattice, a little off it, layer by layer from the floor up."""
    k, wobble = np.arange(n), np.random.default_rng(0).uniform(-0.015, 0.015, (3, n))
    x, y = (one - 0.5 * (across - 1) for one in (k % across, k // across % across))
    return spacing * (np.array([x, y, k // across**2 + 0.55]) + wobble)


def hopper(n: int, across: int, friction: float) -> tuple[swarm.Scene, swarm.Particles]:
    """A box with grains that are about to fall on its floor."""
    laws = {"restitution": 0.3, "friction": friction}
    half = 0.5 * across * 1.06 * DIAMETER
    box = swarm.Box((half, half, 5.0), (0.0, 0.0, 5.0), **laws)
    scene = swarm.Scene([box], gravity=(0.0, 0.0, -G), pairs=swarm.Pairs(**laws))
    return scene, swarm.Particles(lattice(n, across, 1.03 * DIAMETER), np.zeros((3, n)), MASS, radius=0.5 * DIAMETER)


def _seconds(
    scene: swarm.Scene, start: swarm.Particles, method: swarm.Penalty, steps: int
) -> tuple[float, swarm.Result]:
    """Processor time of so many steps, less that of a run of one."""
    spent = []
    # The first one compiles.
    for count in (1, 1, steps):
        began = time.process_time()
        until = count * method.dt
        result = swarm.simulate(scene, start, method, until=until, every=until, threads=1, compile=tier())
        spent.append(time.process_time() - began)
    return spent[2] - spent[1], result


def speed(quick: bool) -> list[Row]:
    """A pile as it falls and at rest."""
    n, across = (8, 2) if quick else (10_000, 18)
    method, rows = swarm.Penalty(1e-4, 6e4, 1.5), []
    for name, friction in (("smooth", 0.0), ("rough, mu = 0.5", 0.5)):
        scene, start = hopper(n, across, friction)
        steps = 10 if quick else 1000
        taken, result = _seconds(scene, start, method, steps)
        rows.append(_one(f"{n} {name} grains that fall, a grain and step", taken / n / steps * 1e6, "us"))
        until, at_rest = (0.003, 10) if quick else (3.0, 200)
        rest = swarm.simulate(scene, result.particles, method, until=until, every=until, compile=tier()).particles
        each = 1e6 / n / at_rest
        least, median = repeated(lambda: _seconds(scene, rest, method, at_rest)[0] * each, 1 if quick else 3)  # noqa: B023
        rows.append(Row("  at rest, a grain and step", least, median, "us", "1.5"))
        result = _seconds(scene, rest, method, at_rest)[1]
        moving = float(result.observables["kinetic_energy"][-1]) / n
        rows.append(_one("  their kinetic energy, a grain", moving, "J", "1e-20"))
    return rows


def exactness(quick: bool) -> list[Row]:
    """A gas of soft balls in a box, and in a cell that repeats."""
    n, across, steps = (27, 3, 20) if quick else (10_000, 22, 10_000)
    velocity, dt = np.random.default_rng(1).normal(size=(3, n)), 5e-4
    places = lattice(n, across, 2.0 / across) - np.array([[0.0], [0.0], [1.0]])
    box, cell = swarm.Scene([swarm.Box((1.0, 1.0, 1.0))]), swarm.Scene([], period=(2.0, 2.0, 2.0))
    rows = []
    for name, scene, shift in (("box", box, 0.0), ("cell that repeats", cell, 1.0)):
        start = swarm.Particles(0.98 * places + shift, velocity, 1.0, radius=0.66 / across)
        result = swarm.simulate(
            scene, start, swarm.Penalty(dt, 1e6, 1.5), until=steps * dt, every=steps * dt / 10, compile=tier()
        )
        seen, end = result.observables, result.particles
        rows.append(
            _one(f"{n} balls in a {name}, {steps} steps: energy", float(seen["energy_error"].max()), "", "1e-10")
        )
        rows.append(_one("  collisions", float(seen["collisions"][-1])))
        if not scene.surfaces:
            scale = (end.mass * np.sqrt((end.velocity**2).sum(axis=0))).sum()
            off = float(abs(seen["momentum"] - seen["momentum"][0]).max() / scale)
            rows.append(_one("  momentum", off, "", "1e-13"))
    return rows


def impact(quick: bool) -> list[Row]:
    """Two balls with Hertz's law: what is left of the gap when the contact ends, and its order."""
    alpha, speed_, mass = 1e5, 1.0, 0.5 * MASS
    deepest = (1.25 * mass * speed_**2 / alpha) ** 0.4
    duration = 2.943275 * deepest / speed_
    room, errors = swarm.Scene([swarm.Sphere(10.0)]), []
    for steps in (32, 64):
        start = swarm.Particles(
            [[-0.5 * DIAMETER, 0.5 * DIAMETER], [0.0] * 2, [0.0] * 2], [[0.5, -0.5], [0.0] * 2, [0.0] * 2], MASS,
            radius=0.5 * DIAMETER,
        )  # fmt: skip
        method = swarm.Penalty(duration / steps, alpha, 1.5)
        end = swarm.simulate(room, start, method, until=duration, every=duration, compile=tier())
        x = end.particles.position[0]
        errors.append(abs(DIAMETER - (x[1] - x[0])) / deepest)
    return [
        _one("Hertz, gap after the contact of 64 steps, of the deepest", errors[1]),
        _one("  order", float(np.log2(errors[0] / errors[1])), "", "2"),
    ]


def main(quick: bool = False) -> None:
    """Measure and report."""
    rows = [row for part in (impact, exactness, speed) for row in part(quick)]
    show(rows)
    if not quick:
        write(rows, "grains")

"""Energy error over the number of impacts: of 10 000 particles the worst, up to a million impacts each.

A plain event-driven loop reflects with v - 2 (v.n) n; the bias of its rounding adds up. `Impact` knows each particle's
energy and gives it back at every impact.
"""

import math
from collections.abc import Sequence

import numba
import numpy as np
from numpy.typing import NDArray

import swarm

from .. import figure
from . import picture
from .picture import Cell

SPEED, PARTICLES = 0.5, 10_000
SCENES = {"sphere": swarm.Scene([swarm.Sphere(0.5)]), "ellipsoid": swarm.Scene([swarm.Ellipsoid((0.3, 0.4, 0.6))])}
PLAIN = "plain reflections in Numba"
# The plain loop is five times slower.
_PLAIN_PARTICLES = 200
_IMPACTS = tuple(10**k for k in range(7))


@numba.njit(error_model="numpy")
def _plain_reflections(position, velocity, radius, impacts):
    """From impact to impact in a sphere."""
    for i in range(position.shape[1]):
        x, y, z = position[0, i], position[1, i], position[2, i]
        vx, vy, vz = velocity[0, i], velocity[1, i], velocity[2, i]
        for _ in range(impacts):
            a = vx * vx + vy * vy + vz * vz
            b = x * vx + y * vy + z * vz
            t = (np.sqrt(b * b - a * (x * x + y * y + z * z - radius * radius)) - b) / a
            x, y, z = x + t * vx, y + t * vy, z + t * vz
            f = 2.0 * (x * vx + y * vy + z * vz) / (radius * radius)
            vx, vy, vz = vx - f * x, vy - f * y, vz - f * z
        position[0, i], position[1, i], position[2, i] = x, y, z
        velocity[0, i], velocity[1, i], velocity[2, i] = vx, vy, vz


def bar(impacts: float) -> float:
    """What the error may be."""
    return 5e-16 * math.sqrt(impacts)


def _error(start: NDArray, end: NDArray) -> float:
    return float(abs((end**2).sum(axis=0) / (start**2).sum(axis=0) - 1.0).max())


def measure(quick: bool) -> list[Cell]:
    """Each scene after each number of impacts, a run of its own; quick: one, up to 100."""
    found = []
    numbers = _IMPACTS[:3] if quick else _IMPACTS
    for name, scene in list(SCENES.items())[: 1 if quick else 2]:
        count = 10 if quick else PARTICLES
        particles = swarm.fill(scene, count, speed=SPEED, seed=11)
        pilot = swarm.simulate(scene, particles, swarm.Impact(), until=20.0, threads=2)
        rate = pilot.observables["impacts"][-1] / count / 20.0
        for impacts in numbers:
            end = swarm.simulate(scene, particles, swarm.Impact(), until=impacts / rate, threads=2).particles
            error = _error(particles.velocity, end.velocity)
            found.append({"scene": name, "method": "Impact", "impacts": impacts, "energy_error": error})
    start = swarm.fill(SCENES["sphere"], _PLAIN_PARTICLES, speed=SPEED, seed=11)
    for impacts in numbers:
        position, velocity = start.position.copy(), start.velocity.copy()
        _plain_reflections(position, velocity, 0.5, impacts)
        error = _error(start.velocity, velocity)
        found.append({"scene": "sphere", "method": PLAIN, "impacts": impacts, "energy_error": error})
    return found


def _curves(cells: Sequence[Cell]) -> dict[str, list[Cell]]:
    curves: dict[str, list[Cell]] = {}
    for cell in cells:
        curves.setdefault(f"{cell['method']}, {cell['scene']}", []).append(cell)
    return curves


def told(cells: Sequence[Cell]) -> list[str]:
    """One sentence a curve."""
    return [
        f"{name}: worst energy error {max(c['energy_error'] for c in mine):.2g} up to {mine[-1]['impacts']:g} impacts "
        f"(bar there {bar(mine[-1]['impacts']):.1g})"
        for name, mine in _curves(cells).items()
    ]


def draw(cells: Sequence[Cell]) -> None:
    """One curve a method and scene."""
    drawn, axes = figure.subplots(1, 9.0, 4.4)
    for colour, (name, mine) in zip(figure.colours(), _curves(cells).items(), strict=False):
        # Zero has no place on a logarithmic axis.
        errors = [max(c["energy_error"], 1e-17) for c in mine]
        axes.plot([c["impacts"] for c in mine], errors, color=colour, marker="o", markersize=4, label=name)
    axes.plot(
        _IMPACTS,
        [bar(n) for n in _IMPACTS],
        color=figure.colours()[-1],
        linestyle="--",
        label=r"$5\cdot 10^{-16}\sqrt{n}$",
    )
    axes.set(xscale="log", yscale="log", xlabel="impacts of a particle, n", ylabel="relative energy error")
    axes.set_title(
        f"Round-off adds up in plain reflections, not in Impact: worst of {PARTICLES} particles ({_PLAIN_PARTICLES})"
    )
    axes.legend()
    picture.save(drawn, cells, "roundoff")

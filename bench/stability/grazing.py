"""Impact in a sphere from normal incidence to grazing: cost and distance over the angle and `shortest_flight`.

A launch at a small angle has 1/angle impacts a crossing; where its flights are shorter than the shortest, the particle
slides along the wall in steps of that length.
"""

import math
import time
from collections.abc import Sequence

import numpy as np

import swarm
from swarm.run.engine import Run

from .. import figure, reference
from ..report import tier
from . import picture
from .picture import Cell

RADIUS, SPEED, CROSSINGS = 0.5, 0.5, 5
SCENE = swarm.Scene([swarm.Sphere(RADIUS)])
DEFAULT = 1e-4
_ANGLES = tuple(10.0**k for k in range(-12, 1))
_SHORTEST = (1e-5, DEFAULT, 1e-3, 1e-2, 1e-1)
_PARTICLES = 8


def launch(angle: float, count: int) -> swarm.Particles:
    """From one point of the wall, at this angle to it, in directions all around."""
    around = 2.0 * math.pi * (np.arange(count) + 0.3) / count
    position = np.tile([[RADIUS], [0.0], [0.0]], count)
    along = math.cos(angle) * np.array([np.cos(around), np.sin(around)])
    return swarm.Particles(position, SPEED * np.vstack([np.full(count, -math.sin(angle)), along]))


def cell(angle: float, shortest: float, count: int) -> Cell:
    """Wall time and errors of one angle and one shortest flight, a part of the crossing time."""
    particles, crossing = launch(angle, count), RADIUS / SPEED
    method, until = swarm.Impact(shortest_flight=shortest * crossing), CROSSINGS * crossing
    with Run(SCENE.compiled(), particles.copy(), method, 1, None, tier()) as run:
        run.advance(0.0, 0.0)
        before = time.perf_counter()
        run.advance(until, until)
        seconds = time.perf_counter() - before
    result = swarm.simulate(SCENE, particles, method, until=until, threads=1, compile=tier())
    ends = [
        reference.in_a_sphere(r, v, RADIUS, until, None)
        for r, v in zip(particles.position.T, particles.velocity.T, strict=True)
    ]
    return {
        "angle": angle,
        "shortest_flight": shortest,
        "seconds": seconds / count / CROSSINGS,
        "distance": float(np.linalg.norm(result.particles.position.T - ends, axis=1).max()) / RADIUS,
        "energy_error": float(result.observables["energy_error"].max()),
        "penetration": float(result.observables["max_penetration"].max()) / RADIUS,
    }


def measure(quick: bool) -> list[Cell]:
    """Every angle and shortest flight; quick: two of each."""
    angles, shortest = (_ANGLES[::9], _SHORTEST[2:4]) if quick else (_ANGLES, _SHORTEST)
    if not quick:
        cell(1e-12, 1e-2, 1)  # compiles what slides
    return [cell(angle, one, 1 if quick else _PARTICLES) for one in shortest for angle in angles]


def told(cells: Sequence[Cell]) -> list[str]:
    """The worst of all."""
    worst = {key: max(c[key] for c in cells) for key in ("energy_error", "penetration", "seconds")}
    sentences = [
        f"Impact, angles down to {min(c['angle'] for c in cells):g} rad: energy within {worst['energy_error']:.1e}, "
        f"outside by at most {worst['penetration']:.1e} of the radius"
    ]
    for shortest in sorted({c["shortest_flight"] for c in cells}):
        mine = [c for c in cells if c["shortest_flight"] == shortest]
        sentences.append(
            f"shortest flight {shortest:g} of a crossing: at most {1e6 * max(c['seconds'] for c in mine):.3g} us a "
            f"crossing, {max(c['distance'] for c in mine):.1e} R off after {CROSSINGS}"
        )
    return sentences


def draw(cells: Sequence[Cell]) -> None:
    """Cost and distance, two heat maps."""
    drawn, panels = figure.subplots(2, 11.0, 4.2)
    for axes, (value, title, low, high) in zip(
        panels,
        (("seconds", "wall time a crossing [s]", -6.0, -1.0), ("distance", "distance/R", -16.0, 0.0)),
        strict=True,
    ):
        columns, rows, values = picture.table(cells, "angle", "shortest_flight", value)
        names = [f"{r:.0e}" + (" (default)" if r == DEFAULT else "") for r in rows]
        image = picture.heat(axes, [f"{c:.0e}" for c in columns], names, values, low, high)
        axes.tick_params(axis="x", rotation=60)
        axes.set(title=f"{title}, {CROSSINGS} crossings", xlabel="angle to the wall [rad]")
        drawn.colorbar(image, ax=axes, label=f"log₁₀ of the {value}")
    panels[0].set_ylabel("shortest_flight / crossing time")
    drawn.suptitle("Impact in a sphere: from grazing to steep the cost has a bound, set by the shortest flight")
    picture.save(drawn, cells, "grazing")

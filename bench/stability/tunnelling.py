"""Escapes through a thin solid over speed dt/thickness: steps can jump over it, flights to the impact cannot."""

import math
from collections.abc import Sequence

import numba
import numpy as np
from numpy.typing import NDArray

import swarm

from .. import figure
from . import picture
from .picture import Cell

THICKNESS, SPEED, IMPACTS = 0.01, 1.0, 100
# A box cut in two by a thin solid box.
SCENE = swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), swarm.Box((0.5 * THICKNESS, 2.0, 2.0), side="outside")])
# dt sqrt(alpha/m): what is stable, and does not sink through the solid before it turns.
_EXPLICIT, _IMPLICIT = 1.0, 3.0
METHODS = {
    "Penalty": (swarm.Penalty, _IMPLICIT),
    "Verlet": (swarm.Verlet, _EXPLICIT),
    "Midpoint": (swarm.Midpoint, _IMPLICIT),
    "Trapezoidal": (swarm.Trapezoidal, _IMPLICIT),
}
PLAIN = "plain Verlet"
_RATIOS = tuple(2.0 ** (k / 2.0) for k in range(-6, 9))


@numba.njit(error_model="numpy")
def _spring(r, k, alpha):
    """Force along one axis in the box; along x of the thin wall too."""
    force = 0.0
    if abs(r) > 1.0:
        force -= alpha * (abs(r) - 1.0) * np.sign(r)
    if k == 0 and abs(r) < 0.5 * THICKNESS:
        force += alpha * (0.5 * THICKNESS - abs(r)) * np.sign(r)
    return force


@numba.njit(error_model="numpy")
def _plain_verlet(position, velocity, alpha, dt, steps):
    """What a user would write in an afternoon, without a check of the step."""
    for k in range(3):  # the axes do not know of one another
        for i in range(position.shape[1]):
            r, v = position[k, i], velocity[k, i]
            a = _spring(r, k, alpha)
            for _ in range(steps):
                v += 0.5 * dt * a
                r += dt * v
                a = _spring(r, k, alpha)
                v += 0.5 * dt * a
            position[k, i], velocity[k, i] = r, v


def start(count: int) -> swarm.Particles:
    """Anywhere but in the walls."""
    random = np.random.default_rng(4)
    position = random.uniform(-0.9, 0.9, (3, count))
    position[0] = random.choice([-1.0, 1.0], count) * random.uniform(0.1, 0.9, count)
    velocity = random.standard_normal((3, count))
    return swarm.Particles(position, velocity * (SPEED / np.linalg.norm(velocity, axis=0)))


def escaped(particles: swarm.Particles, end: NDArray) -> float:
    """Part of the particles on the other side, or nowhere."""
    stayed = np.sign(end[0]) == np.sign(particles.position[0])
    return float(1.0 - (stayed & (abs(end) < 1.1).all(axis=0)).mean())


def measure(quick: bool) -> list[Cell]:
    """Every method at every ratio; infinite where it refuses, or ends with an error; quick: one that is refused."""
    particles, found = start(20 if quick else 200), []
    # Mean chord 4 V/S of a half of the box, twice the impacts of which a half would do.
    until = IMPACTS * 4.0 / (2.0 * (1.0 + 2.0 + 2.0)) * 2.0 / SPEED
    methods = {"Penalty": METHODS["Penalty"]} if quick else {"Impact": None, **METHODS}
    for ratio in _RATIOS[-4:-3] if quick else _RATIOS:
        dt = ratio * THICKNESS / SPEED
        steps = round(until / dt)
        for name, description in methods.items():
            method = description[0](dt, (description[1] / dt) ** 2) if description else swarm.Impact()
            part, outcome = math.inf, "done"
            try:
                end = swarm.simulate(SCENE, particles, method, until=steps * dt).particles.position
                part = escaped(particles, end)
            except swarm.SceneError:
                outcome = "refused"
            except swarm.RunError:
                outcome = "ended"
            found.append({"method": name, "ratio": ratio, "escaped": part, "outcome": outcome})
        position, velocity = particles.position.copy(), particles.velocity.copy()
        _plain_verlet(position, velocity, (_EXPLICIT / dt) ** 2, dt, steps)
        found.append({"method": PLAIN, "ratio": ratio, "escaped": escaped(particles, position), "outcome": "done"})
    return found


def told(cells: Sequence[Cell]) -> list[str]:
    """One sentence a method."""
    sentences = []
    for method in dict.fromkeys(cell["method"] for cell in cells):
        mine = [cell for cell in cells if cell["method"] == method]
        worst = max((c["escaped"] for c in mine if c["outcome"] == "done"), default=0.0)
        sentence = f"{method}: {100.0 * worst:.3g} % of the particles pass the wall at most"
        for outcome, what in (("ended", "the run ends with an error"), ("refused", "refused")):
            ratios = [c["ratio"] for c in mine if c["outcome"] == outcome]
            sentence += f"; {what} from {min(ratios):.2g} thicknesses a step" if ratios else ""
        sentences.append(sentence)
    return sentences


def draw(cells: Sequence[Cell]) -> None:
    """Escapes over the ratio, one row a method."""
    drawn, axes = figure.subplots(1, 11.0, 3.6)
    methods, ratios = (list(dict.fromkeys(cell[key] for cell in cells)) for key in ("method", "ratio"))
    ranked = [{**cell, "rank": methods.index(cell["method"])} for cell in cells]
    _columns, _rows, values = picture.table(ranked, "ratio", "rank", "escaped")
    image = picture.heat(axes, [f"{ratio:.2g}" for ratio in ratios], methods, values, -2.0, 0.0)
    picture.words(axes, image, values, lambda part: f"{100.0 * part:.0f} %")
    for cell in ranked:
        if cell["outcome"] == "refused":
            axes.text(ratios.index(cell["ratio"]), cell["rank"], "\n\nrefused", ha="center", va="center", fontsize=7)
    axes.set_xticks(range(len(ratios)), [f"{ratio:.2g}" for ratio in ratios])
    axes.set_xlabel("speed · dt / thickness of the solid")
    axes.set_title(f"Particles that have passed a thin solid after {IMPACTS} impacts; x: the run ended with an error")
    picture.save(drawn, cells, "tunnelling")

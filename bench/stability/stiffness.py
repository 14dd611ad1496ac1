"""Energy error after 1000 impacts over the stiffness of the wall, Omega = dt sqrt(alpha/m), and its exponent.

With an exponent other than 1 there is no sqrt(alpha/m); its wall is the one that stops a particle at the same depth,
|v| dt/Omega: alpha = (a + 1) m v^2/(2 depth^(a + 1)).
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import swarm

from .. import figure
from . import picture
from .picture import Cell

SCENE = swarm.Scene([swarm.Sphere(0.5)])
METHODS = (swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal)
SPEED, DT, IMPACTS = 0.5, 2.0**-8, 1000
# Mean chord of a sphere over the speed.
_CROSSING = 4.0 / 3.0 * 0.5 / SPEED
_STIFFNESS = tuple(10.0 ** (k / 4.0) for k in range(-8, 9, 2))
_EXPONENTS = (1.0, 1.5, 2.0, 3.0, 4.0)
_FRAMES = 100
ROUND_OFF = 1e-12
# A particle with so many times its energy has a contact every step from now on: nothing more is learnt from it.
_GONE = 10.0


class _GoneError(Exception):
    pass


def error(method: type, exponent: float, stiffness: float, particles: swarm.Particles, impacts: int = IMPACTS) -> float:
    """Worst relative energy error of a particle, up to where it is gone; infinite where the run ends with an error."""
    depth = SPEED * DT / stiffness
    penalty = (exponent + 1.0) * SPEED**2 / (2.0 * depth ** (exponent + 1.0))
    # A contact with a soft wall takes up to half a swing.
    each = _CROSSING + math.pi * DT / stiffness
    every = math.ceil(impacts * each / _FRAMES)
    worst = 0.0

    def look(frame: swarm.Frame) -> None:
        nonlocal worst
        worst = max(worst, float(frame.observables["energy_error"]))
        if worst > _GONE:
            raise _GoneError

    try:
        swarm.simulate(
            SCENE, particles, method(DT, penalty, exponent), until=_FRAMES * every, every=every, progress=look
        )
    except _GoneError:
        pass
    except swarm.RunError:
        worst = math.inf
    return worst


def measure(quick: bool) -> list[Cell]:
    """Every method, exponent and stiffness; quick: Penalty, linear springs, three of them."""
    particles = swarm.fill(SCENE, 1 if quick else 8, speed=SPEED, seed=7)
    impacts = 20 if quick else IMPACTS
    cases = [
        (method, exponent, stiffness)
        for method in (METHODS[:1] if quick else METHODS)
        for exponent in (_EXPONENTS[:1] if quick else _EXPONENTS)
        for stiffness in (_STIFFNESS[2::3] if quick else _STIFFNESS)
    ]
    # So few particles are work for one thread: two cases at once.
    with ThreadPoolExecutor(2) as pool:
        errors = list(pool.map(lambda case: error(*case, particles, impacts), cases))
    return [
        {"method": method.__name__, "exponent": exponent, "stiffness": stiffness, "energy_error": one}
        for (method, exponent, stiffness), one in zip(cases, errors, strict=True)
    ]


def told(cells: Sequence[Cell]) -> list[str]:
    """One sentence a method."""
    sentences = []
    for method in dict.fromkeys(cell["method"] for cell in cells):
        mine = [cell for cell in cells if cell["method"] == method]
        kept = [cell for cell in mine if cell["energy_error"] <= ROUND_OFF]
        ended = [cell for cell in mine if math.isinf(cell["energy_error"])]
        finite = [cell["energy_error"] for cell in mine if math.isfinite(cell["energy_error"])]
        sentence = (
            f"{method}: energy within {ROUND_OFF:g} in {len(kept)} of {len(mine)} cells, {min(finite):.1e} to "
            f"{max(finite):.1e} where the run ends well"
        )
        if ended:
            sentence += f"; {len(ended)} end with an error, from Omega = {min(c['stiffness'] for c in ended):.2g}"
        sentences.append(sentence)
    return sentences


def draw(cells: Sequence[Cell]) -> None:
    """One heat map a method."""
    drawn, panels = figure.subplots(len(METHODS), 11.0, 3.8)
    for axes, method in zip(panels, METHODS, strict=True):
        mine = [cell for cell in cells if cell["method"] == method.__name__]
        columns, rows, values = picture.table(mine, "stiffness", "exponent", "energy_error")
        image = picture.heat(axes, [f"{c:.2g}" for c in columns], [f"{r:g}" for r in rows], values, -16.0, 1.0)
        axes.set(title=method.__name__, xlabel=picture.OMEGA)
        axes.tick_params(axis="x", rotation=60)
    panels[0].set_ylabel("exponent a")
    drawn.colorbar(image, ax=panels, label="log₁₀ of the energy error")
    drawn.suptitle(
        f"Worst energy error after {IMPACTS} impacts: Penalty keeps it at any stiffness (x: ended with an error)"
    )
    picture.save(drawn, cells, "stiffness")

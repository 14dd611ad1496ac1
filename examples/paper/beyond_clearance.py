"""Beyond the paper: clearance of a joint, in the small: a pin loose in an elliptical hole, under gravity.

The point that moves is the pin's centre; the ellipse is the hole less the pin. With gravity the steps are fixed, so
contacts are in State II: rigid walls by Uzawa's loop lose energy, stiff ones by the penalty method do not.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from ..page import page
from .cases import Floats
from .table import Row

FILE = "beyond_5_clearance.png"
MASS, GRAVITY = 0.05, 9.81
WIDTH, HEIGHT = 1.0e-3, 0.6e-3
# The third semi-axis has no part: the pin stays in the plane z = 0.
HOLE = swarm.Scene(surfaces=[swarm.Ellipsoid((WIDTH, HEIGHT, 1.0))], gravity=(0.0, -GRAVITY, 0.0))
START, VELOCITY = (0.5e-3, 0.3e-3, 0.0), (0.05, 0.0, 0.0)
UNTIL, EVERY = 0.3, 2e-4
# Energy is counted from the pin at rest at the bottom of the hole.
_LOWEST = MASS * GRAVITY * HEIGHT
# The paper's tolerance is for 0.1 J; here the energies are near 1e-4 J.
HERTZ = swarm.Penalty(dt=1e-6, penalty=1e3, exponent=1.5)
UZAWA = swarm.AugmentedLagrangian(dt=1e-5, penalty=100.0, tolerance=1e-13, on_unconverged="count")


class Motion(NamedTuple):
    """One run: the pin's path (3, frames) and what was observed."""

    path: Floats
    result: swarm.Result


class Numbers(NamedTuple):
    """The pin in a stiff hole and in a rigid one."""

    hertz: Motion
    uzawa: Motion


def numbers() -> Numbers:
    """The same start with both methods."""
    return Numbers(_run(HERTZ), _run(UZAWA))


def _run(method: swarm.Penalty | swarm.AugmentedLagrangian) -> Motion:
    pin = swarm.Particles(np.array(START)[:, None], np.array(VELOCITY)[:, None], MASS)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "pin.h5"
        result = swarm.simulate(HOLE, pin, method, until=UNTIL, every=EVERY, trajectory=file)
        with swarm.load(file) as trajectory:
            path = np.array([trajectory.frame(k).position[:, 0] for k in range(len(trajectory.times))])
    return Motion(path.T, result)


def energy(motion: Motion) -> Floats:
    """Total energy [J] over that of the pin at rest at the bottom."""
    return np.asarray(motion.result.observables["total_energy"] + _LOWEST)


def energy_left(motion: Motion) -> float:
    """The part of the energy that the pin has at the end."""
    values = energy(motion)
    return float(values[-1] / values[0])


def draw(numbers: Numbers, folder: Path) -> Path:
    """Both paths in the hole, from the dot, and the energies over time."""
    from swarm.pictures.style import BLUE, CAVITY_LINE, RED, ink

    file = folder / FILE
    title = "Beyond the paper 5: a pin loose in a hole keeps its energy by Penalty, not by fixed steps of Uzawa"
    with page(file, title, 1, 3, (11.0, 3.6)) as (stiff, rigid, axes):
        for hole, motion, colour, label in (
            (stiff, numbers.hertz, BLUE, "Penalty, a = 1.5: stiff walls"),
            (rigid, numbers.uzawa, RED, "Uzawa, fixed steps: State II"),
        ):
            angle = np.linspace(0.0, 2.0 * np.pi, 361)
            hole.plot(1e3 * WIDTH * np.cos(angle), 1e3 * HEIGHT * np.sin(angle), color=CAVITY_LINE)
            x, y, _z = 1e3 * motion.path
            hole.plot(x, y, color=colour, linewidth=0.5)
            hole.plot(x[0], y[0], color=ink(), marker="o")
            hole.set(title=label, xlabel="x of the pin's centre [mm], from the dot", ylabel="y [mm]", aspect="equal")
            axes.plot(motion.result.observables["time"], 1e6 * energy(motion), color=colour, label=label)
        axes.set(title="energy above that at rest", xlabel="time [s]", ylabel="energy [µJ]", ylim=(0.0, None))
        axes.legend(loc="lower left")
    return file


def rows(numbers: Numbers) -> list[Row]:
    """Impacts, depth and energy."""
    hertz, uzawa = numbers.hertz.result.observables, numbers.uzawa.result
    loops = uzawa.multipliers
    assert loops is not None
    return [
        Row("Pin, Penalty a = 1.5: impacts", "-", f"{hertz['impacts'][-1]} in {UNTIL:g} s"),
        Row("Pin, Penalty a = 1.5: deepest at a frame (µm)", "-", f"{1e6 * hertz['max_penetration'].max():.1f}"),
        Row("Pin, Penalty a = 1.5: worst relative energy error", "-", f"{hertz['energy_error'].max():.1e}"),
        Row(
            "Pin, Uzawa with fixed steps: unconverged contacts",
            "-",
            f"{loops.unconverged.sum()} of {loops.contacts.sum()}",
        ),
        Row("Pin, Uzawa with fixed steps: energy left", "-", f"{100.0 * energy_left(numbers.uzawa):.0f} %"),
    ]

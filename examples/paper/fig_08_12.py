"""Figs. 8 to 12: Uzawa's loop in State I, on the sphere at t0: a = 1 converges, a = 1.5 does not."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from ..page import page
from .cases import DT, PENALTY, SPHERE, SPHERE_ENERGY, Approach, history, state_i
from .plotting import CONSTRAINT_BAR, SWEEP, curve
from .table import Row, convergence

FILE = "fig_08_12_state_i.png"


class Numbers(NamedTuple):
    """The contact step of State I with both exponents."""

    start: Approach
    linear: swarm.ContactHistory
    hertz: swarm.ContactHistory


def numbers() -> Numbers:
    """Two histories of one step."""
    start = state_i()
    linear, hertz = (history(SPHERE, start, swarm.AugmentedLagrangian(DT, PENALTY, exponent=a)) for a in (1.0, 1.5))
    return Numbers(start, linear, hertz)


def draw(numbers: Numbers, folder: Path) -> Path:
    """Six panels over the sweeps."""
    from swarm.pictures.style import BLUE, GREY, RED

    file = folder / FILE
    title = "Figs. 8 to 12: a step from the surface of a sphere (State I): a = 1 converges, a = 1.5 does not"
    with page(file, title, 2, 3, (11.0, 6.2)) as (multiplier, part, spring, energy, constraint, place):
        constraint.set_yscale("log")
        for loop, colour, label in ((numbers.linear, BLUE, "a = 1"), (numbers.hertz, RED, "a = 1.5")):
            line = {"color": colour, "label": label}
            curve(multiplier, loop, loop.multiplier, **line)
            curve(part, loop, loop.force_multiplier, **line)
            curve(spring, loop, loop.force_penalty, **line)
            curve(energy, loop, loop.kinetic_energy, **line)
            curve(constraint, loop, loop.constraint, **line)
            curve(place, loop, 1e3 * (np.linalg.norm(loop.position, axis=1) - 0.5), **line)
        energy.axhline(SPHERE_ENERGY, color=GREY, linestyle="--", label="before the contact")
        constraint.axhline(CONSTRAINT_BAR, color=GREY, linestyle="--", label="tolerance")
        multiplier.set(ylabel="multiplier λ [N, J/m$^{1.25}$]")
        part.set(ylabel="force of the multiplier [N]")
        spring.set(ylabel="force of the penalty [N]")
        energy.set(ylabel="kinetic energy after the step [J]", ylim=(0.0, 0.135))
        constraint.set(ylabel="constraint Φ$_1$ [m, m$^{1.25}$]")
        place.set(ylabel="distance outside, |r$_1$| - R [mm]")
        for axes in (multiplier, part, spring, energy, constraint, place):
            axes.legend()
            axes.set(xlabel=SWEEP, xlim=(0, 51))
    return file


def rows(numbers: Numbers) -> list[Row]:
    """Sweeps, energy and what did not converge."""
    x, y, _z = numbers.start.position
    return [
        Row("State I: step before the contact", "20, at (0.4, 0.3)", f"{numbers.start.steps}, at ({x:.6g}, {y:.6g})"),
        Row("State I, a = 1: converges", "yes, 13 sweeps", convergence(numbers.linear)),
        Row("State I, a = 1: kinetic energy (J)", "0.125", f"{numbers.linear.kinetic_energy[-1]:.6f}"),
        Row("State I, a = 1.5: converges", "no", convergence(numbers.hertz)),
        Row("State I, a = 1.5: kinetic energy (J)", "-", f"{numbers.hertz.kinetic_energy[-1]:.5f}"),
    ]

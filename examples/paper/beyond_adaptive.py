"""Beyond the paper: the start of State II, but each step is cut at the impact: it becomes State I and converges."""

from pathlib import Path
from typing import NamedTuple

import swarm

from ..page import page
from .cases import DT, PENALTY, ROUND_OFF, SPHERE, SPHERE_ENERGY, history, state_ii
from .plotting import CONSTRAINT_BAR, SWEEP, curve
from .table import Row, convergence

FILE = "beyond_3_adaptive.png"


class Numbers(NamedTuple):
    """One start with fixed steps, with adaptive ones, and with a tolerance at round-off."""

    fixed: swarm.ContactHistory
    paper: swarm.ContactHistory
    exact: swarm.ContactHistory


def numbers() -> Numbers:
    """Three histories from one start."""
    start = state_ii()
    methods = (
        swarm.AugmentedLagrangian(DT, PENALTY),
        swarm.AugmentedLagrangian(DT, PENALTY, adaptive=True),
        swarm.AugmentedLagrangian(DT, PENALTY, adaptive=True, tolerance=ROUND_OFF),
    )
    return Numbers(*(history(SPHERE, start, method) for method in methods))


def energy_error(loop: swarm.ContactHistory) -> float:
    """The relative energy error of the last sweep."""
    return abs(float(loop.kinetic_energy[-1]) / SPHERE_ENERGY - 1.0)


def draw(numbers: Numbers, folder: Path) -> Path:
    """Constraint and energy over the sweeps."""
    from swarm.pictures.style import BLUE, GREY, RED

    file = folder / FILE
    title = "Beyond the paper 3: steps that are cut at the impact converge"
    with page(file, title, 1, 2, (9.0, 3.9)) as (constraint, energy):
        constraint.set_yscale("log")
        for loop, colour, label in ((numbers.fixed, RED, "fixed steps"), (numbers.exact, BLUE, "cut at the impact")):
            curve(constraint, loop, loop.constraint, color=colour, label=label)
            curve(energy, loop, loop.kinetic_energy, color=colour, label=label)
        constraint.axhline(CONSTRAINT_BAR, color=GREY, linestyle="--", label="the paper's tolerance")
        energy.axhline(SPHERE_ENERGY, color=GREY, linestyle="--", label="before the contact")
        constraint.set(title="how far outside the step ends", ylabel="constraint Φ$_1$ [m]")
        energy.set(title="energy after the step", ylabel="kinetic energy [J]", ylim=(0.0, 0.135))
        for axes in (constraint, energy):
            axes.set(xlabel=SWEEP, xlim=(0, 51))
            axes.legend(loc="center right")
    return file


def rows(numbers: Numbers) -> list[Row]:
    """Sweeps and energy at both tolerances."""
    name = "State II, adaptive, a = 1"
    return [
        Row(f"{name}: converges", "no (fixed step)", convergence(numbers.paper)),
        Row(f"{name}: kinetic energy (J)", "-", f"{numbers.paper.kinetic_energy[-1]:.6f}"),
        Row(f"{name}: converges to V ≤ 1e-28 J", "-", convergence(numbers.exact)),
        Row(f"{name}: relative energy error then", "-", f"{energy_error(numbers.exact):.1e}"),
    ]

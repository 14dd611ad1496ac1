"""Beyond the paper: its ellipsoid with a = 1, which the composite gradient allows, converges in 4 sweeps."""

from pathlib import Path
from typing import NamedTuple

import swarm

from ..page import page
from .cases import DT, ELLIPSOID, ELLIPSOID_ENERGY, PENALTY, ROUND_OFF, history, on_the_ellipsoid
from .plotting import CONSTRAINT_BAR, SWEEP, curve
from .table import Row, convergence

FILE = "beyond_1_ellipsoid_composite.png"


class Numbers(NamedTuple):
    """The same contact step with the paper's tolerance, with one at round-off, and with a = 4."""

    paper: swarm.ContactHistory
    exact: swarm.ContactHistory
    smooth: swarm.ContactHistory


def numbers() -> Numbers:
    """Three histories of one step."""
    start = on_the_ellipsoid()
    methods = (
        swarm.AugmentedLagrangian(DT, PENALTY),
        swarm.AugmentedLagrangian(DT, PENALTY, tolerance=ROUND_OFF),
        swarm.AugmentedLagrangian(DT, 1e7, exponent=4.0),
    )
    return Numbers(*(history(ELLIPSOID, start, method) for method in methods))


def energy_error(loop: swarm.ContactHistory) -> float:
    """The relative energy error of the last sweep."""
    return abs(float(loop.kinetic_energy[-1]) / ELLIPSOID_ENERGY - 1.0)


def draw(numbers: Numbers, folder: Path) -> Path:
    """Constraint and energy over the sweeps."""
    from swarm.pictures.style import BLUE, GREY, RED

    file = folder / FILE
    title = "Beyond the paper 1: the composite gradient converges on its ellipsoid"
    with page(file, title, 1, 2, (9.0, 3.9)) as (constraint, energy):
        constraint.set_yscale("log")
        energy.set_yscale("log")
        for loop, colour, label in (
            (numbers.exact, BLUE, r"a = 1, $\alpha$ = 10$^4$ J"),
            (numbers.smooth, RED, r"a = 4, $\alpha$ = 10$^7$ J"),
        ):
            curve(constraint, loop, loop.constraint, color=colour, label=label)
            curve(energy, loop, abs(loop.kinetic_energy / ELLIPSOID_ENERGY - 1.0), color=colour, label=label)
        constraint.axhline(CONSTRAINT_BAR, color=GREY, linestyle="--", label="the paper's tolerance, a = 1")
        constraint.set(title="how far outside the step ends", ylabel="constraint Φ$_1$ [1]")
        energy.set(title="energy after the step", ylabel="relative error")
        constraint.legend(loc="center right")
        for axes in (constraint, energy):
            axes.set(xlabel=SWEEP, xlim=(0, 51))
    return file


def rows(numbers: Numbers) -> list[Row]:
    """Sweeps and energy at both tolerances."""
    name = "Ellipsoid, a = 1, composite"
    return [
        Row(f"{name}: converges", "needs a > 1", convergence(numbers.paper)),
        Row(f"{name}: kinetic energy (J), of 0.24", "-", f"{numbers.paper.kinetic_energy[-1]:.10f}"),
        Row(f"{name}: converges to V ≤ 1e-28 J", "-", convergence(numbers.exact)),
        Row(f"{name}: relative energy error then", "-", f"{energy_error(numbers.exact):.1e}"),
        Row("Ellipsoid, a = 4, composite: converges", "-", convergence(numbers.smooth)),
    ]

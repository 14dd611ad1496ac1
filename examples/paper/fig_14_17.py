"""Figs. 14 to 17: Uzawa's loop in State II, inside the sphere at t0: it does not converge for any exponent."""

from pathlib import Path
from typing import NamedTuple

import swarm

from ..page import page
from .cases import DT, PENALTY, SPHERE, SPHERE_ENERGY, Approach, history, state_ii
from .plotting import CONSTRAINT_BAR, SWEEP, curve
from .table import Row, convergence

FILE = "fig_14_17_state_ii.png"


class Numbers(NamedTuple):
    """The contact step of State II with both exponents."""

    start: Approach
    linear: swarm.ContactHistory
    hertz: swarm.ContactHistory


def numbers() -> Numbers:
    """Two histories of one step."""
    start = state_ii()
    linear, hertz = (history(SPHERE, start, swarm.AugmentedLagrangian(DT, PENALTY, exponent=a)) for a in (1.0, 1.5))
    return Numbers(start, linear, hertz)


def draw(numbers: Numbers, folder: Path) -> Path:
    """Four panels over the sweeps."""
    from swarm.pictures.style import BLUE, GREY, RED

    file = folder / FILE
    title = "Figs. 14 to 17: a step from inside the sphere (State II) does not converge"
    with page(file, title, 2, 2, (9.0, 6.4)) as (multiplier, force, energy, constraint):
        constraint.set_yscale("log")
        for loop, colour, label in ((numbers.linear, BLUE, "a = 1"), (numbers.hertz, RED, "a = 1.5")):
            line = {"color": colour, "label": label}
            curve(multiplier, loop, loop.multiplier, **line)
            curve(force, loop, loop.force_multiplier, color=colour, label=f"multiplier, {label}")
            curve(force, loop, loop.force_penalty, color=colour, ls=":", marker="", label=f"penalty, {label}")
            curve(energy, loop, loop.kinetic_energy, **line)
            curve(constraint, loop, loop.constraint, **line)
        energy.axhline(SPHERE_ENERGY, color=GREY, linestyle="--", label="before the contact")
        constraint.axhline(CONSTRAINT_BAR, color=GREY, linestyle="--", label="tolerance")
        multiplier.set(ylabel="multiplier λ [N, J/m$^{1.25}$]")
        force.set(ylabel="force [N]")
        energy.set(ylabel="kinetic energy after the step [J]", ylim=(0.0, 0.135))
        constraint.set(ylabel="constraint Φ$_1$ [m, m$^{1.25}$]")
        for axes in (multiplier, force, energy, constraint):
            axes.set(xlabel=SWEEP, xlim=(0, 51))
        for axes in (multiplier, energy, constraint):
            axes.legend()
        # Between the two multipliers above and the two penalties below.
        force.legend(loc="lower right", bbox_to_anchor=(1.0, 0.12))
    return file


def rows(numbers: Numbers) -> list[Row]:
    """What did not converge."""
    loops = (("a = 1", numbers.linear), ("a = 1.5", numbers.hertz))
    return [
        Row("State II: steps before the contact", "-", str(numbers.start.steps)),
        *[Row(f"State II, {name}: converges", "no", convergence(loop)) for name, loop in loops],
        Row("State II, a = 1: kinetic energy (J)", "-", f"{numbers.linear.kinetic_energy[-1]:.5f}"),
    ]

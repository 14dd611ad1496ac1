"""Figs. 19 to 22: the ellipsoid with a = 4 and the mean-value gradient, eq. (6): State I, and it does not converge."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from ..page import page
from .cases import (
    DT,
    ELLIPSOID,
    ELLIPSOID_ENERGY,
    PAPER_ENERGIES,
    PAPER_MULTIPLIERS,
    PAPER_SWEEPS,
    TOLERANCE,
    Approach,
    Floats,
    history,
    on_the_ellipsoid,
)
from .plotting import SWEEP, curve
from .table import Row, convergence

FILE = "fig_19_22_ellipsoid.png"
PENALTY = 1e7


class Numbers(NamedTuple):
    """The contact step; its multipliers and energies in the paper's sweeps."""

    start: Approach
    loop: swarm.ContactHistory
    multipliers: Floats
    energies: Floats


def numbers() -> Numbers:
    """One history."""
    start = on_the_ellipsoid()
    loop = history(ELLIPSOID, start, swarm.AugmentedLagrangian(DT, PENALTY, exponent=4.0, gradient="mean-value"))
    return Numbers(start, loop, loop.multiplier[PAPER_SWEEPS - 1], loop.kinetic_energy[PAPER_SWEEPS - 1])


def draw(numbers: Numbers, folder: Path) -> Path:
    """Four panels over the sweeps, with the paper's numbers on them."""
    from swarm.pictures.style import BLUE, GREY, RED

    file = folder / FILE
    title = "Figs. 19 to 22: with the mean-value gradient, on an ellipsoid, the loop does not converge"
    paper = {"color": RED, "marker": "s", "fillstyle": "none", "markersize": 6.0, "linestyle": "none"}
    loop = numbers.loop
    with page(file, title, 2, 2, (9.0, 6.4)) as (multiplier, force, energy, constraint):
        constraint.set_yscale("log")
        curve(multiplier, loop, loop.multiplier, color=BLUE, label="swarm")
        multiplier.plot(PAPER_SWEEPS, PAPER_MULTIPLIERS, **paper, label="printed in the paper")
        curve(force, loop, loop.force_multiplier, color=BLUE, label="multiplier")
        curve(force, loop, loop.force_penalty, color=BLUE, ls=":", marker="", label="penalty")
        curve(energy, loop, loop.kinetic_energy, color=BLUE, label="swarm")
        energy.plot(PAPER_SWEEPS, PAPER_ENERGIES, **paper, label="printed in the paper")
        energy.axhline(ELLIPSOID_ENERGY, color=GREY, linestyle="--", label="before the contact")
        curve(constraint, loop, loop.constraint, color=BLUE, label="swarm")
        bar = np.sqrt(2.0 * TOLERANCE / PENALTY)
        constraint.axhline(bar, color=GREY, linestyle="--", label="tolerance")
        multiplier.set(ylabel="multiplier λ [J]")
        force.set(ylabel="force [N]")
        energy.set(ylabel="kinetic energy after the step [J]", ylim=(0.0, 0.26))
        constraint.set(ylabel="constraint Φ$_1$ [1]")
        for axes in (multiplier, force, energy, constraint):
            axes.set(xlabel=SWEEP, xlim=(0, 51))
            axes.legend()
    return file


def rows(numbers: Numbers) -> list[Row]:
    """The paper's sweeps, one row each."""
    name = "Ellipsoid, a = 4, mean value"
    pairs = zip(PAPER_SWEEPS, PAPER_MULTIPLIERS, PAPER_ENERGIES, numbers.multipliers, numbers.energies, strict=True)
    return [
        Row(f"{name}: converges", "no", convergence(numbers.loop)),
        *[
            Row(f"{name}: sweep {sweep}, λ (J) and E (J)", f"{told:.1f}, {joule:.5f}", f"{got:.1f}, {energy:.5f}")
            for sweep, told, joule, got, energy in pairs
        ],
    ]

"""Beyond the paper: 10 000 particles, each with its own Uzawa loop at each of 1000 impacts and more."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from ..page import page
from .cases import DT, PENALTY, ROUND_OFF, SPHERE, TOLERANCE, Floats
from .table import Row

FILE = "beyond_4_swarm.png"
PARTICLES, SPEED = 10_000, 0.5
# A flight through the centre takes 2 s, the longest, and its contact step DT: 1000 impacts of every particle.
UNTIL, EVERY = 2030.0, 29.0
# The loops that take many sweeps run with fewer particles, or for less time.
FEWER, SHORT = 1_000, 30.0
ACCELERATIONS = ("none", "secant", "reflection")


class Numbers(NamedTuple):
    """The long run; the paper's tolerance in its place; and short runs with each acceleration at both tolerances."""

    long: swarm.Result
    paper: swarm.Result
    short: dict[tuple[str, float], swarm.Result]


def numbers() -> Numbers:
    """Runs in a sphere, from uniform places in random directions."""
    short = {(name, V): _run(FEWER, name, V, SHORT) for V in (TOLERANCE, ROUND_OFF) for name in ACCELERATIONS}
    return Numbers(_run(PARTICLES, "reflection", ROUND_OFF, UNTIL), _run(FEWER, "none", TOLERANCE, UNTIL), short)


def _run(count: int, acceleration: str, tolerance: float, until: float) -> swarm.Result:
    method = swarm.AugmentedLagrangian(DT, PENALTY, tolerance=tolerance, adaptive=True, acceleration=acceleration)
    particles = swarm.fill(SPHERE, count, speed=SPEED, mass=1.0, seed=1)
    return swarm.simulate(SPHERE, particles, method, until=until, every=min(EVERY, until))


def sweeps_a_contact(result: swarm.Result) -> Floats:
    """The mean of each particle that had a contact."""
    loops = result.multipliers
    assert loops is not None
    met = loops.contacts > 0
    return np.asarray(loops.sweeps[met] / loops.contacts[met])


def mean_sweeps(result: swarm.Result) -> float:
    """The mean over all contacts."""
    loops = result.multipliers
    assert loops is not None
    return float(loops.sweeps.sum() / loops.contacts.sum())


def draw(numbers: Numbers, folder: Path) -> Path:
    """The energy error of the worst particle over time, and how many sweeps the loops take."""
    from swarm.pictures.style import BLUE, GREEN, RED

    file = folder / FILE
    title = "Beyond the paper 4: 10 000 particles keep their energy to the last digit over 1000 impacts"
    with page(file, title, 1, 2, (9.0, 3.9)) as (energy, histogram):
        energy.set_yscale("log")
        for result, colour, label in (
            (numbers.paper, RED, "the paper's tolerance, V ≤ 10$^{-10}$ J"),
            (numbers.long, BLUE, "tolerance at round-off, V ≤ 10$^{-28}$ J"),
        ):
            seen = result.observables
            energy.plot(seen["time"][1:], seen["energy_error"][1:], color=colour, label=label)
        energy.set(title="energy of the worst particle")
        energy.set(xlabel="time [s]", ylabel="relative error", ylim=(1e-17, 1e1))
        energy.legend(loc="center right")
        edges = np.arange(0.5, 40.0)
        for name, colour in zip(ACCELERATIONS, (RED, GREEN, BLUE), strict=True):
            taken = sweeps_a_contact(numbers.short[name, ROUND_OFF])
            histogram.hist(
                taken, edges, weights=np.full(taken.size, 100.0 / taken.size), color=colour, label=f'"{name}"'
            )
        histogram.set(title="how long the loops are")
        histogram.set(xlabel="sweeps a contact, to V ≤ 10$^{-28}$ J", ylabel="particles [%]", xlim=(0, 40))
        histogram.legend(title="acceleration", loc="center")
    return file


def rows(numbers: Numbers) -> list[Row]:
    """Impacts, energy and sweeps."""
    loops = numbers.long.multipliers
    assert loops is not None
    name = "10 000 particles"
    return [
        Row(
            f"{name}: fewest, median impacts of a particle",
            "-",
            f"{loops.contacts.min()}, {np.median(loops.contacts):.0f}",
        ),
        Row(f"{name}: loops that did not converge", "-", f"{loops.unconverged.sum()} of {loops.contacts.sum()}"),
        Row(f"{name}: worst relative energy error", "-", f"{numbers.long.observables['energy_error'].max():.1e}"),
        Row(
            "1000 particles at the paper's tolerance: the same",
            "-",
            f"{numbers.paper.observables['energy_error'].max():.1e}",
        ),
        *[
            Row(f'Sweeps a contact to V ≤ {tolerance:g} J, acceleration "{name}"', "-", f"{mean_sweeps(result):.1f}")
            for (name, tolerance), result in numbers.short.items()
        ],
    ]

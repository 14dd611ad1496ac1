"""Beyond the paper: a torus, which is no quadric, with Gonzalez's inner gradient: a = 1 in State I converges."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from ..page import page
from .cases import DT, MASS, PENALTY, ROUND_OFF, SPHERE_ENERGY, Floats
from .plotting import CONSTRAINT_BAR, SWEEP, curve
from .table import Row

FILE = "beyond_2_torus.png"
MAJOR, MINOR, SPEED = 0.5, 0.2, 0.5
CONTACTS = 8
MOST_SWEEPS = 100
SEED = 7


class Numbers(NamedTuple):
    """Contact steps from random points of the torus, in random directions out of it."""

    positions: Floats
    velocities: Floats
    loops: list[swarm.ContactHistory]
    distances: Floats


def numbers() -> Numbers:
    """Some histories, and the distances from the surface at the ends of their steps."""
    torus = swarm.Torus(MAJOR, MINOR)
    scene = swarm.Scene(surfaces=[torus])
    positions, velocities = _starts(torus)
    method = swarm.AugmentedLagrangian(DT, PENALTY, tolerance=ROUND_OFF, max_sweeps=MOST_SWEEPS)
    starts = zip(positions.T, velocities.T, strict=True)
    loops = [swarm.contact_history(scene, r, v, MASS, method) for r, v in starts]
    ends = np.array([loop.position[-1] for loop in loops])
    return Numbers(positions, velocities, loops, abs(torus.phi(ends.T)))


def _starts(torus: "swarm.Torus") -> tuple[Floats, Floats]:
    """Points on the tube, and velocities within 70 degrees of the normal there."""
    random = np.random.default_rng(SEED)
    around, along = random.uniform(0.0, 2.0 * np.pi, (2, CONTACTS))
    rho = MAJOR + MINOR * np.cos(along)
    positions = np.array([rho * np.cos(around), rho * np.sin(around), MINOR * np.sin(along)])
    normals = torus.gradient(positions)
    directions = random.normal(size=(3, CONTACTS))
    tangents = directions - (directions * normals).sum(axis=0) * normals
    tangents /= np.linalg.norm(tangents, axis=0)
    angle = random.uniform(0.0, np.radians(70.0), CONTACTS)
    return positions, SPEED * (np.cos(angle) * normals + np.sin(angle) * tangents)


def energy_errors(numbers: Numbers) -> Floats:
    """The relative energy error of each contact step."""
    return abs(np.array([loop.kinetic_energy[-1] for loop in numbers.loops]) / SPHERE_ENERGY - 1.0)


def sweeps_at_tolerance(numbers: Numbers) -> list[int]:
    """Sweeps after which the paper's tolerance was reached."""
    return [1 + int(np.argmax(loop.constraint <= CONSTRAINT_BAR)) for loop in numbers.loops]


def draw(numbers: Numbers, folder: Path) -> Path:
    """Constraint and energy over the sweeps, a line a contact."""
    from swarm.pictures.style import BLUE, GREY

    file = folder / FILE
    title = f"Beyond the paper 2: on a torus, which is no quadric, all {CONTACTS} contacts converge"
    with page(file, title, 1, 2, (9.0, 3.9)) as (constraint, energy):
        constraint.set_yscale("log")
        energy.set_yscale("log")
        for loop in numbers.loops:
            line = {"color": BLUE, "alpha": 0.6, "linewidth": 0.8, "markersize": 1.8}
            curve(constraint, loop, loop.constraint, **line)
            curve(energy, loop, abs(loop.kinetic_energy / SPHERE_ENERGY - 1.0), **line)
        constraint.axhline(CONSTRAINT_BAR, color=GREY, linestyle="--", label="the paper's tolerance")
        constraint.set(title="how far outside the step ends", ylabel="constraint Φ$_1$ [m]")
        constraint.plot([], [], color=BLUE, marker="o", label="a contact each")
        energy.set(title="energy after the step", ylabel="relative error")
        constraint.legend()
        for axes in (constraint, energy):
            axes.set(xlabel=SWEEP, xlim=(0, None))
    return file


def rows(numbers: Numbers) -> list[Row]:
    """The range over the contacts."""
    name = f"Torus, a = 1, {CONTACTS} random contacts"
    first, last = sweeps_at_tolerance(numbers), [len(loop) for loop in numbers.loops]
    converged = sum(loop.converged for loop in numbers.loops)
    return [
        Row(f"{name}: sweeps to V ≤ 1e-10 J", "-", f"{min(first)} to {max(first)}"),
        Row(f"{name}: sweeps to V ≤ 1e-28 J", "-", f"{min(last)} to {max(last)}, {converged} of {CONTACTS} converged"),
        Row(f"{name}: worst distance from the surface (m)", "-", f"{numbers.distances.max():.1e}"),
        Row(f"{name}: worst relative energy error", "-", f"{energy_errors(numbers).max():.1e}"),
    ]

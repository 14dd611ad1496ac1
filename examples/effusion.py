"""Effusion: a gas without collisions leaves a vessel through a small hole, at the rate n v A/4.

    python -m examples.effusion

A ball in the vessel scatters the particles. Between elastic walls each keeps its speed v until it escapes, so that of
the density f(v) of the start f(v) exp(-v A t/4V) is left: the fast ones leave first, and the gas cools. Where the walls
have a temperature the gas keeps it, and exp(-<v> A t/4V) of the particles are left.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

HALF, BALL, HOLE = 0.5, 0.3, 0.025
# k_B T [J] of particles of mass 1 kg
TEMPERATURE = 1.0
VOLUME = (2.0 * HALF) ** 3 - 4.0 / 3.0 * math.pi * BALL**3
# A/4V: how many times a particle of 1 m/s reaches the hole in a second.
REACHES = math.pi * HOLE**2 / (4.0 * VOLUME)
# Speeds for integrals over Maxwell's density, and what they weigh
SPEEDS = np.linspace(0.0, 8.0 * math.sqrt(TEMPERATURE), 4001)
WEIGHTS = SPEEDS**2 * np.exp(-0.5 * SPEEDS**2 / TEMPERATURE)
WEIGHTS /= WEIGHTS.sum()
MEAN_SPEED = math.sqrt(8.0 * TEMPERATURE / math.pi)


class Gas(NamedTuple):
    """What a run shows, frame by frame; times in units of the time in which 1/e would be left at a constant rate."""

    time: np.ndarray
    left: np.ndarray  # part of the particles that is inside
    error: np.ndarray  # its standard error
    law: np.ndarray  # what it should be
    energy: np.ndarray  # mean kinetic energy of those inside, over that of the start
    energy_law: np.ndarray
    balance: float  # of the energy, with the heat of the walls
    escape_energy: tuple[float, float]  # mean kinetic energy of those that leave in the first frame, its standard error


def vessel(hot: bool) -> swarm.Scene:
    """A box with a hole in a wall, and a ball in it."""
    wall = {"temperature": TEMPERATURE} if hot else {}
    hole = swarm.Sphere(HOLE, center=(HALF, 0.2, 0.31))
    walls = swarm.Box((HALF, HALF, HALF), openings=[hole], **wall)
    return swarm.Scene([walls, swarm.Sphere(BALL, side="outside")])


def laws(time: np.ndarray, hot: bool) -> tuple[np.ndarray, np.ndarray]:
    """What is left of the particles, and their mean energy over that of the start, at times [s]."""
    if hot:
        return np.exp(-REACHES * MEAN_SPEED * time), np.ones_like(time)
    kept = WEIGHTS * np.exp(-REACHES * time[:, None] * SPEEDS)
    left = kept.sum(axis=1)
    return left, (kept * 0.5 * SPEEDS**2).sum(axis=1) / left / (1.5 * TEMPERATURE)


def run(count: int, hot: bool, until: float = 2.0, frames: int = 20) -> Gas:
    """The gas until so many times of the decay at a constant rate."""
    scene, scale = vessel(hot), 1.0 / (REACHES * MEAN_SPEED)
    start = swarm.fill(scene, count, temperature=TEMPERATURE, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=until * scale, every=until * scale / frames, seed=2)
    seen, times = result.observables, result.escape_time
    law, energy_law = laws(seen["time"], hot)
    # Particles that escaped keep the energy they left with.
    energies = 0.5 * (result.particles.velocity**2).sum(axis=0)
    gone = np.array([energies[times <= time].sum() for time in seen["time"]])
    inside = count - seen["escaped"]
    first = energies[times <= seen["time"][1]]
    given = seen["wall_heat"].sum(axis=1)
    return Gas(
        seen["time"] / scale,
        inside / count,
        np.sqrt(law * (1.0 - law) / count),
        law,
        (seen["total_energy"] - gone) / inside / (1.5 * TEMPERATURE),
        energy_law,
        float(np.abs(seen["total_energy"] - given - seen["total_energy"][0]).max() / seen["total_energy"][0]),
        (float(first.mean()), float(first.std() / math.sqrt(len(first)))),
    )


def draw(cold: Gas, hot: Gas, file: Path) -> None:
    """What is left, how far that is from the law, and the energy of a particle inside."""
    from swarm.pictures.style import BLUE, RED

    kinds = (("elastic walls", cold, BLUE), ("walls of one temperature", hot, RED))
    title = "A gas leaves its box through a small hole: between elastic walls fast particles go first, and it cools"
    with page(file, title, 1, 3, (11.0, 3.8)) as axes:
        for name, gas, color in kinds:
            first = gas is cold
            law(axes[0], gas.time, gas.law, "laws" if first else None)
            axes[0].plot(gas.time, gas.left, ".", color=color, markersize=5, label=name)
            axes[1].errorbar(
                gas.time[1:],
                100.0 * (gas.left[1:] - gas.law[1:]),
                100.0 * gas.error[1:],
                fmt=".",
                color=color,
                label=name,
            )
            law(axes[2], gas.time, gas.energy_law, "laws" if first else None)
            axes[2].plot(gas.time, gas.energy, ".", color=color, markersize=5, label=name)
        axes[0].set(yscale="log", title="particles inside", ylabel="part of those at the start")
        axes[0].set_yticks([0.2, 0.3, 0.5, 0.7, 1.0], ["0.2", "0.3", "0.5", "0.7", "1"], minor=False)
        axes[0].set_yticks([], minor=True)
        law(axes[1], None, 0.0, "law")
        axes[1].set(title="the same, less the law, with standard errors", ylabel="% of the particles", ylim=(-1.5, 1.5))
        axes[2].set(title="mean energy of those inside", ylabel="over that of the start", ylim=(0.4, 1.05))
        for one in axes:
            one.set(xlabel="time, in $4V/A\\langle v\\rangle$")
            one.legend(loc="lower left")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "effusion.png", "plot")
    ask.add_argument("--particles", type=int, default=20_000)
    asked = ask.parse_args()
    cold, hot = (run(asked.particles, hot) for hot in (False, True))
    for name, gas in (("elastic walls", cold), ("walls at a temperature", hot)):
        off = np.abs(gas.left[1:] - gas.law[1:]) / gas.error[1:]
        print(f"{name}: {gas.left[-1]:.4f} are left ({gas.law[-1]:.4f} by the law), at most {off.max():.1f} standard")
        print(
            f"errors off; of the first to leave each has {gas.escape_energy[0]:.3f} J, +- {gas.escape_energy[1]:.3f};"
        )
        print(f"the energy is kept to {gas.balance:.1e}")
    draw(cold, hot, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

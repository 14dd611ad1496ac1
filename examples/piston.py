"""A piston that compresses a gas slowly: its temperature follows the adiabatic law.

    python -m examples.piston

The gas has no collisions. Balls in the vessel scatter its particles, so that the three directions share the energy and
T V^(2/3) is constant; without them only the motion along the piston is compressed, and T_z L^2 is constant.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

HALF, LENGTH, RADIUS = 0.5, 1.0, 0.18
# kinetic temperature k_B T [J] of particles of mass 1 kg, and the part of the length that is left at the end
TEMPERATURE, LEFT = 1.0, 0.6
BALLS = ((0.22, 0.22, 0.3), (-0.22, -0.22, 0.3), (0.22, -0.22, 0.3), (-0.22, 0.22, 0.3))


class Compressed(NamedTuple):
    """What a run shows, frame by frame."""

    volume: np.ndarray  # over that of the start
    temperature: np.ndarray  # over that of the start, of all directions
    error: np.ndarray  # its standard error
    along: tuple[float, float]  # temperature of the direction of the piston at the end, and its standard error
    balance: float  # of energy and work, over the energy
    impacts: int


def vessel(speed: float, balls: bool) -> swarm.Scene:
    """A shaft from z = 0 up, a piston that comes down from z = LENGTH, and balls that scatter."""
    walls = [
        swarm.Box((HALF, HALF, LENGTH), center=(0.0, 0.0, LENGTH), open=("+z",)),
        swarm.Plane((0.0, 0.0, 1.0), LENGTH, motion=swarm.Translation((0.0, 0.0, -speed))),
    ]
    solids = [swarm.Sphere(RADIUS, center=center, side="outside") for center in BALLS]
    return swarm.Scene(walls + solids * balls)


def run(count: int, speed: float, frames: int = 20, balls: bool = True) -> Compressed:
    """The gas, while the piston moves with this speed [m/s] until LEFT of the length is left."""
    scene = vessel(speed, balls)
    gas = swarm.fill(scene, count, temperature=TEMPERATURE, seed=1)
    until = (1.0 - LEFT) * LENGTH / speed
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "piston.h5"
        result = swarm.simulate(
            scene, gas, swarm.Impact(), until=until, every=until / frames, trajectory=file, precision="float64"
        )
        with swarm.load(file) as trajectory:
            energies = [0.5 * trajectory.frame(k).velocity ** 2 for k in range(len(trajectory))]
    seen, start = result.observables, energies[0]
    free = (2.0 * HALF) ** 2 * LENGTH - (len(BALLS) * 4.0 / 3.0 * np.pi * RADIUS**3 if balls else 0.0)
    volume = 1.0 - (2.0 * HALF) ** 2 * speed * seen["time"] / free
    ratio, error = np.transpose([growth(start.sum(axis=0), now.sum(axis=0)) for now in energies])
    kept = seen["total_energy"] - seen["wall_work"].sum(axis=1)
    balance = float(np.abs(kept - kept[0]).max() / seen["total_energy"].max())
    return Compressed(volume, ratio, error, growth(start[2], energies[-1][2]), balance, int(seen["impacts"][-1]))


def growth(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """The ratio R = <e1>/<e0> of means over the same particles, and its standard error by the spread of e1 - R e0."""
    ratio = after.mean() / before.mean()
    return float(ratio), float((after - ratio * before).std() / before.mean() / np.sqrt(len(before)))


def draw(found: Compressed, file: Path) -> None:
    """Temperature over volume, beside the adiabatic law."""
    from swarm.pictures.style import BLUE

    title = "A slow piston compresses a gas: it warms by the adiabatic law"
    with page(file, title, 1, 2, (9.0, 3.8)) as axes:
        run = {"fmt": "o", "color": BLUE, "label": "run, with standard errors"}
        adiabatic = found.volume ** (-2.0 / 3.0)
        law(axes[0], found.volume, adiabatic, "adiabatic law, $V^{-2/3}$")
        axes[0].errorbar(found.volume, found.temperature, found.error, **run)
        axes[0].set(title="temperature", ylabel="over that of the start")
        law(axes[1], None, 0.0, "adiabatic law")
        off, error = found.temperature / adiabatic - 1.0, found.error / adiabatic
        axes[1].errorbar(found.volume, 100.0 * off, 100.0 * error, **run)
        axes[1].set(title="the same, less the law", ylabel="part of the law [%]", ylim=(-0.3, 0.3))
        for one in axes:
            one.set(xlabel="volume, over that of the start")
            one.legend(loc="upper right")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "piston.png", "plot")
    ask.add_argument("--particles", type=int, default=4_000)
    ask.add_argument("--speed", type=float, default=0.001)
    asked = ask.parse_args()
    found = run(asked.particles, asked.speed)
    off, error = found.temperature * found.volume ** (2.0 / 3.0) - 1.0, found.error / found.temperature
    print(f"volume {found.volume[-1]:.4f}, temperature {found.temperature[-1]:.4f} of those of the start")
    print(f"T V^(2/3) is off by {off[-1]:.1e}, standard error {error[-1]:.1e}; energy less work by {found.balance:.1e}")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

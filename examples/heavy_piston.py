"""The adiabatic piston: a heavy wall between two gases, one hot and one cold.

    python -m examples.heavy_piston

The piston is struck by particles of both gases and moves on a guide. First the pressures become equal, in a vibration
that fades. Then its thermal motion carries energy from the hot gas to the cold one, until the mean energies are equal,
in a time that is proportional to its mass.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

HALF, LENGTH, THICK, RADIUS = 0.5, 1.0, 0.02, 0.2
# k_B T [J] of the gas below and of that above, of particles of 1 kg
COLD, HOT = 0.5, 1.5
# Balls that scatter the particles, so that the three directions share the energy
BALLS = ((0.22, 0.22), (-0.22, -0.22))


class Shared(NamedTuple):
    """What a run shows, frame by frame."""

    time: np.ndarray
    place: np.ndarray  # of the piston, over the half length
    below: np.ndarray  # kinetic temperature of the gas below [J]
    above: np.ndarray
    piston: np.ndarray  # twice the kinetic energy of the piston [J]
    impacts: int
    balance: float  # of the energy, relative


def vessel(mass: float) -> swarm.Scene:
    """A box, the piston across it, and balls near both ends."""
    up = (0.0, 0.0, 1.0)
    piston = swarm.Slab(up, THICK, side="outside", mass=mass, motion=swarm.Guide(up))
    balls = [swarm.Sphere(RADIUS, center=(x, y, s * 0.75), side="outside") for x, y in BALLS for s in (-1.0, 1.0)]
    return swarm.Scene([swarm.Box((HALF, HALF, LENGTH)), piston, *balls])


def gases(scene: swarm.Scene, count: int) -> swarm.Particles:
    """So many particles, half of them on each side, cold below and hot above."""
    made = swarm.fill(scene, count, temperature=1.0, seed=1)
    temperature = np.where(made.position[2] > 0.0, HOT, COLD)
    return swarm.Particles(made.position, made.velocity * np.sqrt(temperature))


def run(count: int, mass: float, until: float, frames: int = 100, compile: str = "always") -> Shared:
    """The two gases and the piston between them until a time [s]."""
    scene = vessel(mass)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "piston.h5"
        swarm.simulate(
            scene, gases(scene, count), swarm.Impact(), until=until, every=until / frames, trajectory=file,
            compile=compile,
        )  # fmt: skip
        with swarm.load(file) as trajectory:
            seen, below, above = trajectory.observables, [], []
            place = seen["wall_position"][:, 1, 2]
            for k, height in enumerate(place):
                frame = trajectory.frame(k)
                energy, is_above = (frame.velocity**2).sum(axis=0) / 3.0, frame.position[2] > height
                below.append(energy[~is_above].mean())
                above.append(energy[is_above].mean())
    return Shared(
        seen["time"], place / LENGTH, np.array(below), np.array(above), 2.0 * seen["wall_energy"][:, 1],
        int(seen["impacts"][-1]), float(seen["energy_error"].max()),
    )  # fmt: skip


def late_difference(found: Shared) -> tuple[float, float]:
    """The gas above less that below, mean of the second half of the run, and its standard error from ten blocks [J]."""
    late = (found.above - found.below)[1 + len(found.time) // 2 :]
    blocks = np.array([block.mean() for block in np.array_split(late, 10)])
    return float(blocks.mean()), float(blocks.std(ddof=1) / np.sqrt(len(blocks)))


def draw(found: Shared, file: Path) -> None:
    """The place of the piston and the temperatures over time."""
    from swarm.pictures.style import BLUE, GREEN, RED

    title = "A piston between a cold gas and a hot one: its own thermal motion makes their temperatures equal"
    with page(file, title, 1, 2, (9.0, 3.8)) as axes:
        axes[0].plot(found.time, found.place, color=GREEN, label="piston")
        law(axes[0], None, 0.0, "the middle")
        axes[0].set(title="height of the piston", ylabel="over half the length of the vessel", ylim=(-0.6, 0.4))
        axes[1].plot(found.time, found.above, color=RED, label="gas above")
        axes[1].plot(found.time, found.below, color=BLUE, label="gas below")
        law(axes[1], None, 0.5 * (found.below[0] + found.above[0]), "mean of both at the start")
        axes[1].set(title="temperature of the gases", ylabel="kinetic temperature $k_BT$ [J]", ylim=(0.0, 1.8))
        for one in axes:
            one.set(xlabel="time [s]", xlim=(0.0, found.time[-1]))
            one.legend(loc="lower right")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "heavy_piston.png", "plot")
    ask.add_argument("--particles", type=int, default=2_000)
    ask.add_argument("--mass", type=float, default=50.0)
    ask.add_argument("--until", type=float, default=800.0)
    asked = ask.parse_args()
    found = run(asked.particles, asked.mass, asked.until)
    difference, error = late_difference(found)
    print(f"{found.impacts} impacts; energy of particles and piston constant to {found.balance:.1e}")
    piston = found.piston[len(found.time) // 2 :].mean()
    print(f"start: below {found.below[0]:.3f} J, above {found.above[0]:.3f} J; second half: above less below")
    print(f"{difference:.3f} J, standard error {error:.3f} J; below {found.below[-1]:.3f} J, piston {piston:.2f} J")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

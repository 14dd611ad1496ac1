"""Newton's cradle on a rail: balls that touch hand a blow on, one by one, all at the same instant.

    python -m examples.newton_cradle

Impacts that come at the same time are taken in a fixed order, by the numbers of the balls. As many balls leave the row
as came; with a ball of another mass, or with losses, others are set moving too. Walls at both ends send them back.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import page

COUNT, RADIUS, HALF, FRAMES = 6, 0.05, 1.0, 600
# Of a line in the picture [points]: less than balls at rest are apart.
_WIDE = 4.5


class Swung(NamedTuple):
    """The balls over time."""

    time: np.ndarray
    place: np.ndarray  # (frames, balls) [m]
    velocity: np.ndarray
    collisions: int
    balance: float  # of the energy, relative


def row(moving: int, masses: tuple[float, ...] | None = None) -> swarm.Particles:
    """Balls that touch in the middle, and some of them that come from the left with 1 m/s."""
    position, velocity = np.zeros((3, COUNT)), np.zeros((3, COUNT))
    position[0] = 2.0 * RADIUS * (np.arange(COUNT) - 0.5 * (COUNT - 1))
    position[0, :moving] -= 0.4
    velocity[0, :moving] = 1.0
    return swarm.Particles(position, velocity, 1.0 if masses is None else masses, radius=RADIUS)


def run(moving: int, restitution: float = 1.0, masses: tuple[float, ...] | None = None, until: float = 6.0) -> Swung:
    """The balls of a cradle until a time [s]."""
    rail = swarm.Scene([swarm.Box((HALF, 0.1, 0.1))], pairs=swarm.Pairs(restitution=restitution))
    places, speeds = [], []

    def look(frame: swarm.Frame) -> None:
        places.append(frame.position[0].copy())
        speeds.append(frame.velocity[0].copy())

    result = swarm.simulate(rail, row(moving, masses), swarm.Impact(), until=until, every=until / FRAMES, progress=look)
    seen = result.observables
    return Swung(
        seen["time"], np.array(places), np.array(speeds), int(seen["collisions"][-1]), float(seen["energy_error"].max())
    )


CRADLES = {
    "one ball comes": {"moving": 1},
    "three balls come": {"moving": 3},
    "one ball of three times the mass": {"moving": 1, "masses": (3.0, 1.0, 1.0, 1.0, 1.0, 1.0)},
    "one ball, e = 0.9": {"moving": 1, "restitution": 0.9},
}


def draw(found: dict[str, Swung], file: Path) -> None:
    """Where the centres of the balls are over time: lines of one width, which at rest are a diameter apart."""
    from swarm.pictures.style import CURVES

    title = "Newton's cradle on a rail: as many balls leave the row as came, unless one is heavier or energy is lost"
    with page(file, title, 1, len(found), (11.0, 4.8), sharey=True) as axes:
        for one, (name, swung) in zip(axes, found.items(), strict=True):
            for k, colour in enumerate(CURVES):
                one.plot(swung.place[:, k], swung.time, color=colour, linewidth=_WIDE, label=f"ball {k + 1}")
            one.set(title=name, xlabel="place [m]", xlim=(-HALF, HALF), ylim=(0.0, swung.time[-1]))
            one.grid(False)
        axes[0].set(ylabel="time [s], upwards")
        axes[0].figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=COUNT)


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "newton_cradle.png", "plot")
    ask.add_argument("--until", type=float, default=6.0)
    asked = ask.parse_args()
    found = {name: run(until=asked.until, **how) for name, how in CRADLES.items()}
    for name, one in found.items():
        speeds = ", ".join(f"{v:+.3f}" for v in one.velocity[-1])
        print(f"{name}: {one.collisions} collisions, velocities at the end {speeds} m/s, energy to {one.balance:.1e}")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

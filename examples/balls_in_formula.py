"""Heavy and light balls in a cavity by a formula: their collisions share the energy until both kinds have the same.

    python -m examples.balls_in_formula

The cavity is smooth, and is round nowhere: a ball meets it where the foot of the normal is as far as its radius. All
balls start equally fast, so that a heavy one has eight times the energy of a light one. Elastic impacts and collisions
keep the whole of it, and end with equal mean energies.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

CAVITY = swarm.Formula("x**4 + y**4 + z**4 + 0.6*x*y*z - 0.3*x**2 - 0.6")
# (mass [kg], radius [m]) of a heavy ball and of a light one
HEAVY, LIGHT = (8.0, 0.06), (1.0, 0.03)


class Shared(NamedTuple):
    """What a run shows, frame by frame."""

    time: np.ndarray
    heavy: np.ndarray  # mean kinetic energy of a heavy ball [J]
    light: np.ndarray  # that of a light one
    impacts: int
    collisions: int
    balance: float  # of the energy, relative
    outside: float  # how far a ball reaches beyond the wall at most [m]
    end: swarm.Particles


def start(count: int) -> swarm.Particles:
    """So many balls, a quarter of them heavy, all with 1 m/s."""
    is_heavy = np.arange(count) % 4 == 0
    mass, radius = (np.where(is_heavy, *pair) for pair in zip(HEAVY, LIGHT, strict=True))
    return swarm.fill(swarm.Scene([CAVITY]), count, speed=1.0, seed=2, mass=mass, radius=radius)


def run(count: int, until: float, frames: int = 100) -> Shared:
    """The balls until a time [s]."""
    scene, balls = swarm.Scene([CAVITY]), start(count)
    assert balls.radius is not None
    is_heavy, outside = balls.mass > LIGHT[0], []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "balls.h5"
        end = swarm.simulate(scene, balls, swarm.Impact(), until=until, every=until / frames, trajectory=file).particles
        with swarm.load(file) as trajectory:
            seen, energy = trajectory.observables, []
            for k in range(len(seen["time"])):
                frame = trajectory.frame(k)
                energy.append(0.5 * balls.mass * (frame.velocity**2).sum(axis=0))
                outside.append(CAVITY.reaching_outside(frame.position, balls.radius).max())
    each = np.array(energy)
    return Shared(
        seen["time"], each[:, is_heavy].mean(axis=1), each[:, ~is_heavy].mean(axis=1), int(seen["impacts"][-1]),
        int(seen["collisions"][-1]), float(seen["energy_error"].max()), float(max(outside)), end,
    )  # fmt: skip


def late_ratio(found: Shared) -> tuple[float, float]:
    """The energy of a heavy ball over that of a light one in the second half, and its standard error by ten blocks."""
    half = 1 + len(found.time) // 2
    blocks = np.array(
        [
            heavy.mean() / light.mean()
            for heavy, light in zip(
                np.array_split(found.heavy[half:], 10), np.array_split(found.light[half:], 10), strict=True
            )
        ]
    )
    return float(blocks.mean()), float(blocks.std(ddof=1) / np.sqrt(len(blocks)))


def draw(found: Shared, file: Path) -> None:
    """A section through the cavity and its balls, and the energies over time."""
    from matplotlib.patches import Circle

    from swarm.pictures.style import BLUE, RED

    line = np.linspace(-1.1, 1.1, 300)
    x, y = np.meshgrid(line, line)
    level = CAVITY.phi(np.array([x.ravel(), y.ravel(), np.zeros(x.size)])).reshape(x.shape)
    title = "Balls in a cavity by a formula: collisions give heavy and light balls the same mean energy"
    with page(file, title, 1, 2, (9.0, 4.0)) as axes:
        axes[0].contour(x, y, level, [0.0], colors="0.3")
        balls = found.end
        assert balls.radius is not None
        cut = np.sqrt(np.maximum(balls.radius**2 - balls.position[2] ** 2, 0.0))
        for k in np.flatnonzero(cut > 0.0).tolist():
            color = RED if balls.mass[k] > LIGHT[0] else BLUE
            axes[0].add_patch(Circle(tuple(balls.position[:2, k].tolist()), float(cut[k]), color=color, lw=0.0))
        axes[0].set(title="section at z = 0", xlabel="x [m]", ylabel="y [m]", aspect="equal")
        axes[1].plot(found.time, found.heavy, color=RED, label="a heavy ball")
        axes[1].plot(found.time, found.light, color=BLUE, label="a light ball")
        mean = 0.25 * found.heavy[0] + 0.75 * found.light[0]
        law(axes[1], None, mean, "mean of all")
        axes[1].set(title="mean kinetic energy", xlabel="time [s]", ylabel="energy [J]", ylim=(0.0, None))
        axes[1].set(xlim=(0.0, found.time[-1]))
        axes[1].legend(loc="upper right")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "balls_in_formula.png", "plot")
    ask.add_argument("--balls", type=int, default=400)
    ask.add_argument("--until", type=float, default=60.0)
    asked = ask.parse_args()
    found = run(asked.balls, asked.until)
    ratio, error = late_ratio(found)
    print(f"{found.impacts} impacts, {found.collisions} collisions; energy constant to {found.balance:.1e}")
    print(f"no ball reaches beyond the wall by more than {max(found.outside, 0.0):.1e} m")
    print(f"heavy over light: {found.heavy[0] / found.light[0]:.2f} at the start, then {ratio:.3f}, error {error:.3f}")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

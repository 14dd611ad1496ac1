"""Galton's board: grains fall through twelve rows of pegs, and fill the bins below as the binomial law says.

    python -m examples.galton_board

They do so if each row is a fair choice of two sides, without memory. Smooth pegs are not: a grain goes on to the side
to which it goes already. These pegs are rough, as a wall with a temperature is: a grain leaves a peg in any direction,
with some 5 cm/s. Slower, it goes back to the middle; faster, it flies over the next rows; at 2.87 mJ (of grains of 1
kg), the value that makes the variance right, so is the rest. `examples/scenes/galton_board.toml` is this board.
"""

import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import page, solid

# Distance of pegs and of rows, radius of a peg with a grain, depth of the bins, half the thickness of a divider, and
# how far it goes on into floor and glass, so that no grain gets in between [m].
ROWS, SPACING, RADIUS, DEPTH, DIVIDER, JOINT = 12, 0.02, 0.006, 0.08, 0.0008, 0.001
FLOOR, LID = -(ROWS - 1) * SPACING - DEPTH, 0.04
# k_B T of the pegs [J]
ROUGH = 2.87e-3
# What the glass, the dividers and the floor take.
DULL = {"restitution": 0.3, "friction": 0.5}


class Filled(NamedTuple):
    """What a run shows."""

    bins: np.ndarray  # grains in each
    mean: float  # number of a bin, from 0
    variance: float
    chi_squared: float  # of ROWS degrees of freedom, if rows are independent and fair
    moving: int  # grains that are not at rest
    impacts: int


def pegs() -> np.ndarray:
    """Their centres (78, 3): k + 1 of them in row k."""
    return np.array([[(j - 0.5 * k) * SPACING, 0.0, -k * SPACING] for k in range(ROWS) for j in range(k + 1)])


def board(rough: float = ROUGH) -> swarm.Scene:
    """Pegs, dividers below those of the last row, and a box; rough = 0: smooth pegs that take half the speed."""
    law = {"temperature": rough} if rough else {"temperature": 1.0, "accommodation": 0.0, "restitution": 0.5}
    below = pegs()[-ROWS:] - (0.0, 0.0, 0.5 * (DEPTH + JOINT))
    half, middle = 0.5 * (LID - FLOOR), 0.5 * (LID + FLOOR)
    return swarm.Scene(
        [
            swarm.Cylinders(pegs(), RADIUS, axes=(0.0, 1.0, 0.0), **law),
            swarm.Boxes(below, (DIVIDER, 0.5 * SPACING + JOINT, 0.5 * (DEPTH + JOINT)), **DULL),
            swarm.Box((0.5 * (ROWS + 1) * SPACING, 0.5 * SPACING, half), center=(0.0, 0.0, middle), **DULL),
        ],
        gravity=(0.0, 0.0, -9.81),
    )


def grains(count: int, seed: int = 1) -> swarm.Particles:
    """At rest above the first peg, within a twentieth of the spacing to both sides."""
    random = np.random.default_rng(seed)
    x, z = random.uniform(-0.001, 0.001, count), random.uniform(0.02, 0.03, count)
    return swarm.Particles(np.stack([x, 0.0 * x, z]), np.zeros((3, count)))


def binomial() -> np.ndarray:
    """The part of the grains in each bin, if rows are independent and fair."""
    return np.array([math.comb(ROWS, k) for k in range(ROWS + 1)]) / 2.0**ROWS


def run(count: int, rough: float = ROUGH, until: float = 10.0, how: str = "auto") -> Filled:
    """So many grains, until they are at rest; `how` to compile."""
    result = swarm.simulate(board(rough), grains(count), swarm.Impact(), until=until, seed=1, compile=how)
    number = np.floor(result.particles.position[0] / SPACING + 0.5 * (ROWS + 1)).astype(int)
    bins = np.bincount(number, minlength=ROWS + 1)
    expected = count * binomial()
    return Filled(
        bins, float(number.mean()), float(number.var()), float(((bins - expected) ** 2 / expected).sum()),
        int((np.abs(result.particles.velocity).max(axis=0) > 0.0).sum()), int(result.observables["impacts"][-1]),
    )  # fmt: skip


def paths(count: int, until: float = 6.0) -> np.ndarray:
    """The paths (frames, 3, count) of some grains."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "galton.h5"
        swarm.simulate(board(), grains(count), swarm.Impact(), until=until, every=0.004, trajectory=file, seed=3)
        with swarm.load(file) as trajectory:
            return np.array([trajectory.frame(k).position for k in range(len(trajectory))])


def draw(found: Filled, smooth: Filled, file: Path) -> None:
    """The board with some paths, and the bins beside the binomial law."""
    from matplotlib.patches import Rectangle

    from swarm.pictures.style import BLUE, GREEN, ORANGE, RED, SOLID_LINE, ink

    title = "Galton's board: twelve rows of rough pegs fill the bins by the binomial law, smooth pegs do not"
    with page(file, title, 1, 2, (10.0, 4.6)) as axes:
        for x, _y, z in pegs():
            solid(axes[0], (1e3 * x, 1e3 * z), 1e3 * RADIUS)
        for x, _y, z in pegs()[-ROWS:]:
            corner = 1e3 * (x - DIVIDER), 1e3 * (z - DEPTH)
            axes[0].add_patch(Rectangle(corner, 2e3 * DIVIDER, 1e3 * DEPTH, color=SOLID_LINE))
        for path, colour in zip(np.moveaxis(paths(3), 2, 0), (BLUE, RED, GREEN), strict=True):
            axes[0].plot(1e3 * path[:, 0], 1e3 * path[:, 2], color=colour, linewidth=0.8)
            axes[0].plot(1e3 * path[-1, 0], 1e3 * path[-1, 2] + 2.0, "o", color=colour, markersize=4)
        axes[0].set(title="the paths of three grains of 20 000", xlabel="x [mm]", ylabel="z [mm]", aspect="equal")
        axes[0].set(xlim=(-130.0, 130.0), ylim=(1e3 * FLOOR, 1e3 * LID))
        axes[0].grid(False)
        number, count = np.arange(ROWS + 1), found.bins.sum()
        axes[1].bar(number, found.bins / count, color=BLUE, alpha=0.45, label="run, rough pegs")
        axes[1].step(
            number, smooth.bins / count, where="mid", color=ORANGE, label="run, smooth pegs, which take half the speed"
        )
        axes[1].errorbar(
            number, binomial(), np.sqrt(binomial() / count), fmt="_", color=ink(), markersize=14,
            label="binomial law, with standard errors",
        )  # fmt: skip
        axes[1].set(title="where they end", xlabel="bin, from the left", ylabel="part of the grains", ylim=(0.0, 0.46))
        axes[1].legend(loc="upper center")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "galton_board.png", "plot")
    ask.add_argument("--grains", type=int, default=20_000)
    asked = ask.parse_args()
    print("k_B T of the pegs  mean (6)  variance (3)  chi squared (12 +- 5)  still moving  impacts a grain  bins")
    found = {}
    for rough in (0.0, 0.5 * ROUGH, ROUGH, 2.0 * ROUGH):
        found[rough] = one = run(asked.grains, rough)
        print(
            f"{rough:<17g}  {one.mean:<8.3f}  {one.variance:<12.3f}  {one.chi_squared:<21.1f}  {one.moving:<12}  "
            f"{one.impacts / asked.grains:<15.0f}  {' '.join(map(str, one.bins))}"
        )
    draw(found[ROUGH], found[0.0], asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

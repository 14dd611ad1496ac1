"""A break shot: sixteen balls on a table of two dimensions, with six pockets.

    python -m examples.break_shot [--film break_shot.mp4]

Balls, cushions and pockets are as large as those of pool. Balls slide without friction, so only cushions, collisions
and pockets take energy. The rack is as tight as a hand makes it: gaps of up to a tenth of a millimetre, other ones for
each seed, and another game.
"""

import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import page

# [m], [kg], [m/s]; the table is 2.54 m by 1.27 m between its cushions.
LONG, SHORT, RADIUS, MASS, SPEED = 1.27, 0.635, 0.028575, 0.17, 9.0
POCKET, CUSHION, BALLS = 0.075, 0.8, 0.95
SHOWN = (0.0, 0.16, 0.4, 6.0)


class Game(NamedTuple):
    """The balls over time."""

    time: np.ndarray
    position: np.ndarray  # (frames, 3, balls)
    pocketed: np.ndarray  # (frames,)
    energy: np.ndarray
    escape_time: np.ndarray  # (balls,) NaN of those on the table
    collisions: int
    balance: float  # of the energy with what was lost, relative


def table() -> swarm.Scene:
    """The cushions, with pockets in the corners and in the middle of the long sides."""
    places = [(x, y) for x in (-LONG, 0.0, LONG) for y in (-SHORT, SHORT)]
    pockets = [swarm.Cylinder(POCKET, center=(x, y, 0.0)) for x, y in places]
    cushions = swarm.Box((LONG, SHORT, 0.1), restitution=CUSHION, openings=pockets)
    return swarm.Scene([cushions], plane="z", pairs=swarm.Pairs(restitution=BALLS))


def rack(seed: int) -> swarm.Particles:
    """The cue ball on its way, and fifteen balls in a triangle."""
    random, loose = np.random.default_rng(seed), 2.0 * RADIUS + 1e-4
    places = [(-0.5 * LONG, 0.0)]
    for k in range(5):
        places += [(0.5 * LONG + k * loose * np.sqrt(0.75), (j - 0.5 * k) * loose) for j in range(k + 1)]
    position, velocity = np.zeros((3, 16)), np.zeros((3, 16))
    position[:2] = np.transpose(places)
    # Two neighbours come nearer to one another by at most 0.1 mm.
    position[:2, 1:] += 3.5e-5 * random.uniform(-1.0, 1.0, (2, 15))
    velocity[:2, 0] = SPEED * np.array([1.0, 0.01])
    return swarm.Particles(position, velocity, MASS, radius=RADIUS)


def run(seed: int = 1, until: float = 6.0, every: float = 0.02, film: Path | None = None) -> Game:
    """A game from the shot to a time [s]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "game.h5"
        result = swarm.simulate(table(), rack(seed), swarm.Impact(), until=until, every=every, trajectory=file)
        with swarm.load(file) as trajectory:
            position = np.array([trajectory.frame(k).position for k in range(len(trajectory.times))])
            if film is not None:
                trajectory.animate(film)
    seen = result.observables
    return Game(
        seen["time"], position, seen["escaped"], seen["kinetic_energy"], result.escape_time,
        int(seen["collisions"][-1]), float(seen["energy_error"].max()),
    )  # fmt: skip


def draw(game: Game, file: Path) -> None:
    """The table at four times; balls that are in a pocket are not there."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle, Rectangle

    from swarm.pictures.style import BLUE, CAVITY, CAVITY_LINE, GREY, RED, ink

    title = "A break shot: the red ball comes from the left with 9 m/s, and fifteen blue ones scatter"
    with page(file, title, 2, 2, (8.4, 4.9)) as axes:
        for one, time in zip(axes, SHOWN, strict=True):
            k = int(np.argmin(np.abs(game.time - time)))
            gone = game.escape_time <= game.time[k]
            cloth = Rectangle((-LONG, -SHORT), 2.0 * LONG, 2.0 * SHORT, facecolor=CAVITY, edgecolor=CAVITY_LINE)
            one.add_patch(cloth)
            for x, y in [(x, y) for x in (-LONG, 0.0, LONG) for y in (-SHORT, SHORT)]:
                one.add_patch(Circle((x, y), POCKET, color=ink()))
            balls: list[Any] = [Circle(tuple(r), RADIUS) for r in game.position[k, :2].T]
            for chosen, colour in ((slice(0, 1), RED), (slice(1, None), BLUE)):
                shown = [ball for ball, away in zip(balls[chosen], gone[chosen], strict=True) if not away]
                one.add_collection(PatchCollection(shown, facecolor=colour, zorder=3))
            if k > 0:
                since = game.position[max(0, k - 10) : k + 1, :2]
                one.plot(*np.moveaxis(since[:, :, ~gone], 1, 0), color=GREY, linewidth=0.8)
            in_pockets = int(gone.sum())
            number = {0: "none is", 1: "one is"}.get(in_pockets, f"{in_pockets} are")
            one.set(title=f"after {game.time[k]:g} s: {number} in pockets", aspect="equal")
            one.set(xlim=(-LONG - 0.1, LONG + 0.1), ylim=(-SHORT - 0.1, SHORT + 0.1))
            one.axis("off")
        metre = axes[2]
        metre.plot([-LONG, -LONG + 1.0], [-SHORT - 0.16] * 2, color=ink(), linewidth=2.0, clip_on=False)
        metre.text(-LONG + 1.05, -SHORT - 0.16, "1 m", va="center")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "break_shot.png", "plot")
    ask.add_argument("--seed", type=int, default=1, help="of the gaps in the rack [default: %(default)s]")
    ask.add_argument("--film", type=Path, metavar="FILE", help="write a film too, .mp4 or .gif")
    asked = ask.parse_args()
    game = run(asked.seed, film=asked.film)
    print(f"{game.collisions} collisions, {int(game.pocketed[-1])} balls in pockets after {game.time[-1]:g} s,")
    print(f"energy and what was lost constant to {game.balance:.1e}")
    draw(game, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

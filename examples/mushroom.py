"""Bunimovich's mushroom: a billiard in which order and chaos live side by side, each exactly known.

    python -m examples.mushroom

In the cap, a half disc, a path keeps its distance b from the middle at every bounce, as it does in a circle. A path
with b above half the width w of the stem never enters it; all others do, sooner or later, and are chaotic. Of a start
that is uniform in the cap, in all directions, the part that stays is 1 - (asin s + s sqrt(1 - s^2)) 2/pi with s = w/2R:
78.31 % for this stem. The foot of the stem is open here, so that a particle that enters it is seen to leave.
"""

import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, outline, page

# The radius of the cap, the width of the stem and its length [m].
RADIUS, STEM, LENGTH = 1.0, 0.3424, 0.8
STAYS = 1.0 - (math.asin(0.5 * STEM / RADIUS) + 0.5 * STEM / RADIUS * math.sqrt(1.0 - (0.5 * STEM / RADIUS) ** 2)) * (
    2.0 / math.pi
)


class Run(NamedTuple):
    """What a run shows."""

    start: swarm.Particles
    distance: np.ndarray  # of each path from the middle at the start, in half widths of the stem
    escape_time: np.ndarray  # NaN of particles that stay

    def stays(self) -> np.ndarray:
        """Which particles stayed."""
        return np.isnan(self.escape_time)


def mushroom() -> swarm.Scene:
    """The table, with an open foot."""
    half = 0.5 * STEM
    cap = [(half, -LENGTH), (half, 0.0), (RADIUS, 0.0, 1.0), (-RADIUS, 0.0), (-half, 0.0), (-half, -LENGTH)]
    foot = swarm.Box((RADIUS, 0.1, 1.0), center=(0.0, -LENGTH, 0.0))
    return swarm.Scene([swarm.Polygon(cap, openings=[foot])], plane="z")


def run(count: int, until: float = 1000.0) -> Run:
    """A start that is uniform in the cap."""
    cap = swarm.Scene([swarm.Polygon([(RADIUS, 0.0, 1.0), (-RADIUS, 0.0)])], plane="z")
    start = swarm.fill(cap, count, speed=1.0, seed=1)
    (x, y, _z), (u, v, _w) = start.position, start.velocity
    result = swarm.simulate(mushroom(), start, swarm.Impact(), until=until)
    return Run(start, np.abs(x * v - y * u) / (0.5 * STEM), result.escape_time)


def draw(found: Run, file: Path) -> None:
    """Where each path starts and whether it stays, a path of each kind, and how many are left over time."""
    from swarm.pictures.style import BLUE, RED

    title = "Bunimovich's mushroom: particles that circle in the cap stay for ever, all others find the stem and leave"
    with page(file, title, 1, 3, (11.0, 3.9)) as axes:
        scene = mushroom()
        for one in axes[:2]:
            outline(one, scene)
        stays = found.stays()
        some = slice(0, 3000)
        for kept, color, name in ((stays[some], BLUE, "stay"), (~stays[some], RED, "leave")):
            starts = found.start.position[:2, some][:, kept]
            axes[0].plot(*starts, ".", color=color, markersize=2.5, markeredgewidth=0.0, label=name)
        axes[0].set(title="starts of 3000 particles")
        chosen = (
            (np.flatnonzero(stays)[3], BLUE, "stays"),
            (np.argsort(np.abs(found.escape_time - 40.0))[0], RED, "leaves"),
        )
        for who, color, name in chosen:
            axes[1].plot(*_path(scene, found.start, int(who)).T, color=color, linewidth=0.7, label=name)
        axes[1].set(title="a path of each kind, 40 s")
        for one in axes[:2]:
            one.legend(loc="lower right", markerscale=4.0)
        times = np.sort(np.nan_to_num(found.escape_time, nan=np.inf))
        left = 1.0 - np.arange(1, len(times) + 1) / len(times)
        law(axes[2], None, STAYS, f"law: {100.0 * STAYS:.2f} % stay")
        axes[2].semilogx(times, left, color=BLUE, label="run")
        axes[2].set(title="particles still inside", xlabel="time [s]", ylabel="part of the particles", ylim=(0.7, 1.0))
        axes[2].legend()


def _path(scene: swarm.Scene, start: swarm.Particles, who: int) -> np.ndarray:
    one = swarm.Particles(start.position[:, who], start.velocity[:, who])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "path.h5"
        swarm.simulate(scene, one, swarm.Impact(), until=40.0, every=0.01, trajectory=file)
        with swarm.load(file) as path:
            return np.array([path.frame(k).position[:2, 0] for k in range(len(path))])


def main() -> None:
    """Run, print and draw."""
    ask = Asked(__doc__, "mushroom.png", "plot")
    ask.add_argument("--particles", type=int, default=20_000)
    asked = ask.parse_args()
    found = run(asked.particles)
    stays, known = found.stays(), found.distance > 1.0
    error = math.sqrt(STAYS * (1.0 - STAYS) / len(stays))
    print(
        f"{100.0 * stays.mean():.2f} % stay, {100.0 * known.mean():.2f} % of the start must, +- {100.0 * error:.2f} %;"
    )
    print(f"the law: {100.0 * STAYS:.2f} %; {np.count_nonzero(known & ~stays)} left that must stay, ", end="")
    print(f"{np.count_nonzero(~known & stays)} have not left yet that will")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

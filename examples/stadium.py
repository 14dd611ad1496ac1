"""Bunimovich's stadium: how fast two neighbours part, as the Lyapunov exponent of the billiard.

    python -m examples.stadium

A neighbour at a distance x across the path, in a direction that differs by y, is at x + t y after a time t of unit
speed. A mirror of curvature k, hit at an angle a to its normal, turns (x, y) into (-x, -y + 2 k x/cos a). The log
of impacts says where and how each particle hits, so the exponent is the growth of ln |(x, y)| along the paths of one
run.

Lines alone part neighbours linearly with time, and a circle alone does too; both together exponentially.
"""

import math
import tempfile
from pathlib import Path

import numpy as np

import swarm

from .asked import Asked
from .page import law, outline, page

# The half circles of a `Stadium`, by the numbers of its sides.
ARCS = 1, 3
# The part of a run after which neighbours have forgotten how they began to part.
FORGOTTEN = 0.1
RATIOS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0)


def table(ratio: float) -> swarm.Scene:
    """The stadium of radius 1 m with lines that are `ratio` long."""
    return swarm.Scene([swarm.Stadium(radius=1.0, length=ratio)], plane="z")


def impacts(ratio: float, count: int, until: float) -> np.ndarray:
    """The impacts of particles that start anywhere, in any direction, of each particle in a row: (particles, most).

    Rows that are shorter have times beyond the run at their end.
    """
    scene = table(ratio)
    start = swarm.fill(scene, count, speed=1.0, seed=1)
    with tempfile.TemporaryDirectory() as folder:
        swarm.simulate(scene, start, swarm.Impact(), until=until, impacts=Path(folder) / "impacts.h5")
        with swarm.load_impacts(Path(folder) / "impacts.h5") as log:
            met = log.table()
    met = met[np.lexsort((met["time"], met["particle"]))]
    each = np.bincount(met["particle"], minlength=count)
    rows = np.zeros((count, each.max()), met.dtype)
    rows["time"] = math.inf
    first = np.cumsum(each) - each
    rows[met["particle"], np.arange(len(met)) - first[met["particle"]]] = met
    return rows


def exponents(ratio: float, count: int = 1000, until: float = 1000.0) -> np.ndarray:
    """The exponent [1/s] along the path of each particle, of speed 1 m/s."""
    rows = impacts(ratio, count, until)
    x, y = np.zeros(count), np.ones(count)
    grown, before, time = np.zeros(count), np.zeros(count), np.zeros(count)
    for met in rows.T:
        now = met["time"] < math.inf
        flown = np.where(now, met["time"], time) - time
        x, time = x + flown * y, time + flown
        middle = np.sign(met["position"][:, 0]) * 0.5 * ratio
        normal = met["position"][:, :2] - np.stack([middle, np.zeros(count)], axis=1)
        cosine = np.abs((normal * met["velocity_before"][:, :2]).sum(axis=1))
        bent = now & np.isin(met["member"], ARCS)
        kick = np.where(bent, 2.0 * x / np.where(bent, cosine, 1.0), 0.0)
        x, y = np.where(now, -x, x), np.where(now, -y + kick, y)
        size = np.hypot(x, y)
        grown += np.log(size)
        x, y = x / size, y / size
        before = np.where(time <= FORGOTTEN * until, grown, before)
    return (grown - before) / ((1.0 - FORGOTTEN) * until)


def measure(ratio: float, count: int = 1000, until: float = 1000.0) -> tuple[float, float]:
    """The exponent of the stadium and its standard error [1/s]."""
    found = exponents(ratio, count, until)
    return float(found.mean()), float(found.std() / math.sqrt(count))


def paths(ratio: float, apart: float, until: float, frames: int) -> np.ndarray:
    """The places of two particles that begin this far apart: (frames, 2, 2)."""
    position = np.array([[0.1, 0.1], [0.2, 0.2 + apart], [0.0, 0.0]])
    velocity = np.array([[math.cos(1.0)] * 2, [math.sin(1.0)] * 2, [0.0, 0.0]])
    with tempfile.TemporaryDirectory() as folder:
        file, step = Path(folder) / "pair.h5", until / frames
        swarm.simulate(
            table(ratio), swarm.Particles(position, velocity), swarm.Impact(), until=until, every=step, trajectory=file
        )
        with swarm.load(file) as pair:
            return np.array([pair.frame(k).position[:2].T for k in range(len(pair))])


def draw(found: list[tuple[float, float]], file: Path) -> None:
    """Two paths that part, their distance over time, and the exponent over the shape of the stadium."""
    from swarm.pictures.style import BLUE, GREEN, RED

    pair = paths(2.0, 1e-9, 60.0, 6000)
    title = "Bunimovich's stadium: two particles that begin a nanometre apart part exponentially"
    with page(file, title, 1, 3, (11.0, 3.6), width_ratios=(1.3, 1.0, 1.0)) as axes:
        outline(axes[0], table(2.0))
        last = 4600
        axes[0].plot(*pair[:last, 0].T, color=BLUE, linewidth=0.8, label="one")
        axes[0].plot(*pair[:last, 1].T, color=RED, linewidth=0.8, label="the other")
        axes[0].plot(*pair[0, 0], "o", color=BLUE, label="start of both")
        axes[0].set(title="their paths in 46 s at 1 m/s")
        axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3)
        time = np.linspace(0.0, 60.0, len(pair))
        axes[1].semilogy(time, np.hypot(*(pair[:, 1] - pair[:, 0]).T), color=GREEN, label="run")
        rate = found[RATIOS.index(2.0)][0]
        law(axes[1], time[:5000], 1e-9 * np.exp(rate * time[:5000]), f"law: exp({rate:.3f} t)", "--")
        axes[1].set(title="their distance", xlabel="time t [s]", ylabel="distance [m]", ylim=(1e-10, 10.0))
        axes[1].legend(loc="lower right")
        value, error = np.array(found).T
        axes[2].errorbar(RATIOS, value, error, fmt="o-", linewidth=0.8, color=GREEN)
        axes[2].set(title="Lyapunov exponent", xscale="log", ylim=(0.0, None))
        axes[2].set(xlabel="length of a straight side, in radii", ylabel="exponent, in speed over radius")
        axes[2].set_xticks([0.1, 1.0, 8.0], ["0.1", "1", "8"])


def main() -> None:
    """Run, print and draw."""
    ask = Asked(__doc__, "stadium.png", "plot")
    ask.add_argument("--particles", type=int, default=1000)
    asked = ask.parse_args()
    found = []
    for ratio in RATIOS:
        found.append(measure(ratio, asked.particles))
        print(f"lines of {ratio:g} radii: {found[-1][0]:.4f} +- {found[-1][1]:.4f} v/r")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

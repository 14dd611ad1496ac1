"""Thermal transpiration: two chambers of two temperatures, joined by a tube, do not come to one pressure.

    python -m examples.transpiration

In a gas without collisions as many particles go one way as the other, n1 v1 = n2 v2, with mean speeds that go with the
root of the temperature. So the pressures n k T settle at p1/p2 = (T1/T2)^(1/2), and not at 1 as in a dense gas. The
vessel is a union of three parts, each with its own law: the walls of the chambers send particles off with their
temperatures, those of the tube are elastic.
"""

import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

HALF, APART, BORE, LENGTH = 0.5, 1.3, 0.1, 0.4
# k_B T [J] of both chambers, of particles of mass 1 kg
TEMPERATURES = (1.0, 4.0)
RATIO = math.sqrt(TEMPERATURES[0] / TEMPERATURES[1])
# The part of a run after which the chambers have settled, and how many parts of the rest give the standard error.
SETTLED, PARTS = 0.2, 10


class Gas(NamedTuple):
    """What a run shows, frame by frame."""

    time: np.ndarray  # [s]
    pressure: np.ndarray  # (2, frames) of the chambers [Pa]
    ratio: float  # of the pressures, once they have settled
    error: float  # its standard error


def vessel() -> swarm.Union:
    """Two boxes and the tube between them, which reaches into both."""
    middle = 0.5 * APART
    chambers = [
        swarm.Box((HALF, HALF, HALF), (x, 0.0, 0.0), temperature=hot)
        for x, hot in zip((-middle, middle), TEMPERATURES, strict=True)
    ]
    return swarm.Union([chambers[0], swarm.Cylinder(BORE, (1.0, 0.0, 0.0), LENGTH), chambers[1]])


def pressures(gas: swarm.Particles) -> list[float]:
    """n k T of both chambers [Pa], each of 1 m^3, by the mean square of the speed."""
    x, squares = gas.position[0], (gas.velocity**2).sum(axis=0)
    return [float(squares[side * x > 0.5 * APART - HALF].sum()) / 3.0 for side in (-1.0, 1.0)]


def run(count: int, until: float, frames: int) -> Gas:
    """The pressures in both chambers, of particles that start with one density everywhere."""
    scene = swarm.Scene([vessel()])
    start = swarm.fill(scene, count, temperature=TEMPERATURES[0], seed=1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / frames, seed=2, trajectory=path)
        with swarm.load(path) as seen:
            time = np.array(seen.times)
            pressure = np.array([pressures(seen.frame(k)) for k in range(len(time))]).T
    settled = pressure[:, time > SETTLED * until]
    parts = np.array([part.mean(axis=1) for part in np.array_split(settled, PARTS, axis=1)])
    ratios = parts[:, 0] / parts[:, 1]
    mean = settled.mean(axis=1)
    return Gas(time, pressure, float(mean[0] / mean[1]), float(ratios.std(ddof=1) / math.sqrt(PARTS)))


def draw(gas: Gas, file: Path) -> None:
    """Both pressures and their ratio by time."""
    from swarm.pictures.style import BLUE, GREEN, RED

    title = "Two chambers of two temperatures, joined by a tube: their pressures settle, and not at one value"
    with page(file, title, 1, 2, (9.0, 3.8)) as axes:
        kinds = zip(gas.pressure, TEMPERATURES, (BLUE, RED), ("cold", "hot"), strict=True)
        for pressure, warmth, color, name in kinds:
            label = f"{name} chamber, $k_BT$ = {warmth:g} J"
            axes[0].plot(gas.time, pressure, color=color, linewidth=1.0, label=label)
        axes[0].set(title="pressures", ylabel="pressure [Pa]", ylim=(0.0, None))
        ratio = gas.pressure[0] / gas.pressure[1]
        axes[1].plot(gas.time, ratio, color=GREEN, linewidth=1.0, label="run")
        law(axes[1], None, RATIO, "law, $(T_1/T_2)^{1/2}$")
        axes[1].lines[-1].set_zorder(3)
        law(axes[1], None, 1.0, "dense gas: equal pressures", "--")
        axes[1].set(title="cold over hot", ylabel="ratio of the pressures", ylim=(0.0, 1.1))
        for one in axes:
            one.set(xlabel="time [s]", xlim=(0.0, gas.time[-1]))
            one.legend(loc="lower right")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "transpiration.png", "plot")
    ask.add_argument("--particles", type=int, default=4000)
    ask.add_argument("--until", type=float, default=8000.0, help="[s, default: %(default)s]")
    asked = ask.parse_args()
    gas = run(asked.particles, asked.until, 400)
    off = abs(gas.ratio - RATIO) / gas.error
    print(f"the pressures settle at {gas.ratio:.4f} +- {gas.error:.4f}, {off:.1f} standard errors off {RATIO:.4f}")
    draw(gas, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

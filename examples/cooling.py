"""Cooling: a gas without collisions loses energy to the walls of its box; a sweep over their restitution and the start.

    python -m examples.cooling

A particle that hits a wall keeps the part e of its normal velocity, so that 1/v grows by 1/e - 1 of itself in each
crossing: 1/v is linear in time, and the energy falls as 1/t^2, as by Haff's law (J. Fluid Mech. 134, 1983).
"""

import math
from pathlib import Path

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

SWEEP = Path(__file__).parent / "sweeps" / "cooling.toml"
WIDTH, SPEED = 0.2, 1.0
# Midpoints for integrals over the speed along an axis and the place at the start.
MIDPOINTS = (np.arange(400) + 0.5) / 400


def haff(restitution: float, times: np.ndarray) -> np.ndarray:
    """Mean energy over that of the start: the crossings of a direction last 1, q, q^2, ... of the first, q = 1/e."""
    q, v = 1.0 / restitution, SPEED * MIDPOINTS
    after_first = times[:, None, None] * v[:, None] / WIDTH - MIDPOINTS
    hits = np.floor(np.log(np.maximum(after_first, 0.0) * (q - 1.0) + q) / math.log(q) * (1.0 + 1e-15))
    kept = np.where(after_first > 0.0, q ** (-2.0 * hits), 1.0)
    return 3.0 * (v[:, None] ** 2 * kept).mean(axis=(1, 2))


def curves(folder: Path) -> dict[float, tuple[np.ndarray, np.ndarray]]:
    """For each restitution the times, and the energies over that of the start, (gases, frames)."""
    table = swarm.sweep(SWEEP, folder, resume=True, progress=True)
    found = {}
    for restitution, rows in table.groupby("surface.0.restitution"):
        energies = []
        for file in rows["file"]:
            with swarm.load(folder / file) as trajectory:
                energy = trajectory.observables["kinetic_energy"]
                energies.append(energy / energy[0])
                times = trajectory.times
        found[restitution] = times, np.array(energies)
    return found


def draw(found: dict[float, tuple[np.ndarray, np.ndarray]], file: Path) -> None:
    """Every gas as dots, the law as a line."""
    from swarm.pictures.style import CURVES

    with page(file, "A gas loses its energy to the walls of its box", 1, 1, (6.4, 4.6)) as (axes,):
        for colour, (restitution, (times, energies)) in zip(CURVES, found.items(), strict=False):
            first = colour == CURVES[0]
            law(
                axes, times[1:], haff(restitution, times[1:]), "law of this box, slope -2 in the end" if first else None
            )
            for energy in energies:
                axes.plot(times[1:], energy[1:], ".", color=colour, markersize=4)
            lost = f"walls leave {100.0 * restitution:g} % of the normal speed: {len(energies)} gases"
            axes.plot([], [], ".", color=colour, label=lost)
        axes.set(xscale="log", yscale="log", xlabel="time [s]", ylabel="energy, over that of the start")
        axes.legend(loc="lower left")


def main() -> None:
    """Sweep, draw and print."""
    ask = Asked(__doc__, "cooling.png", "plot", "table")
    ask.add_argument(
        "--folder", type=Path, help="of the sweep, which is resumed if it is there [default: the picture's name]"
    )
    asked = ask.parse_args()
    found = curves(asked.folder or asked.output.with_suffix(""))
    for restitution, (times, energies) in found.items():
        mean, error = energies[:, -1].mean(), energies[:, -1].std(ddof=1) / math.sqrt(len(energies))
        expected = haff(restitution, times[-1:])[0]
        print(f"e = {restitution:g}: {mean:.3e} of the energy is left, +- {error:.1e}; by the law {expected:.3e}")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

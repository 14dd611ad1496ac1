"""An elastic block that bounces on a plane: most of its fall turns into vibration, and the sum stays.

    python -m examples.bouncing_block

The block is made of tetrahedra of Saint Venant and Kirchhoff; each node that reaches the plane strikes it.
"""

from pathlib import Path

import numpy as np

import swarm
from swarm.bodies.elastic import block

from .asked import Asked
from .page import page

YOUNG, POISSON, DENSITY = 1e5, 0.3, 1000.0
SIZES, CELLS, HEIGHT = (0.2, 0.1, 0.1), (2, 1, 1), 0.1
STEP, EVERY = 2e-4, 2e-3


def run(until: float) -> swarm.Result:
    """The block, dropped at rest, for so many seconds."""
    body = swarm.elastic(block(SIZES, CELLS), YOUNG, POISSON, DENSITY)
    position = (body.points - body.points.min(axis=0) + np.array([0.0, 0.0, HEIGHT])).T[:, :, None]
    start = swarm.Bodies(body, position, np.zeros_like(position))
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0), swarm.Sphere(2.0)], gravity=(0.0, 0.0, -9.81))
    return swarm.simulate(scene, start, swarm.Impact(dt=STEP), until=until, every=EVERY)


def draw(seen: dict[str, np.ndarray], file: Path) -> None:
    """The energies over time, and how constant their sum is."""
    from swarm.pictures.style import ENERGIES, ink

    title = "An elastic block falls on a plane: most of its fall becomes vibration, and the sum stays"
    with page(file, title, 1, 2, (9.0, 3.9)) as (energies, error):
        named = {"kinetic": "kinetic", "potential": "of gravity", "contact": "elastic", "total": "sum"}
        for name, label in named.items():
            colour = ENERGIES.get(name, ink())
            energies.plot(seen["time"], seen[f"{name}_energy"], color=colour, linewidth=1.0, label=label)
        energies.set(title="energies", ylabel="energy [J]", ylim=(None, 1.25 * seen["total_energy"].max()))
        energies.legend(loc="upper center", ncols=4)
        error.plot(seen["time"], 1e15 * seen["energy_error"], ".", color=ink(), markersize=3, markeredgewidth=0.0)
        error.set(title="energy error: round-off", ylabel="relative error [$10^{-15}$]", ylim=(0.0, None))
        for one in (energies, error):
            one.set(xlabel="time [s]", xlim=(0.0, seen["time"][-1]))


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "bouncing_block.png", "plot")
    ask.add_argument("--until", type=float, default=2.0)
    asked = ask.parse_args()
    seen = run(asked.until).observables
    print(f"{seen['impacts'][-1]} impacts, energy error {seen['energy_error'].max():.1e}")
    print(f"largest share of the elastic energy {(seen['contact_energy'] / seen['total_energy']).max():.2f}")
    draw(seen, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

"""An elastic block that bounces on a plane: its fall turns into vibration and back, and the sum stays.

    python -m examples.bouncing_block

The block is made of tetrahedra of Saint Venant and Kirchhoff; each node that reaches the plane strikes it.
"""

import numpy as np

import swarm
from swarm.bodies.elastic import block

from .asked import Asked

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


def main() -> None:
    """Run, draw and print."""
    from .paper.plotting import BLUE, GREEN, GREY, RED, page

    ask = Asked(__doc__, "bouncing_block.png", "plot")
    ask.add_argument("--until", type=float, default=2.0)
    asked = ask.parse_args()
    seen = run(asked.until).observables
    print(f"{seen['impacts'][-1]} impacts, energy error {seen['energy_error'].max():.1e}")
    print(f"largest share of the elastic energy {(seen['contact_energy'] / seen['total_energy']).max():.2f}")
    with page(asked.output, "An elastic block bounces on a plane", 1, 2, (8.0, 3.2)) as (energies, error):
        named = {"kinetic": RED, "potential": GREEN, "contact": BLUE, "total": GREY}
        for name, color in named.items():
            label = "elastic" if name == "contact" else name
            energies.plot(seen["time"], seen[f"{name}_energy"], color=color, label=label)
        energies.set(title="energy", xlabel="time [s]", ylabel="energy [J]")
        energies.legend(loc="upper right", bbox_to_anchor=(1.0, 0.95), ncols=2)
        error.semilogy(seen["time"], np.maximum(seen["energy_error"], 1e-17), ".", color=BLUE, markersize=1.5)
        error.set(title="energy error", xlabel="time [s]", ylabel="relative")
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

"""A granular gas that cools by its own collisions: Haff's law.

    python -m examples.cooling_gas

Balls that meet keep the part e of their normal velocity. As long as the gas stays uniform its temperature falls as
1/(1 + t/tau)^2 (Haff, J. Fluid Mech. 134, 1983), 1/tau = (1 - e^2) w (1 + 3 a/16)/6 with w collisions of a ball in a
second at the start and a small a, for the velocities are not quite Maxwellian (van Noije and Ernst, Granular Matter 1,
1998). A large or a dense gas is not uniform for long: balls gather in clusters, and the law ends.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .hard_spheres import cell_of, collision_time, lattice
from .page import law, page

RESTITUTIONS = (0.95, 0.9, 0.8)
PACKING, SIDE, TAUS, FRAMES = 0.05, 20, 10.0, 60


class Cooled(NamedTuple):
    """A gas over time."""

    time: np.ndarray  # over tau
    energy: np.ndarray  # over that of the start
    collisions: int
    balance: float  # of the energy with what is lost, relative


def cooling_time(restitution: float, packing: float) -> float:
    """tau of Haff's law [s], of balls of diameter 1 m, 1 kg, and k T = 1 J at the start."""
    e = restitution
    a = 16.0 * (1.0 - e) * (1.0 - 2.0 * e * e) / (81.0 - 17.0 * e + 30.0 * e * e * (1.0 - e))
    return 6.0 * collision_time(packing) / ((1.0 - e * e) * (1.0 + 3.0 / 16.0 * a))


def run(restitution: float, side: int = SIDE, taus: float = TAUS, packing: float = PACKING) -> Cooled:
    """A gas from equilibrium on."""
    elastic, one = cell_of(packing, side), collision_time(packing)
    mixed = swarm.simulate(elastic, lattice(elastic, side), swarm.Impact(), until=30.0 * one, compile="always")
    scene = cell_of(packing, side, swarm.Pairs(restitution=restitution))
    tau = cooling_time(restitution, packing)
    result = swarm.simulate(
        scene, mixed.particles, swarm.Impact(), until=taus * tau, every=taus * tau / FRAMES, compile="always"
    )
    seen = result.observables
    energy = seen["kinetic_energy"]
    return Cooled(
        seen["time"] / tau, energy / energy[0], int(seen["collisions"][-1]), float(seen["energy_error"].max())
    )


def draw(found: dict[float, Cooled], file: Path) -> None:
    """The energy over time, and how far it is from the law."""
    from swarm.pictures.style import CURVES

    fine = np.geomspace(0.05, TAUS, 200)
    title = "A gas of balls that lose energy when they meet cools by Haff's law, and no longer when they cluster"
    with page(file, title, 1, 2, (9.0, 3.8)) as (temperature, off):
        law(temperature, fine, (1.0 + fine) ** -2.0, "Haff's law, $1/(1+t/\\tau)^2$")
        law(off, None, 0.0, "Haff's law")
        for (e, one), colour in zip(found.items(), CURVES, strict=False):
            haff = (1.0 + one.time) ** -2.0
            temperature.plot(one.time[1:], one.energy[1:], ".", color=colour, label=f"restitution {e:g}")
            off.plot(one.time, 100.0 * (one.energy / haff - 1.0), color=colour, label=f"restitution {e:g}")
        temperature.set(xscale="log", yscale="log", title="temperature", ylabel="over that of the start")
        off.set(title="temperature, less the law", ylabel="part of the law [%]", ylim=(-5.0, 5.0))
        for axes in (temperature, off):
            axes.set(xlabel=r"time, over Haff's $\tau$")
            axes.legend(loc="lower left")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "cooling_gas.png", "plot")
    ask.add_argument("--side", type=int, default=SIDE, help="balls along a side [default: %(default)s]")
    asked = ask.parse_args()
    found = {e: run(e, asked.side) for e in RESTITUTIONS}
    for e, one in found.items():
        law = (1.0 + one.time) ** -2.0
        k = int(np.searchsorted(one.time, 4.0))
        print(
            f"e = {e:g}: {one.collisions} collisions; {one.energy[k]:.5f} of the energy is left at {one.time[k]:.3g} "
            f"tau, by the law {law[k]:.5f}; energy and what was lost constant to {one.balance:.1e}"
        )
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

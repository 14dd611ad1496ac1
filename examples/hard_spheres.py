"""A gas of hard spheres in a cell that repeats: its equation of state beside the known ones, of 1969 and of 2004.

    python -m examples.hard_spheres

The pressure is that of the virial: p V = 2 K/3 + (the sum of r_ij . J_ij over the collisions)/(3 t). Balls start on a
simple cubic lattice, which melts, and are measured when each has met others a hundred times.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

PACKINGS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.49)
# The balls along a side of the lattice; collisions of each before it is measured; frames.
SIDE, BEFORE, FRAMES = 10, 100, 40


class Measured(NamedTuple):
    """A run at one packing."""

    compressibility: float  # Z = p V/(N k T)
    error: float  # its standard error
    collisions: int


def carnahan_starling(packing: float | np.ndarray) -> float | np.ndarray:
    """Z = p V/(N k T) of a fluid of hard spheres (J. Chem. Phys. 51, 1969)."""
    y = packing
    return (1.0 + y + y**2 - y**3) / (1.0 - y) ** 3


# Of powers of y/(1 - y).
_KOLAFA = {
    0: 1.0, 1: 4.0, 2: 6.0, 3: 2.3647684, 4: -0.8698551, 5: 1.1062803, 6: -1.1014221, 7: 0.66605866, 8: -0.03633431,
    10: -0.20965164, 14: 0.10555569, 22: -0.00872380,
}  # fmt: skip


def kolafa(packing: float | np.ndarray) -> float | np.ndarray:
    """Z of simulations, to their errors (Kolafa, Labik and Malijevsky, Phys. Chem. Chem. Phys. 6, 2004)."""
    x = packing / (1.0 - packing)
    return sum(factor * x**power for power, factor in _KOLAFA.items())


def contact_value(packing: float) -> float:
    """g, the pair distribution of spheres that touch: Z = 1 + 4 g packing."""
    return float((1.0 - 0.5 * packing) / (1.0 - packing) ** 3)


def collision_time(packing: float) -> float:
    """The mean time between two collisions of a ball of diameter 1 m, 1 kg, k T = 1 J, by Enskog's theory [s]."""
    density = packing / (np.pi / 6.0)
    return float(1.0 / (4.0 * np.sqrt(np.pi) * density * contact_value(packing)))


def cell_of(packing: float, side: int, pairs: swarm.Pairs | None = None) -> swarm.Scene:
    """A cell without walls for side^3 balls of diameter 1 m."""
    length = side * (np.pi / 6.0 / packing) ** (1.0 / 3.0)
    return swarm.Scene([], period=(length, length, length), pairs=pairs)


def lattice(scene: swarm.Scene, side: int, seed: int = 1) -> swarm.Particles:
    """side^3 balls of diameter 1 m and 1 kg on a cubic lattice, which melts; k T = 1 J, and no momentum."""
    assert scene.period is not None
    line = (np.arange(side) + 0.5) * (scene.period[0] / side)
    position = np.stack(np.meshgrid(line, line, line, indexing="ij")).reshape(3, -1)
    velocity = np.random.default_rng(seed).normal(size=position.shape)
    velocity -= velocity.mean(axis=1, keepdims=True)
    velocity *= np.sqrt(3.0 * (position.shape[1] - 1) / (velocity**2).sum())
    return swarm.Particles(position, velocity, radius=0.5)


def measure(packing: float, collisions: int, side: int = SIDE) -> Measured:
    """Z from so many collisions, and its standard error from the spread of the frames."""
    scene, n = cell_of(packing, side), side**3
    start, one = lattice(scene, side), collision_time(packing)
    mixed = swarm.simulate(scene, start, swarm.Impact(), until=BEFORE * one, compile="always").particles
    span = 2.0 * collisions / n * one
    result = swarm.simulate(scene, mixed, swarm.Impact(), until=span, every=span / FRAMES, compile="always")
    seen = result.observables
    # With the momentum at rest there are 3 (N - 1) degrees of freedom: k T = 2 K/(3 (N - 1)).
    twice = 2.0 * seen["kinetic_energy"][1:]
    volume = float(np.prod(np.array(scene.period)))
    z = 1.0 + (3.0 * volume * seen["pressure"][1:] - twice) / twice * (n - 1) / n
    return Measured(float(z.mean()), float(z.std(ddof=1) / np.sqrt(len(z))), int(seen["collisions"][-1]))


def draw(found: dict[float, Measured], file: Path) -> None:
    """Z over the packing, and how far it is from the law."""
    from swarm.pictures.style import BLUE, GREEN

    packing, fine = np.array(list(found)), np.linspace(0.0, 0.5, 200)
    z, error = (np.array([one[k] for one in found.values()]) for k in range(2))
    starling = np.asarray(carnahan_starling(packing))
    title = "The pressure of a gas of hard spheres follows the known equations of state to 0.3 %"
    with page(file, title, 1, 2, (9.0, 3.8)) as axes:
        run = {"fmt": "o", "color": BLUE, "label": "run, with standard errors"}
        law(axes[0], fine, carnahan_starling(fine), "Carnahan and Starling, 1969")
        axes[0].errorbar(packing, z, error, **run)
        axes[0].set(title="pressure, over that of an ideal gas", ylabel="$pV/NkT$", ylim=(0.0, None))
        law(axes[1], None, 0.0, "Carnahan and Starling")
        better = 100.0 * (kolafa(fine) / carnahan_starling(fine) - 1.0)
        axes[1].plot(fine, better, color=GREEN, label="Kolafa, Labík, Malijevský, 2004")
        axes[1].errorbar(packing, 100.0 * (z / starling - 1.0), 100.0 * error / starling, **run)
        axes[1].set(title="the same, less Carnahan and Starling", ylabel="difference [%]", ylim=(-0.5, 0.5))
        for one, place in zip(axes, ("upper left", "lower left"), strict=True):
            one.set(xlabel="packing: part of the volume within balls", xlim=(0.0, 0.51))
            one.legend(loc=place)


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "hard_spheres.png", "plot")
    ask.add_argument("--collisions", type=int, default=1_000_000)
    asked = ask.parse_args()
    found = {}
    print("packing  p V/(N k T)  error   Carnahan and Starling  off       Kolafa   off")
    for packing in PACKINGS:
        found[packing] = one = measure(packing, asked.collisions)
        laws = carnahan_starling(packing), kolafa(packing)
        off = [100.0 * (one.compressibility / law - 1.0) for law in laws]
        print(
            f"{packing:<8g} {one.compressibility:<12.4f} {one.error:.4f}  {laws[0]:<22.4f} {off[0]:+.2f} %   ", end=""
        )
        print(f"{laws[1]:<8.4f} {off[1]:+.2f} %", flush=True)
    print(f"{sum(one.collisions for one in found.values()):.1e} collisions")
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

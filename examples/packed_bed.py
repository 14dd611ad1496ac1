"""A gas in a bed of thousands of balls that overlap: its mean free path is known exactly, and how it diffuses is not.

    python -m examples.packed_bed

The balls lie at random in a cell that repeats. Particles fly freely from ball to ball (Knudsen's regime), off smooth
balls as from mirrors, off rough ones in any direction, as from a wall with a temperature.

* The mean length of a flight is 4 V/S, of the volume V and the surface S of the pores. For balls at random, n in a unit
  of volume, both have the factor exp(-n 4 pi a^3/3), the porosity: 4 V/S = 1/(n pi a^2), however much they overlap.
* With few balls D is v l/3 of flights of mean length l if they are smooth, for a ball scatters in all directions alike,
  and 9/13 of it if they are rough: their mean cosine is -4/9 (Derjaguin's law of Knudsen diffusion).
* With many balls pores close, and nothing diffuses below a porosity of 0.0317 (Priour, arXiv:1208.0328).
"""

import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page, solid

POROSITIES = (0.98, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.15, 0.1)
CLOSED, ROUGH_LIMIT = 0.0317, 9.0 / 13.0
# k_B T of rough balls and of the gas [J], of particles of 1 kg; smooth balls keep the speed of 1 m/s.
TEMPERATURE = 1.0
# Displacements are taken from one time to twice that time, in mean free flights.
FLIGHTS, PACKINGS = 200.0, 6


class Bed(NamedTuple):
    """What packings of the same balls show: means over them, and standard errors by their spread."""

    porosity: tuple[float, float]
    free_path: tuple[float, float]  # over 1/(n pi a^2)
    diffusion: tuple[float, float]  # over v/(3 n pi a^2)
    impacts: int


def radius(porosity: float, balls: int) -> float:
    """Of so many balls in a unit cube: exp(-n 4 pi a^3/3) is the porosity."""
    return float((-3.0 * np.log(porosity) / (4.0 * np.pi * balls)) ** (1.0 / 3.0))


def packing(porosity: float, balls: int, rough: bool, seed: int) -> swarm.Scene:
    """Balls at random in a unit cube that repeats."""
    centers = np.random.default_rng(seed).uniform(0.0, 1.0, (balls, 3))
    law = {"temperature": TEMPERATURE} if rough else {}
    return swarm.Scene([swarm.Spheres(centers, radius(porosity, balls), **law)], period=(1.0, 1.0, 1.0))


def run(porosity: float, rough: bool, balls: int = 4_000, count: int = 1_000, flights: float = FLIGHTS) -> Bed:
    """A gas of so many particles in each of some packings."""
    path = 1.0 / (balls * np.pi * radius(porosity, balls) ** 2)
    speed = np.sqrt(8.0 * TEMPERATURE / np.pi) if rough else 1.0
    until, rows, impacts = flights * path / speed, [], 0
    for seed in range(PACKINGS):
        scene = packing(porosity, balls, rough, seed)
        start = swarm.fill(scene, count, **({"temperature": TEMPERATURE} if rough else {"speed": 1.0}), seed=seed)
        half = swarm.simulate(scene, start, swarm.Impact(), until=until, seed=2 * seed)
        end = swarm.simulate(scene, half.particles, swarm.Impact(), until=until, seed=2 * seed + 1)
        places = [scene.unwrapped(one) for one in (start, half.particles, end.particles)]
        moved = [((place - places[0]) ** 2).sum(axis=0).mean() for place in places[1:]]
        hits = half.impacts_per_particle.sum() + end.impacts_per_particle.sum()
        # <r^2> = 6 D t + c, as soon as the memory is lost.
        diffusion = (moved[1] - moved[0]) / (6.0 * until)
        rows.append((start.volume, 2.0 * until * speed * count / hits / path, diffusion / (speed * path / 3.0)))
        impacts += int(hits)
    mean, error = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1) / np.sqrt(PACKINGS)
    return Bed(*zip(mean.tolist(), error.tolist(), strict=True), impacts)


def draw(found: dict[bool, dict[float, Bed]], file: Path) -> None:
    """A section of a bed, mean free path and diffusion over the porosity."""
    from swarm.pictures.style import BLUE, ORANGE, RED

    title = "A gas in a bed of balls that overlap: its free path is known exactly, its diffusion falls as pores close"
    with page(file, title, 1, 3, (11.0, 3.9)) as axes:
        centers, size = packing(0.4, 4_000, rough=False, seed=0).surfaces[0].centers, radius(0.4, 4_000)
        for x, y, z in centers:
            if abs(z - 0.5) < size:
                solid(axes[0], (x, y), np.sqrt(size**2 - (z - 0.5) ** 2))
        axes[0].set(xlim=(0.25, 0.75), ylim=(0.25, 0.75), aspect="equal", xlabel="x [m]", ylabel="y [m]")
        axes[0].grid(False)
        axes[0].set_title("section of a bed, 40 % of it is free")
        for rough, colour, name in ((False, BLUE, "smooth balls"), (True, RED, "rough balls")):
            beds = list(found[rough].values())
            porosity = [bed.porosity[0] for bed in beds]
            dots = {"fmt": "o", "color": colour, "label": name}
            axes[1].errorbar(porosity, *np.transpose([bed.free_path for bed in beds]), **dots)
            axes[2].errorbar(porosity, *np.transpose([bed.diffusion for bed in beds]), **dots)
            star: dict[str, Any] = {"label": "law of few balls"} if rough else {}
            axes[2].plot(1.0, ROUGH_LIMIT if rough else 1.0, "*", color=colour, markersize=11, clip_on=False, **star)
        law(axes[1], None, 1.0, "law, $1/n\\pi a^2$")
        axes[1].set(title="mean free path", ylabel="over $1/n\\pi a^2$", ylim=(0.96, 1.04))
        axes[2].axvline(CLOSED, color=ORANGE, label="pores are closed")
        axes[2].set(title="diffusion coefficient", ylabel="over $v/3n\\pi a^2$", ylim=(0.0, 1.1))
        for one, place in zip(axes[1:], ("upper right", "lower right"), strict=True):
            one.set(xlabel="porosity: part that is free", xlim=(0.0, 1.0))
            one.legend(loc=place)


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "packed_bed.png", "plot")
    ask.add_argument("--balls", type=int, default=4_000)
    asked = ask.parse_args()
    found: dict[bool, dict[float, Bed]] = {False: {}, True: {}}
    print("balls   porosity  found    error    free path n pi a^2  error    D over v l/3  error    impacts  time [s]")
    for rough, beds in found.items():
        for porosity in POROSITIES:
            began = time.perf_counter()
            beds[porosity] = bed = run(porosity, rough, asked.balls)
            (kept, off), (path, path_off), (value, value_off) = bed.porosity, bed.free_path, bed.diffusion
            print(
                f"{'rough' if rough else 'smooth':<7} {porosity:<9g} {kept:.4f}   {off:.4f}   {path:<18.4f}", end="  "
            )
            print(f"{path_off:.4f}   {value:<12.4f}  {value_off:.4f}   {bed.impacts:<7.1e}", end="  ")
            print(f"{time.perf_counter() - began:.1f}", flush=True)
    draw(found, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

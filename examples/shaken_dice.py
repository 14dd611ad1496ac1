"""Dice in a cup that is shaken and put down: each face comes up as often as every other.

    python -m examples.shaken_dice

The path of the cup, a box, is a spline: it goes up, down and aside for a second and then rests. Its walls push, strike
and rub the dice, and what they do is in `wall_work`: the energy of the dice is that at the start, what the cup has
given, less what impacts and friction have taken, to round-off. The dice do not notice each other, so that each is a
throw by itself. Needs the extra `plot`.
"""

import itertools
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

EDGE, DENSITY, GRAVITY, STEP = 0.016, 1200.0, 9.81, 2e-3
CUP = (0.06, 0.06, 0.08)
# The cup is shaken until then [s], by so much [m].
SHAKEN, FAR = 1.0, 0.08
# Chi squared of six faces, five of which are free, is below this in 99 of 100 runs.
LIKELY = 15.09
# The cosine of the angle of a face that is up.
FLAT = 0.999
FACES = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [-1, 0, 0]], dtype=float)


class Thrown(NamedTuple):
    """What a run shows: the energies [J] in time [s], and which faces are up at the end."""

    time: np.ndarray
    energy: np.ndarray
    work: np.ndarray
    lost: np.ndarray
    faces: np.ndarray  # (6,) dice that show each
    leaning: int  # dice that show none
    energy_error: float


def path(until: float = 2.0, seed: int = 1) -> swarm.Path:
    """Of the cup: from where it is to random places, one after the other, and back, where it rests."""
    tenths = math.ceil(10.0 * max(until, SHAKEN)) + 2
    times = 0.1 * SHAKEN * np.arange(tenths)
    places = np.random.default_rng(seed).uniform(-FAR, FAR, (tenths, 3))
    places[0], places[10:] = 0.0, 0.0
    return swarm.Path(tuple(times.tolist()), tuple(map(tuple, places.tolist())))


def axes_of(bodies: swarm.Bodies) -> np.ndarray:
    """The turns (3, 3, n) of the dice from how they are made."""
    centre = bodies.position.mean(axis=1, keepdims=True)
    turned: np.ndarray = np.einsum("xpn,py->xyn", bodies.position - centre, np.linalg.pinv(bodies.body.points).T)
    return turned


def run(count: int = 60, until: float = 2.0, every: float = 0.02, compiling: str = "auto") -> Thrown:
    """The throw of so many dice."""
    corners = 0.5 * EDGE * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    cup = swarm.Box(CUP, motion=path(), restitution=0.5, friction=0.3)
    scene = swarm.Scene([cup], (0.0, 0.0, -GRAVITY))
    start = swarm.place(scene, swarm.rigid(corners, DENSITY), count, speed=0.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(dt=STEP), until=until, every=every, compile=compiling)
    assert result.bodies is not None
    up = np.einsum("fy,yn->fn", FACES, axes_of(result.bodies)[2])
    shown = up.max(axis=0) > FLAT
    faces = np.bincount(up.argmax(axis=0)[shown], minlength=6)
    seen = result.observables
    return Thrown(
        seen["time"], seen["total_energy"], seen["wall_work"].sum(axis=1), seen["dissipated_energy"], faces,
        int((~shown).sum()), float(seen["energy_error"].max()),
    )  # fmt: skip


def chi_squared(faces: np.ndarray) -> float:
    """How far frequencies are from equal ones."""
    return float(((faces - faces.mean()) ** 2).sum() / faces.mean())


def draw(thrown: Thrown, file: Path) -> None:
    """The balance of energy over time, and how often each face is up."""
    from swarm.pictures.style import BLUE

    with page(file, "Dice in a cup that is shaken for a second and put down", 1, 2, (9.0, 4.0)) as (left, right):
        for name, values in (("work of the cup", thrown.work), ("lost", thrown.lost)):
            left.plot(thrown.time, 1e3 * values, label=name)
        left.plot(thrown.time, 1e3 * (thrown.energy - thrown.energy[0]), label="gained by the dice")
        law(left, thrown.time, 1e3 * (thrown.work - thrown.lost), "work - lost")
        left.set(xlabel="time [s]", ylabel="energy [mJ]", title=f"balance to {thrown.energy_error:.0e}")
        left.legend()
        right.bar(np.arange(1, 7), thrown.faces, color=BLUE)
        mean = thrown.faces.mean()
        law(right, np.array([0.5, 6.5]), np.array([mean, mean]), f"a sixth, within {math.sqrt(mean):.0f}")
        right.set(xlabel="face", ylabel="dice", title=rf"$\chi^2$ = {chi_squared(thrown.faces):.1f} (5 free)")
        right.set_ylim(0.0, 1.3 * thrown.faces.max())
        right.legend(loc="upper right")


def main() -> None:
    """Run, draw and print."""
    asked = Asked(__doc__, "shaken_dice.png", "plot").parse_args()
    thrown = run()
    lean = f", {thrown.leaning} lean or stand on an edge" if thrown.leaning else ""
    print(f"dice that show the faces 1 to 6: {thrown.faces.tolist()}{lean}")
    print(f"chi squared {chi_squared(thrown.faces):.1f}, below {LIKELY} in 99 of 100 runs of fair dice")
    print(f"work of the cup {1e3 * thrown.work[-1]:.4g} mJ, lost {1e3 * thrown.lost[-1]:.4g} mJ")
    print(f"worst energy error of a die {thrown.energy_error:.1e}")
    draw(thrown, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

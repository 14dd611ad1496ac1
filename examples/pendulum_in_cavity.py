"""A double pendulum that swings inside a cavity: its bobs strike the wall of a ball, and the energy stays.

    python -m examples.pendulum_in_cavity

Two bobs on rigid rods hang from a fixed point below the top of a spherical cavity; the second reaches beyond its wall.
"""

import tempfile
from pathlib import Path

import numpy as np

import swarm

from .asked import Asked
from .page import page

RADIUS, RODS, MASSES, GRAVITY = 0.5, (0.4, 0.4), (1.0, 1.0), 9.81
TOP = (0.0, 0.0, 0.35)
STEP, EVERY = 1e-3, 5e-3


def start() -> swarm.Bodies:
    """At rest, both rods nearly level."""
    x, y, z = TOP
    bobs = [TOP, (x + RODS[0] * np.sin(1.2), y, z - RODS[0] * np.cos(1.2)), (0.05, 0.0, 0.0)]
    bobs[2] = tuple(bobs[1] + RODS[1] * (np.array(bobs[2]) - bobs[1]) / np.linalg.norm(np.array(bobs[2]) - bobs[1]))
    body = swarm.Body(bobs, mass=[1.0, *MASSES], links=[(0, 1), (1, 2)], anchors={0: None})
    return swarm.Bodies(body, body.points.T[:, :, None], np.zeros((3, 3, 1)))


def run(until: float, order: int = 2, file: Path | None = None) -> swarm.Result:
    """The pendulum for so many seconds."""
    scene = swarm.Scene([swarm.Sphere(RADIUS)], gravity=(0.0, 0.0, -GRAVITY))
    return swarm.simulate(
        scene, start(), swarm.Impact(dt=STEP, order=order), until=until, every=EVERY, trajectory=file,
        precision="float64",
    )  # fmt: skip


def draw(seen: dict[str, np.ndarray], paths: list[np.ndarray], file: Path) -> None:
    """The paths of both bobs from the side, and the energies over time."""
    from swarm.pictures.style import BLUE, CAVITY, CAVITY_LINE, RED, ink

    title = "A double pendulum in a ball strikes its wall: after every blow the energy is what it was"
    with page(file, title, 1, 2, (9.0, 4.0)) as (side, error):
        circle = np.linspace(0.0, 2.0 * np.pi, 400)
        side.fill(RADIUS * np.cos(circle), RADIUS * np.sin(circle), facecolor=CAVITY, edgecolor=CAVITY_LINE, alpha=0.4)
        for path, color, name in zip(paths, (RED, BLUE), ("upper bob", "lower bob"), strict=True):
            side.plot(path[0, :1000], path[2, :1000], color=color, linewidth=0.7, label=name)
        rods = np.array([TOP, *(path[:, 0] for path in paths)])
        side.plot(rods[:, 0], rods[:, 2], "o-", color=ink(), label="rods at the start")
        side.set(title="both bobs for 5 s, from the side", xlabel="x [m]", ylabel="z [m]", aspect="equal")
        side.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        error.plot(seen["time"], 1e13 * seen["energy_error"], ".", color=ink(), markersize=3, markeredgewidth=0.0)
        largest = 1e13 * seen["energy_error"].max()
        error.set(title="energy error", ylim=(0.0, 1.3 * largest), xlim=(0.0, seen["time"][-1]))
        error.set(xlabel="time [s]", ylabel="relative error [$10^{-13}$]")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "pendulum_in_cavity.png", "plot")
    ask.add_argument("--until", type=float, default=20.0)
    asked = ask.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        seen = run(asked.until, file=Path(folder) / "pendulum.h5").observables
        with swarm.load(Path(folder) / "pendulum.h5") as trajectory:
            paths = [trajectory.particle(point)[0] for point in (1, 2)]
    print(f"{seen['impacts'][-1]} impacts, energy error {seen['energy_error'].max():.1e}")
    print(
        f"rods {seen['link_error'].max():.1e} of their lengths, deepest {seen['max_penetration'].max():.1e} m outside"
    )
    draw(seen, paths, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

"""A blender from an STL file: a twisted blade turns in a bowl of grains, and mixes those of both sides.

    python -m examples.blender

Grains that lie left and right of the axis are of two colours. How well they are mixed is known by their neighbours: the
index is the part of the six nearest grains that are of the other colour, over that in a perfect mixture. It begins near
0, where the colours meet in one plane alone, and is 1 on average of any numbers drawn. Needs the extra `plot`.
"""

import itertools
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .bottle_from_stl import write_stl
from .page import page, vessel

RADIUS, DENSITY, GRAVITY = 0.003, 2500.0, 9.81
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
# The bowl, and of the blade half the length, half the height and the thickness [m], its twist and its height above.
BOWL, HEIGHT = 0.04, 0.09
HALF, TALL, THICK, TWIST, FLOOR = 0.039, 0.009, 0.003, math.radians(40.0), 0.001
STATIONS = 9
TURNS = 1.5  # a second
STIFFNESS, STEP = 800.0, 1e-4
NEIGHBOURS = 6


class Stirred(NamedTuple):
    """What a run shows, frame by frame."""

    mesh: swarm.Mesh
    time: np.ndarray
    index: np.ndarray
    places: np.ndarray  # (frames, 3, grains) [m]
    left: np.ndarray  # (grains,) whether a grain was left of the axis
    work: float  # of the blade [J]
    energy_error: float


def blade() -> list[np.ndarray]:
    """The triangles of the blade: a bar along x with a section that turns about x, so that both of its arms lift."""
    section = np.array([[-0.5 * THICK, -TALL], [0.5 * THICK, -TALL], [0.5 * THICK, TALL], [-0.5 * THICK, TALL]])
    rings = []
    for x in np.linspace(-HALF, HALF, STATIONS):
        angle = TWIST * math.sin(0.5 * math.pi * x / HALF)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        rings.append(np.column_stack([np.full(4, x), section @ turn.T]))
    first, last = rings[0], rings[-1]
    triangles = [first[[0, 2, 1]], first[[0, 3, 2]], last[[0, 1, 2]], last[[0, 2, 3]]]
    for low, high in itertools.pairwise(rings):
        for k in range(4):
            m = (k + 1) % 4
            triangles += [np.array([low[k], low[m], high[m]]), np.array([low[k], high[m], high[k]])]
    return triangles


def mixing(places: np.ndarray, left: np.ndarray) -> float:
    """The part of the nearest grains that are of the other colour, over that in a perfect mixture."""
    from scipy.spatial import cKDTree

    _away, near = cKDTree(places.T).query(places.T, NEIGHBOURS + 1)
    others = (left[near[:, 1:]] != left[:, None]).mean()
    n, m = len(left), int(left.sum())
    return float(others / (2.0 * m * (n - m) / (n * (n - 1))))


def run(count: int, settle: float = 0.3, stir: float = 3.0, every: float = 0.02, turns: float = TURNS) -> Stirred:
    """Grains that have come to rest around the blade, and are stirred then."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "blade.stl"
        write_stl(path, {"blade": blade()})
        height = -0.5 * HEIGHT + FLOOR + TALL
        mesh = swarm.Mesh(path, side="outside", scale=1e-3, center=(0.0, 0.0, height), friction=0.3, restitution=0.5)
    bowl = swarm.Cylinder(BOWL, (0.0, 0.0, 1.0), HEIGHT, friction=0.3, restitution=0.5)
    scene = swarm.Scene([bowl, mesh], (0.0, 0.0, -GRAVITY), pairs=swarm.Pairs(restitution=0.5, friction=0.3))
    method = swarm.Penalty(dt=STEP, penalty=STIFFNESS, exponent=1.0)
    start = swarm.fill(scene, count, speed=0.0, mass=MASS, radius=RADIUS, seed=1)
    rest = swarm.simulate(scene, start, method, until=settle).particles if settle > 0.0 else start
    left = rest.position[0] < 0.0
    turning = replace(mesh, motion=swarm.Rotation((0.0, 0.0, 1.0), 2.0 * math.pi * turns))
    frames: list[np.ndarray] = []
    result = swarm.simulate(
        swarm.Scene([bowl, turning], scene.gravity, pairs=scene.pairs), rest, method, until=stir, every=every,
        observables={"places": lambda frame: frames.append(frame.position.copy()) or 0.0},
    )  # fmt: skip
    seen, places = result.observables, np.array(frames)
    index = np.array([mixing(here, left) for here in places])
    return Stirred(
        turning, seen["time"], index, places, left, float(seen["wall_work"][-1, 1]), float(seen["energy_error"].max())
    )


def draw(stirred: Stirred, file: Path) -> None:
    """The blade in its grains at the start and at the end, and the index of mixing over time."""
    from swarm import motion
    from swarm.pictures.style import BLUE, CAVITY_LINE, ORANGE

    mesh = stirred.mesh
    with page(file, "A blade from an STL file stirs grains", 1, 3, (10.8, 3.8)) as (first, last, axes):
        for place, k in ((first, 0), (last, -1)):
            shape = place.figure.add_subplot(place.get_subplotspec(), projection="3d")
            place.remove()
            pose = motion.pose(mesh.motion, float(stirred.time[k]))
            corners = pose.placed(mesh.corners.T).T
            vessel(shape, [(corners[mesh.triangles], CAVITY_LINE)], stirred.places[k][:, :0])
            for some, colour in ((stirred.left, BLUE), (~stirred.left, ORANGE)):
                shape.scatter(*stirred.places[k][:, some], s=30, color=colour, edgecolor="none", alpha=0.8)
            shape.view_init(elev=42.0, azim=-60.0)
            shape.set_box_aspect((2.0, 2.0, 1.0), zoom=1.25)
            shape.set(xlim=(-BOWL, BOWL), ylim=(-BOWL, BOWL), zlim=(-0.5 * HEIGHT, -0.5 * HEIGHT + BOWL))
            shape.set_title(f"{len(mesh)} triangles, {len(stirred.left)} grains at {stirred.time[k]:.2g} s")
        axes.plot(stirred.time * TURNS, stirred.index, color=BLUE)
        axes.axhline(1.0, color=CAVITY_LINE, linewidth=0.8, linestyle="--")
        axes.set(xlabel="turns of the blade", ylabel="index of mixing", title="neighbours of the other colour")
        axes.set_ylim(0.0, 1.1)


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "blender.png", "plot")
    ask.add_argument("--count", type=int, default=400)
    asked = ask.parse_args()
    stirred = run(asked.count)
    print(f"{stirred.mesh}: index of mixing {stirred.index[0]:.2f} at the start, {stirred.index[-1]:.2f} at the end")
    print(f"the blade did {1e3 * stirred.work:.2f} mJ; worst relative energy error {stirred.energy_error:.1e}")
    draw(stirred, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

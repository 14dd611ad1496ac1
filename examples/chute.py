"""A chute and a box without a lid, of open sheets from an STL file: grains roll down, fly off the lip and are caught.

    python -m examples.chute

The file is not watertight: with `open=True` each triangle is a wall from both sides, whichever way it is turned. A ball
that rolls without slipping has five sevenths of the acceleration of one that slides without friction, g sin(angle); so
it is known when each grain comes to the lip, how fast it is there, and where it flies. All of them end in the box.
Needs the extra `plot`.
"""

import itertools
import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .bottle_from_stl import write_stl
from .page import law, page, vessel

GRAVITY, ANGLE, RADIUS, DENSITY = 9.81, math.radians(20.0), 0.01, 2500.0
# The length of the chute along its slope and the height of its lip, at x = 0; widths and heights of walls [m].
LENGTH, LIP, WIDTH, WALL = 0.6, 0.3, 0.14, 0.04
TRAY, DEPTH = (0.06, 0.42, 0.12), 0.1
STIFFNESS, STEP = 2e4, 2e-4
DOWN, NORMAL = np.array([math.cos(ANGLE), 0.0, -math.sin(ANGLE)]), np.array([math.sin(ANGLE), 0.0, math.cos(ANGLE)])
PULL = 5.0 / 7.0 * GRAVITY * math.sin(ANGLE)


class Caught(NamedTuple):
    """What a run shows: the sheets, the frames and how far grains that have not landed are from the law [m]."""

    mesh: swarm.Mesh
    time: np.ndarray
    places: np.ndarray  # (frames, 3, grains) [m]
    way: np.ndarray  # to the lip at the start (grains,) [m]
    off: float
    in_box: int
    energy_error: float


def sheets() -> dict[str, list[np.ndarray]]:
    """The triangles of the chute and of the box, each three corners [m]."""
    top, side, up = -LENGTH * DOWN + (0.0, 0.0, LIP), np.array([0.0, 0.5 * WIDTH, 0.0]), WALL * NORMAL
    lip = np.array([0.0, 0.0, LIP])
    chute = [quad(top - side, top + side, lip + side, lip - side)]
    chute += [quad(top + s, lip + s, lip + s + up, top + s + up) for s in (side, -side)]
    (near, far, half), high = TRAY, np.array([0.0, 0.0, DEPTH])
    corners = [np.array([x, y, 0.0]) for x, y in ((near, -half), (far, -half), (far, half), (near, half))]
    tray = [quad(*corners)]
    tray += [quad(a, b, b + high, a + high) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    return {name: [*itertools.chain(*quads)] for name, quads in (("chute", chute), ("tray", tray))}


def quad(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> list[np.ndarray]:
    """Two triangles."""
    return [np.array([a, b, c]), np.array([a, c, d])]


def flight(way: np.ndarray, time: float) -> np.ndarray:
    """Where grains that have not landed are by the law at a time, (3, grains); `way` is theirs to the lip."""
    gone = np.minimum(0.5 * PULL * time**2, way)
    after = np.maximum(time - np.sqrt(2.0 * way / PULL), 0.0)
    places = RADIUS * NORMAL + (0.0, 0.0, LIP) + (gone - way)[:, None] * DOWN
    places = places + (np.sqrt(2.0 * PULL * way) * after)[:, None] * DOWN
    return np.asarray((places - 0.5 * GRAVITY * after[:, None] ** 2 * np.array([0.0, 0.0, 1.0])).T)


def run(rows: int = 8, columns: int = 5, until: float = 2.0, every: float = 0.02) -> Caught:
    """Grains at rest on the chute, until they lie in the box."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "chute.stl"
        write_stl(path, sheets())
        mesh = swarm.Mesh(path, scale=1e-3, open=True, friction=0.5, restitution=0.3)
    mass = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
    way = np.repeat(np.linspace(0.15, 0.55, rows), columns)
    across = np.tile((np.arange(columns) - 0.5 * (columns - 1)) * 2.4 * RADIUS, rows)
    sunk = mass * GRAVITY * math.cos(ANGLE) / STIFFNESS
    start = (flight(way, 0.0) - sunk * NORMAL[:, None]) + np.array([0.0, 1.0, 0.0])[:, None] * across
    scene = swarm.Scene([mesh], (0.0, 0.0, -GRAVITY), pairs=swarm.Pairs(restitution=0.3, friction=0.5))
    grains = swarm.Particles(start, np.zeros_like(start), mass=mass, radius=RADIUS)
    frames: list[np.ndarray] = []
    result = swarm.simulate(
        scene, grains, swarm.Penalty(dt=STEP, penalty=STIFFNESS), until=until, every=every,
        observables={"places": lambda frame: frames.append(frame.position.copy()) or 0.0},
    )  # fmt: skip
    time, places = result.observables["time"], np.array(frames)
    off = 0.0
    for t, here in zip(time, places, strict=True):
        free = here[2] > DEPTH + RADIUS
        off = max(off, float(np.abs((here - flight(way, float(t)))[[0, 2]][:, free]).max(initial=0.0)))
    near, far, half = TRAY
    x, y, z = result.particles.position
    in_box = int(((x > near) & (x < far) & (np.abs(y) < half) & (z > 0.0) & (z < DEPTH)).sum())
    return Caught(mesh, time, places, way, off, in_box, float(result.observables["energy_error"].max()))


def draw(caught: Caught, file: Path) -> None:
    """The sheets with the grains on their way, and the height of some of them over time beside the law."""
    from swarm.pictures.style import BLUE, CAVITY_LINE

    title = "Grains roll down a chute of open sheets into a box without a lid"
    with page(file, title, 1, 2, (9.0, 4.4)) as (place, axes):
        shape = place.figure.add_subplot(place.get_subplotspec(), projection="3d")
        place.remove()
        mesh, k = caught.mesh, int(np.searchsorted(caught.time, 0.5))
        vessel(shape, [(mesh.vertices[mesh.triangles], CAVITY_LINE)], caught.places[k])
        shape.set_box_aspect(np.ptp(mesh.vertices, axis=0), zoom=1.15)
        shape.set_title(f"{len(mesh)} triangles, {len(caught.way)} grains at {caught.time[k]:.2g} s")
        for row in np.unique(caught.way)[::2]:
            one = int(np.flatnonzero(caught.way == row)[2])
            heights = [flight(caught.way[one : one + 1], float(t))[2, 0] for t in caught.time]
            known = np.array(heights) > DEPTH
            law(axes, caught.time[known], np.array(heights)[known], "law" if row == caught.way[0] else None)
            axes.plot(caught.time, caught.places[:, 2, one], ".", color=BLUE, markersize=4)
        axes.set(xlabel="time [s]", ylabel="height [m]", title="four of the grains", xlim=(0.0, 1.2))
        axes.legend()


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "chute.png", "plot")
    asked = ask.parse_args()
    caught = run()
    print(f"{caught.mesh}: {caught.in_box} of {len(caught.way)} grains are in the box")
    print(f"on the chute and in flight they are within {1e3 * caught.off:.2f} mm of the law of a ball that rolls")
    print(f"worst relative energy error {caught.energy_error:.1e}")
    draw(caught, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

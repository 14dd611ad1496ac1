"""A gas in a vessel from a drawing: an STL file becomes a surface, and heights obey the barometric law.

    python -m examples.vessel_from_stl

A vase of three twisted lobes is made here, written as triangles, and read again as any other part would be. Its walls
are warm, so the gas becomes isothermal: at a height z its density is as exp(-m g z/kT), whatever the shape. Needs the
extras `mesh` and `plot`.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law as line
from .page import page, vessel

GRAVITY, TEMPERATURE, MASS = 9.81, 4.0, 1.0
HEIGHT, LOBES, DEPTH, TWIST = 1.0, 3, 0.18, 4.0


class Gas(NamedTuple):
    """What the picture shows."""

    surface: swarm.Sampled
    result: swarm.Result
    heights: np.ndarray  # of all frames but the first ones [m]
    paths: np.ndarray  # (frames, 3, particles) [m]


def radius(z: np.ndarray) -> np.ndarray:
    """The mean radius at a height: a belly and a neck [m]."""
    return 0.12 + 0.25 * np.exp(-(((z - 0.35) / 0.22) ** 2))


def vase(rows: int = 160, columns: int = 240) -> tuple[np.ndarray, np.ndarray]:
    """Its vertices (V, 3) [m] and triangles (T, 3), seen from outside; 76 960 triangles."""
    z, angle = np.linspace(0.0, HEIGHT, rows + 1), np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)
    wide = radius(z)[:, None] * (1.0 + DEPTH * np.cos(LOBES * angle - TWIST * z[:, None]))
    around = np.stack([wide * np.cos(angle), wide * np.sin(angle), np.broadcast_to(z[:, None], wide.shape)], axis=-1)
    vertices = np.concatenate([around.reshape(-1, 3), [(0.0, 0.0, 0.0), (0.0, 0.0, HEIGHT)]])
    one, after = np.arange(columns), np.roll(np.arange(columns), -1)
    first = columns * np.arange(rows)[:, None]
    a, b, c, d = first + one, first + after, first + columns + one, first + columns + after
    sides = np.concatenate([np.stack([a, b, d], axis=-1), np.stack([a, d, c], axis=-1)]).reshape(-1, 3)
    bottom, top = len(vertices) - 2, len(vertices) - 1
    floor = np.stack([np.full(columns, bottom), after, one], axis=-1)
    lid = np.stack([np.full(columns, top), columns * rows + one, columns * rows + after], axis=-1)
    return vertices, np.concatenate([sides, floor, lid])


def write_stl(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> None:
    """A binary STL file: of each triangle its normal, which readers compute, and its corners."""
    rows = np.zeros(len(triangles), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")]))
    rows["corners"] = vertices[triangles]
    path.write_bytes(bytes(80) + np.uint32(len(triangles)).tobytes() + rows.tobytes())


def run(count: int, until: float, spacing: float = 0.015, frames: int = 40) -> Gas:
    """The gas for so many seconds; the first quarter of the frames is not counted, while it warms."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_stl(folder / "vase.stl", *vase())
        surface = swarm.from_mesh(folder / "vase.stl", spacing, temperature=TEMPERATURE)
        scene = swarm.Scene([surface], gravity=(0.0, 0.0, -GRAVITY))
        start = swarm.fill(scene, count, temperature=TEMPERATURE, mass=MASS, seed=1)
        result = swarm.simulate(
            scene, start, swarm.Impact(), until=until, every=until / frames, trajectory=folder / "gas.h5"
        )
        with swarm.load(folder / "gas.h5") as trajectory:
            paths = np.array([trajectory.frame(k).position for k in range(frames // 4, frames + 1)])
    return Gas(surface, result, paths[:, 2].ravel(), paths)


def law(z: np.ndarray) -> np.ndarray:
    """The barometric density of heights, not normalized: the area of the section times exp(-m g z/kT)."""
    return radius(z) ** 2 * np.exp(-MASS * GRAVITY * z / TEMPERATURE)


def draw(gas: Gas, file: Path) -> None:
    """The vase with the gas in it, and the density over the height."""
    from swarm.pictures.style import BLUE, CAVITY_LINE

    title = "A gas between the warm walls of a vase from an STL file: it is denser below, by the barometric law"
    with page(file, title, 1, 2, (9.0, 4.6)) as (place, axes):
        shape = place.figure.add_subplot(place.get_subplotspec(), projection="3d")
        place.remove()
        vertices, triangles = vase(60, 72)
        vessel(shape, [(vertices[triangles], CAVITY_LINE)], gas.paths[-1][:, :2000])
        shape.set_title("vase, 1 m high, with 2000 of the particles")
        z = np.linspace(0.0, HEIGHT, 400)
        axes.hist(
            gas.heights, bins=50, range=(0.0, HEIGHT), density=True, color=BLUE, alpha=0.45, orientation="horizontal",
            label="run",
        )  # fmt: skip
        line(axes, law(z) / (law(z).mean() * HEIGHT), z, "barometric law times the area of the section")
        axes.lines[-1].set(zorder=3)
        axes.set(xlabel="particles at a height, over all [1/m]", ylabel="height [m]", title="where they are")
        axes.set(ylim=(0.0, HEIGHT))
        axes.legend(loc="upper right")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "vessel_from_stl.png", "plot", "mesh")
    ask.add_argument("--count", type=int, default=4000)
    ask.add_argument("--until", type=float, default=20.0)
    asked = ask.parse_args()
    gas = run(asked.count, asked.until)
    seen = gas.result.observables
    print(f"{gas.surface}: within {1e3 * gas.surface.mesh_error:.2g} mm of the mesh")
    print(f"{seen['impacts'][-1]} impacts, energy error {seen['energy_error'].max():.1e}, warmth of the walls included")
    print(f"deepest {seen['max_penetration'].max():.1e} m outside")
    draw(gas, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

"""A storage bottle from a drawing, as it is: facets, edges, and a shutter that opens.

    python -m examples.bottle_from_stl

An STL file with two named solids, the bottle and its shutter, is written here and read as any other part would be; each
triangle is a wall. Ultracold neutrons, or any thin gas, are kept for a while under gravity between warm walls; then the
shutter opens, and they leave. In equilibrium their density falls with the height as exp(-m g z/kT), and of N particles
N v A/(4 W) leave in a second, where v is their mean speed, A the area that is open, at height 0, and W the volume,
weighted with that density. Needs the extra `plot`.
"""

import itertools
import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page, vessel

TEMPERATURE, GRAVITY = 1.0, 2.0
SIDES, HOLE = 16, 0.06
# Of the bottle: heights and radii of its rings [m], of which the first is the rim of the shutter.
HEIGHTS, RADII = (0.0, 0.0, 0.1, 0.6, 0.75, 0.9, 0.9), (HOLE, 0.3, 0.4, 0.4, 0.15, 0.15, 0.0)


class Storage(NamedTuple):
    """What a run shows, frame by frame: the part that is in the bottle, its standard error, and the law."""

    mesh: swarm.Mesh
    time: np.ndarray
    part: np.ndarray
    error: np.ndarray
    law: np.ndarray
    shown: np.ndarray  # (3, particles) at the end of storage [m]


def solids() -> dict[str, list[np.ndarray]]:
    """The triangles of the bottle and of its shutter, each the three corners [m], seen from outside."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(SIDES)], axis=1)
    rings = [r * around + (0.0, 0.0, z) for r, z in zip(RADII, HEIGHTS, strict=True)]
    bottle, shutter = [], []
    for k in range(SIDES):
        m = (k + 1) % SIDES
        shutter.append(np.array([(0.0, 0.0, 0.0), rings[0][m], rings[0][k]]))
        for low, high in itertools.pairwise(rings[:-1]):
            bottle += [np.array([low[k], low[m], high[m]]), np.array([low[k], high[m], high[k]])]
        bottle.append(np.array([rings[-2][k], rings[-2][m], rings[-1][0]]))
    return {"bottle": bottle, "shutter": shutter}


def write_stl(path: Path, parts: dict[str, list[np.ndarray]]) -> None:
    """An STL file of text, in millimetres."""
    lines = []
    for name, triangles in parts.items():
        lines.append(f"solid {name}")
        for triangle in triangles:
            corners = [f"vertex {x:.6f} {y:.6f} {z:.6f}" for x, y, z in 1e3 * triangle]
            lines += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    path.write_text("\n".join(lines) + "\n")


def rate() -> float:
    """The part of the particles that leaves in a second while the shutter is open."""
    z = np.linspace(0.0, HEIGHTS[-1], 20_001)
    section = 0.5 * SIDES * math.sin(2.0 * math.pi / SIDES)
    weighted = section * np.interp(z, HEIGHTS[1:-1], RADII[1:-1]) ** 2 * np.exp(-GRAVITY * z / TEMPERATURE)
    speed = math.sqrt(8.0 * TEMPERATURE / math.pi)
    return float(speed * math.pi * HOLE**2 / (4.0 * np.trapezoid(weighted, z)))


def run(count: int, opens: float = 20.0, until: float = 100.0, frames: int = 40) -> Storage:
    """Storage until the shutter opens, and what is left in the bottle then."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bottle.stl"
        write_stl(path, solids())
        hole = swarm.Opening(swarm.Cylinder(HOLE, (0.0, 0.0, 1.0), 0.02), times=[(opens, math.inf)])
        mesh = swarm.Mesh(
            path,
            scale=1e-3,
            temperature=TEMPERATURE,
            groups={"shutter": {"accommodation": 0.5}},
            openings=[hole],
        )
    scene = swarm.Scene([mesh], gravity=(0.0, 0.0, -GRAVITY))
    start = swarm.fill(scene, count, temperature=TEMPERATURE, seed=1)
    kept = swarm.simulate(scene, start, swarm.Impact(), until=opens, seed=2)
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / frames, seed=2)
    time = result.observables["time"]
    part = 1.0 - result.observables["escaped"] / count
    law = np.exp(-rate() * np.clip(time - opens, 0.0, None))
    return Storage(mesh, time, part, np.sqrt(law * (1.0 - law) / count), law, kept.particles.position)


def draw(storage: Storage, file: Path) -> None:
    """The bottle with what it stores, and the storage curve."""
    from swarm.pictures.style import CAVITY_LINE, GREEN, ORANGE

    mesh, title = storage.mesh, "A storage bottle from an STL file keeps its gas until a shutter in its floor opens"
    with page(file, title, 1, 2, (9.0, 4.4)) as (place, axes):
        shape = place.figure.add_subplot(place.get_subplotspec(), projection="3d")
        place.remove()
        parts = {"bottle": CAVITY_LINE, "shutter": ORANGE}
        pieces = [(mesh.vertices[mesh.triangles[mesh.group == mesh.names.index(name)]], c) for name, c in parts.items()]
        vessel(shape, pieces, storage.shown[:, :1500])
        shape.set_title(f"{len(mesh)} triangles, 1500 particles at 20 s")
        axes.axvspan(20.0, storage.time[-1], color=ORANGE, alpha=0.15, linewidth=0.0, label="shutter is open")
        law(axes, storage.time, storage.law, "law: n v A/4 leave in a second")
        run = {"fmt": ".", "color": GREEN, "markersize": 5, "label": "run, with standard errors"}
        axes.errorbar(storage.time, storage.part, storage.error, **run)
        axes.set(xlabel="time [s]", ylabel="part of the particles", title="what is stored", yscale="log")
        axes.set_yticks([0.2, 0.3, 0.5, 0.7, 1.0], ["0.2", "0.3", "0.5", "0.7", "1"], minor=False)
        axes.set_yticks([], minor=True)
        axes.legend(loc="lower left")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "bottle_from_stl.png", "plot")
    ask.add_argument("--count", type=int, default=8000)
    asked = ask.parse_args()
    storage = run(asked.count)
    mesh = storage.mesh
    print(f"{mesh}: {1e3 * mesh.volume():.1f} litres, groups {', '.join(mesh.names)}")
    off = np.abs(storage.part - storage.law)[storage.error > 0.0] / storage.error[storage.error > 0.0]
    print(f"{storage.part[-1]:.4f} are left, {storage.law[-1]:.4f} by the law, {off.max():.1f} errors off at most")
    draw(storage, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()

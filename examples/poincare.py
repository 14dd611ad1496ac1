"""Balls that bounce in a wedge under gravity: a Poincaré section from the log of impacts.

Two planes make a wedge that opens upwards, at an angle to the vertical that decides the motion (Lehtihet & Miller,
Physica D 21 (1986) 93): at 45 degrees it is regular, since the velocity across each wall is kept, above it is chaotic,
below both occur, as islands in a sea. Each impact on one wall is a point: the velocity along the wall, and the square
of that away from it. In these coordinates the map from impact to impact keeps areas.

python -m examples.poincare
"""

import math
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import swarm

from .asked import Asked
from .page import page

Floats = NDArray[np.float64]
# Of all of them: v^2 + 2 g z, with g = 1.
ENERGY = 1.0


def section(degrees: float, orbits: int, until: float) -> tuple[NDArray[np.int32], Floats, Floats]:
    """Of each impact on one wall the orbit, the velocity along the wall, upwards, and that away from it."""
    angle = math.radians(degrees)
    normal, along = (math.cos(angle), 0.0, -math.sin(angle)), (math.sin(angle), 0.0, math.cos(angle))
    wedge = swarm.Scene([swarm.Plane(normal), swarm.Plane((-normal[0], 0.0, normal[2]))], gravity=(0.0, 0.0, -1.0))
    # From the middle of the wedge, at some height, in some direction
    height, way = np.random.default_rng(1).uniform([[0.05], [-math.pi]], [[0.45], [math.pi]], (2, orbits))
    speed, nothing = np.sqrt(ENERGY - 2.0 * height), np.zeros(orbits)
    start = swarm.Particles([nothing, nothing, height], [speed * np.sin(way), nothing, speed * np.cos(way)])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "impacts.h5"
        swarm.simulate(wedge, start, swarm.Impact(), until=until, impacts=path)
        with swarm.load_impacts(path) as log:
            table = log.table(surfaces=0)
    v = table["velocity_after"]
    return table["particle"], v @ along, -(v @ normal)


def draw(path: Path) -> None:
    """The section at three angles."""
    from swarm.pictures.style import CURVES

    angles = {45.0: "45°: regular, each on its line", 32.0: "32°: islands in a sea", 55.0: "55°: chaos"}
    title = "A ball bounces in a wedge: each impact on one wall is a dot, sixty balls in six colours"
    with page(path, title, 1, 3, (11.0, 4.0), sharey=True) as panels:
        for panel, (degrees, name) in zip(panels, angles.items(), strict=True):
            orbit, along, away = section(degrees, 60, 250.0)
            for k, colour in enumerate(CURVES):
                some = orbit % len(CURVES) == k
                panel.plot(along[some], away[some] ** 2, ".", color=colour, markersize=2.0, markeredgewidth=0.0)
            panel.set(title=name, xlim=(-1, 1), ylim=(0, 1), xlabel="velocity along the wall [m/s]")
            panel.grid(False)
        panels[0].set_ylabel("velocity away from it, squared [m²/s²]")


def main() -> None:
    """Draw them, and say how well the regular one is kept."""
    ask = Asked(__doc__, "poincare.png", "plot")
    given = ask.parse_args()
    draw(given.output)
    orbit, _along, away = section(45.0, 60, 250.0)
    spread = max(np.ptp(away[orbit == k]) for k in range(60))
    print(f"{len(orbit)} impacts at 45 degrees, where the velocity away from the wall is kept to {spread:.1e} m/s")
    print(f"written {given.output}")


if __name__ == "__main__":
    main()

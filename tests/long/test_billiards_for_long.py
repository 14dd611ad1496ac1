"""1e9 impacts in outlines with arcs, needles and re-entrant corners, and 1e6 flights at corners: no particle gets out.

`pytest -m long -s` prints the figures. SWARM_IMPACTS says of how many impacts, a billion else.
"""

import math
import os
import time as clock

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.long

IMPACTS = int(float(os.environ.get("SWARM_IMPACTS", "1e9")))
FRAMES, PARTICLES = 10, 20_000
NEEDLES = [(0, 0), (2, 0), (2, 1, -0.4), (1.5, 0.5), (1, 1), (0.99, 0.3), (0.98, 1), (0.5, 1, 0.6), (0, 1), (-1, 0.02)]
TABLES = {
    "stadium": swarm.Stadium(1.0, 2.0),
    "needles": swarm.Polygon(NEEDLES),
    "star": swarm.Polygon(
        [
            ((1.0 + 0.3 * (k % 2)) * math.cos(math.pi * k / 30), (1.0 + 0.3 * (k % 2)) * math.sin(math.pi * k / 30))
            for k in range(60)
        ]
    ),
}


@pytest.mark.parametrize("name", TABLES)
def test_nobody_gets_out(name, capsys):
    surface, began = TABLES[name], clock.perf_counter()
    scene = swarm.Scene([surface], plane="z")
    start = swarm.fill(scene, PARTICLES, speed=1.0, seed=4)
    rate = swarm.simulate(scene, start, swarm.Impact(), until=1.0, threads=2).observables["impacts"][-1]
    until = 1.02 * IMPACTS / len(TABLES) / rate
    end = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / FRAMES, threads=2)
    seen, each = end.observables, end.impacts_per_particle / until
    outside, lost = seen["max_penetration"].max(), seen["energy_error"].max()
    gap = float(scene.gaps(end.particles.position).max())
    path, law = 1.0 / each.mean(), math.pi * surface.area() / surface.perimeter()
    with capsys.disabled():
        print(
            f"\n{name}: {int(seen['impacts'][-1])} impacts, outside {outside:.1e}, gap {gap:.1e}, energy {lost:.1e}, "
            f"free path {path:.5f}, pi A/L {law:.5f}, {clock.perf_counter() - began:.0f} s"
        )
    assert max(outside, gap) < 1e-14
    assert lost < 1e-11
    assert not end.particles.position[2].any()
    assert not end.particles.velocity[2].any()


@pytest.mark.parametrize("name", TABLES)
def test_flights_at_corners_stay_inside(name):
    surface = TABLES[name]
    scene = swarm.Scene([surface], plane="z")
    corners = surface.boundary.sides.start
    start = swarm.fill(scene, 1_000_000 // len(TABLES), speed=1.0, seed=4)
    aim = corners[np.arange(len(start)) % len(corners)]
    way = np.vstack([aim.T - start.position[:2], np.zeros(len(start))])
    start.velocity = way / np.sqrt((way**2).sum(axis=0))
    end = swarm.simulate(scene, start, swarm.Impact(), until=3.0, threads=2)
    assert scene.gaps(end.particles.position).max() < 1e-14
    assert end.observables["max_penetration"].max() < 1e-14

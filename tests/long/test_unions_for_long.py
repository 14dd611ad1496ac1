"""1e9 impacts in a T of three capped cylinders, straight and falling, and in a foam of 1000 balls: none gets out.

`pytest -m long -s` prints the figures. SWARM_IMPACTS says of how many impacts, a billion else.
"""

import os
import time as clock

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.long

IMPACTS = float(os.environ.get("SWARM_IMPACTS", "1e9"))
FRAMES, PARTICLES = 10, 20_000
TEE = swarm.Union(
    [
        swarm.Cylinder(0.2, (1, 0, 0), 1.0, (-0.4, 0.0, 0.0)),
        swarm.Cylinder(0.2, (1, 0, 0), 1.0, (0.4, 0.0, 0.0)),
        swarm.Cylinder(0.15, (0, 0, 1), 0.8, (0.0, 0.0, 0.4)),
    ]
)
FOAM = swarm.Spheres(np.random.default_rng(5).uniform(-1.0, 1.0, (1000, 3)), 0.15, side="inside")
SCENES = {
    "T": swarm.Scene([TEE]),
    "T, falling": swarm.Scene([TEE], (0.0, 0.0, -1.0)),
    "foam": swarm.Scene([FOAM]),
}


@pytest.mark.parametrize("name", SCENES)
def test_nobody_gets_out(name, capsys):
    scene, began = SCENES[name], clock.perf_counter()
    start = swarm.fill(scene, PARTICLES, speed=1.0, seed=4)
    rate = swarm.simulate(scene, start, swarm.Impact(), until=1.0, threads=2).observables["impacts"][-1]
    until = 1.02 * IMPACTS / rate
    end = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / FRAMES, threads=2)
    seen, gap = end.observables, float(scene.gaps(end.particles.position).max())
    outside, lost = seen["max_penetration"].max(), seen["energy_error"].max()
    with capsys.disabled():
        print(
            f"\n{name}: {int(seen['impacts'][-1])} impacts, outside {outside:.1e}, gap {gap:.1e}, energy {lost:.1e}, "
            f"{clock.perf_counter() - began:.0f} s"
        )
    assert max(outside, gap) < 1e-13
    assert lost < 1e-11

"""The gas law: the walls feel p = N m v^2/(3 V)."""

import math

import numpy as np
import pytest
from conftest import rarely
from physics.billiards import AXES, ellipsoid_area, run, scene_of

import swarm

pytestmark = pytest.mark.physics

GASES, N, TIME = 16, 400, 30.0
# Volume, and the area of each surface.
VESSELS = {
    "sphere": (4.0 / 3.0 * math.pi * 0.5**3, [4.0 * math.pi * 0.5**2]),
    "ellipsoid": (4.0 / 3.0 * math.pi * math.prod(AXES), [ellipsoid_area()]),
    "box": (1.0, [1.0] * 6),
    "hemisphere": (2.0 / 3.0 * math.pi * 0.5**3, [2.0 * math.pi * 0.5**2, math.pi * 0.5**2]),
}


@pytest.mark.parametrize("start", [{"speed": 0.5}, {"temperature": 0.2}], ids=["one speed", "Maxwellian"])
@pytest.mark.parametrize("name", [rarely(name) if name == "box" else name for name in VESSELS])
def test_gas_law_at_every_wall(name, start):
    """A uniform isotropic gas stays one, so each wall's mean impulse is p A t; its error from 16 gases' spread."""
    scene, (volume, areas) = scene_of(name), VESSELS[name]
    mass = 1.7
    squared = mass * start["speed"] ** 2 if "speed" in start else 3.0 * start["temperature"]
    expected = N * squared / (3.0 * volume)
    measured = np.array(
        [
            run(scene, swarm.fill(scene, N, mass=mass, seed=seed, **start), swarm.Impact(), TIME, compile="always")
            .observables["impulse"][-1]
            for seed in range(GASES)
        ]
    ) / (np.array(areas) * TIME)  # fmt: skip
    error = measured.std(axis=0, ddof=1) / math.sqrt(GASES)
    assert (error < 0.03 * expected).all()
    assert (np.abs(measured.mean(axis=0) - expected) <= 3.0 * error).all()

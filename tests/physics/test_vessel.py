"""The example of a vessel from an STL file, with few particles: the facts that it is there to show."""

import numpy as np
import pytest
from scipy.integrate import quad

from examples import vessel_from_stl as example

pytestmark = pytest.mark.physics


def test_heights_in_a_warm_vase_obey_the_barometric_law(compiled_at_once):
    gas = example.run(300, 6.0, spacing=0.025, frames=12)
    assert 1e-4 < gas.surface.mesh_error < 0.025
    seen = gas.result.observables
    assert seen["impacts"][-1] > 10_000
    assert seen["energy_error"].max() < 1e-13
    assert seen["max_penetration"].max() < 1e-14
    weight = quad(example.law, 0.0, example.HEIGHT)[0]
    mean = quad(lambda z: z * example.law(z), 0.0, example.HEIGHT)[0] / weight
    # Frames half a second apart know little of each other.
    assert abs(gas.heights.mean() - mean) < 4.0 * gas.heights.std() / np.sqrt(gas.heights.size) + 0.003
    # The volume of the twisted lobes
    area = quad(lambda z: np.pi * example.radius(z) ** 2 * (1.0 + 0.5 * example.DEPTH**2), 0.0, example.HEIGHT)[0]
    points = np.random.default_rng(1).uniform((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (50_000, 3))
    assert (gas.surface.phi(points.T) < 0.0).mean() == pytest.approx(area, rel=0.05)

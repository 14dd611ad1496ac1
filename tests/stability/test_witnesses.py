"""1e6 impacts of each particle: what a billiard keeps, as a witness that no impact was wrong.

tests/long/test_shipped_scenes.py has the other scenes.
"""

import numpy as np
import pytest
from stability.witnesses import fly, joachimsthals_integral, shipped, spin

pytestmark = pytest.mark.physics


def test_a_million_impacts_in_the_shipped_cavity():
    """Energy, Joachimsthal's integral and the angular momentum about the axis of each of four particles."""
    scene, start, method = shipped("cavity", 4)
    end, impacts = fly(scene, start, method, 1_000_000)
    assert impacts >= 4 * 1_000_000
    assert end.observables["energy_error"].max() <= 2e-15
    assert end.observables["max_penetration"].max() <= np.spacing(0.6)
    for witness in (joachimsthals_integral, spin):
        before, after = witness(scene, start), witness(scene, end.particles)
        assert np.abs(after / before - 1.0).max() <= 1e-10, witness

"""The example of a Poincaré section, with few particles."""

import numpy as np
import pytest

from examples import poincare

pytestmark = pytest.mark.physics


def test_a_wedge_of_90_degrees_is_regular_and_a_wider_one_is_not():
    """In the first the velocity across a wall is kept; in the second an orbit comes everywhere."""
    orbit, along, away = poincare.section(45.0, 4, 40.0)
    assert len(orbit) > 50
    assert max(np.ptp(away[orbit == k]) for k in range(4)) < 1e-13
    assert (along**2 + away**2 <= poincare.ENERGY + 1e-13).all()
    orbit, along, away = poincare.section(55.0, 1, 150.0)
    heights = np.histogram(away**2, bins=8, range=(0.0, poincare.ENERGY))[0]
    assert (heights[:7] > 0).all()
    assert np.ptp(along) > 1.5

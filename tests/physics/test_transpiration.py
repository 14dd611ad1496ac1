"""Two chambers of two temperatures and a tube: the ratio of their pressures is the root of that of the temperatures."""

import pytest

from examples import transpiration


@pytest.mark.physics
def test_pressures_settle_at_the_root_of_the_temperatures(compiled_at_once):
    gas = transpiration.run(500, 2000.0, 100)
    assert abs(gas.ratio - transpiration.RATIO) < 3.0 * gas.error
    assert gas.error < 0.03 * gas.ratio

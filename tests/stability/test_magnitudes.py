"""Metres, seconds and kilograms are names: other units, over 24 decades, leave the dimensionless result as it is.

Powers of two, which floating-point numbers carry in the exponent alone, change no bit; other factors round-off.
tests/long/test_more_magnitudes.py has the other methods, scenes of several walls, and gravity.
"""

import numpy as np
import pytest
from stability.magnitudes import UNITS, ends, sphere

pytestmark = pytest.mark.physics


@pytest.mark.parametrize("name", ["impact", "penalty", "verlet", "midpoint", "trapezoidal"])
def test_units_change_no_bit(name):
    one = ends(name, sphere)
    assert one[-1][-1] > 100 * 6
    for powers in UNITS:
        for first, other in zip(one, ends(name, sphere, *(2.0**k for k in powers)), strict=True):
            assert np.array_equal(first, other), powers


def change(name):
    """The largest change of a position by decimal units, whose products are rounded, after some ten impacts."""
    one = ends(name, sphere)[0]
    units = [(12, 0, 0), (-12, 0, 0), (0, 12, 0), (0, -12, 0), (0, 0, 12), (0, 0, -12)]
    return max(np.abs(ends(name, sphere, *(10.0**k for k in powers))[0] - one).max() for powers in units)


@pytest.mark.parametrize(("name", "bound"), [("impact", 1e-12), ("penalty", 1e-9)])
def test_decimal_units_change_round_off(name, bound):
    assert change(name) <= bound


@pytest.mark.parametrize("name", ["verlet", "midpoint"])
def test_baselines_make_much_of_round_off(name):
    """Where in a step a contact begins decides what it does to the energy, and so to the next contact."""
    assert change(name) > 1e-6

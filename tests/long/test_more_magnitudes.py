"""Other units change no bit: three walls, with gravity and without. See tests/stability/test_magnitudes.py."""

import numpy as np
import pytest
from stability.magnitudes import METHODS, UNITS, ends

import swarm

pytestmark = pytest.mark.long

FALLING = (0.2, 0.0, -1.0)
# Steps that are cut at the impact do not know gravity.
CASES = [(name, pull) for name in METHODS for pull in (None, FALLING) if pull is None or "Lagrangian" not in name]


def scene_of(rigid, pull):
    """Of soft walls only such whose gap is a length: an ellipsoid's has no unit."""

    def scene(length, time):
        surfaces = [
            swarm.Ellipsoid((0.3 * length, 0.4 * length, 0.6 * length)) if rigid else swarm.Sphere(0.4 * length),
            swarm.Plane((0.0, 0.0, -1.0), 0.25 * length),
            swarm.Sphere(0.1 * length, side="outside"),
        ]
        return swarm.Scene(surfaces, pull and tuple(a * length / time**2 for a in pull))

    return scene


@pytest.mark.parametrize(("name", "pull"), CASES)
def test_units_change_no_bit(name, pull):
    scene = scene_of(name.startswith("impact"), pull)
    one = ends(name, scene)
    assert one[-1][-1] > 100 * 8
    for powers in UNITS:
        for first, other in zip(one, ends(name, scene, *(2.0**k for k in powers)), strict=True):
            assert np.array_equal(first, other), powers

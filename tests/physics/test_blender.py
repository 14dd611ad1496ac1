"""The blade of examples/blender.py mixes grains, and the work that it does is all of their energy that is not lost."""

import numba
import numpy as np
import pytest

from examples import blender

pytestmark = [
    pytest.mark.physics,
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="hours in plain Python"),
]


def test_a_blade_mixes_grains(compiled_at_once, optimized):
    """Two turns, three times as fast, of fewer grains that fall on it."""
    stirred = blender.run(120, settle=0.0, stir=0.5, every=0.05, turns=4.5)
    assert len(stirred.mesh) == 68
    assert stirred.index[0] < 0.35
    assert stirred.index[-1] > stirred.index[0] + 0.3
    assert stirred.work > 0.0
    assert stirred.energy_error < 1e-12
    x, y, z = stirred.places[-1]
    assert np.hypot(x, y).max() < blender.BOWL
    assert np.abs(z).max() < 0.5 * blender.HEIGHT
    away = stirred.mesh.phi(stirred.places[-1], float(stirred.time[-1]))
    assert away.min() > 0.5 * blender.RADIUS


def test_the_index_of_mixing_is_one_where_colours_are_drawn():
    random = np.random.default_rng(4)
    places, left = random.random((3, 4000)), random.random(4000) < 0.5
    assert blender.mixing(places, left) == pytest.approx(1.0, abs=0.03)
    assert blender.mixing(places, places[0] < 0.5) < 0.2

"""The energy that walls store is the sum over the walls."""

import numpy as np
import pytest
from conftest import call, directions, every_law, exponent_of, gap, numbers_of, scene_of
from hypothesis import given
from hypothesis import strategies as st

from swarm.contact.energy import Budget, Ends, contact_energy, energy_uncertainty, restoring_factor
from swarm.kernel.vector import Vec

NAMES = ("sphere", "egg", "plane")


@every_law
@given(point=directions)
def test_energy_is_the_sum_over_walls(law, point):
    parts = [call(law.stored_energy, gap(numbers_of(name), point)) for name in NAMES]
    stored = call(contact_energy, law, scene_of(*NAMES).compiled().walls(), 1.0, point)
    assert stored == pytest.approx(sum(parts), rel=1e-15)


@given(point=directions)
def test_rigid_walls_store_none(point):
    assert call(contact_energy, None, scene_of(*NAMES).compiled().walls(), 1.0, point) == 0.0


@every_law
@given(point=directions, shift=st.tuples(*[st.floats(-1e-7, 1e-7)] * 3).map(np.array))
def test_uncertainty_bounds_the_change_of_the_energy(law, point, shift):
    """Up to (a + 1)/2, for the shift of a point, at the centre of a sphere too."""
    walls, size = scene_of(*NAMES).compiled().walls(), np.abs(shift) + 1e-12
    for place in (point, np.array([0.2, -0.3, 0.1])):
        change = call(contact_energy, law, walls, 2.0, place + shift) - call(contact_energy, law, walls, 2.0, place)
        uncertainty = call(energy_uncertainty, walls, law, 2.0, place, size)
        assert abs(change) <= 1.01 * 0.5 * (exponent_of(law) + 1.0) * uncertainty + 1e-9


@every_law
@given(speed=st.floats(1e-12, 1e-6), missing=st.floats(-1e-15, 1e-15))
def test_a_speed_that_is_round_off_of_the_energy_is_restored_or_stops(law, speed, missing):
    walls, r = scene_of("plane").compiled().walls(), np.array([0.0, 0.0, -0.1])
    assert call(contact_energy, law, walls, 1.0, r) == 0.0
    place, v = Vec(*r), Vec(speed, 0.0, 0.0)
    budget, ends = Budget(1.0, 0.5 * (speed**2 + missing), 1.0), Ends(place, place, v, 1e-3)
    factor, balanced = call(restoring_factor, law, walls, walls, None, budget, ends)
    assert balanced
    # One Newton step of the square root, from within a tenth, or the root.
    assert (factor * speed) ** 2 == pytest.approx(max(speed**2 + missing, 0.0), rel=3e-3)

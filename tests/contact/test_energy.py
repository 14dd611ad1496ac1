"""The energy that walls store is the sum over the walls."""

import pytest
from conftest import call, directions, every_law, gap, numbers_of, scene_of
from hypothesis import given

from swarm.contact import regularisation
from swarm.contact.energy import contact_energy

NAMES = ("sphere", "egg", "plane")


@every_law
@given(point=directions)
def test_energy_is_the_sum_over_walls(law, point):
    parts = [call(regularisation.stored_energy, law, gap(numbers_of(name), point)) for name in NAMES]
    assert call(contact_energy, law, scene_of(*NAMES).chain(), 1.0, point) == pytest.approx(sum(parts), rel=1e-15)


@given(point=directions)
def test_rigid_walls_store_none(point):
    assert call(contact_energy, None, scene_of(*NAMES).chain(), 1.0, point) == 0.0

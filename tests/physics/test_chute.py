"""The grains of examples/chute.py roll and fly as the law says, and all are caught."""

import pytest

from examples import chute

pytestmark = pytest.mark.physics


def test_grains_roll_down_a_chute_of_sheets_into_a_box_without_a_lid():
    caught = chute.run(rows=3, columns=2, until=1.5)
    assert caught.mesh.open
    assert caught.in_box == 6
    assert caught.off < 3e-4
    assert caught.energy_error < 1e-12

"""The example of dice in a cup that is shaken: the cup's work is what the dice gain and lose."""

import numpy as np
import pytest

from examples import shaken_dice

pytestmark = pytest.mark.physics


def test_the_work_of_the_cup_is_what_a_die_gains_and_loses():
    thrown = shaken_dice.run(count=1, until=0.06, compiling="never")
    assert thrown.energy_error < 1e-12
    assert thrown.work[-1] > 0.0
    gained = thrown.energy - thrown.energy[0]
    np.testing.assert_allclose(gained, thrown.work - thrown.lost, rtol=0.0, atol=1e-12 * thrown.energy.max())


def test_the_cup_rests_after_it_was_shaken():
    path = shaken_dice.path(3.0)
    assert path.displacement(1.0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)
    assert np.abs([path.displacement(t) for t in np.linspace(2.0, 3.0, 50)]).max() < 1e-6
    assert np.abs([path.displacement(t) for t in np.linspace(0.0, 1.0, 50)]).max() > 0.02


def test_equal_frequencies_are_not_far_from_equal():
    assert shaken_dice.chi_squared(np.full(6, 10)) == 0.0
    assert shaken_dice.chi_squared(np.array([16, 8, 9, 9, 9, 9])) == pytest.approx(4.4)

"""The storage curve and the two rooms of examples/doors.py beside their laws."""

import numpy as np
import pytest

from examples import doors

pytestmark = pytest.mark.physics


def test_a_valve_lets_out_while_it_is_open_and_a_shutter_keeps_half_empty():
    flow = doors.shutter(3000)
    assert (np.abs(flow.part - flow.law) <= 3.0 * flow.error + 1e-12).all()
    behind, after = flow.shown
    assert behind[0].max() <= 1e-12
    assert 0.0 < (after[0] > 0.0).mean() < 0.3


def test_a_door_makes_densities_equal():
    flow = doors.door(3000)
    assert (np.abs(flow.part - flow.law) <= 3.0 * flow.error + 1e-12).all()
    assert flow.part[-1] < 0.8
    assert flow.shown[0][0].max() <= 1e-12

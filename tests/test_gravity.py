"""The free flight with constant gravity, or none."""

import numpy as np
import pytest
from conftest import EPSILON, call, vectors
from hypothesis import given
from hypothesis import strategies as st

from swarm.kernel.gravity import Gravity, accelerated, displacement, potential

times = st.floats(0.0, 10.0, allow_subnormal=False)
pulls = st.none() | vectors.map(lambda g: Gravity(*g))


@given(pull=pulls, velocity=vectors, first=times, second=times)
def test_two_flights_are_one(pull, velocity, first, second):
    """Flying t and then s is flying t + s."""
    way = np.array(call(displacement, pull, velocity, first))
    later = np.array(call(accelerated, pull, velocity, first))
    whole = np.array(call(displacement, pull, velocity, first + second))
    assert way + np.array(call(displacement, pull, later, second)) == pytest.approx(whole, abs=8 * EPSILON * 200)
    assert call(accelerated, pull, later, second) == pytest.approx(
        call(accelerated, pull, velocity, first + second), abs=8 * EPSILON * 20
    )


@given(pull=pulls, velocity=vectors, time=times)
def test_flight_conserves_energy(pull, velocity, time):
    """v^2/2 - G.r; and the mean of the velocities is the way over the time."""
    way = np.array(call(displacement, pull, velocity, time))
    end = np.array(call(accelerated, pull, velocity, time))
    before, after = 0.5 * velocity @ velocity, 0.5 * end @ end + call(potential, pull, way)
    assert after == pytest.approx(before, abs=64 * EPSILON * (1.0 + end @ end))
    assert way == pytest.approx(0.5 * time * (velocity + end), abs=8 * EPSILON * 200)


def test_by_hand():
    pull = Gravity(1.0, -2.0, 4.0)
    assert call(displacement, pull, np.array([1.0, 1.0, 1.0]), 2.0) == (4.0, -2.0, 10.0)
    assert call(accelerated, pull, np.array([1.0, 1.0, 1.0]), 2.0) == (3.0, -3.0, 9.0)
    assert call(potential, pull, np.array([1.0, 2.0, 3.0])) == -9.0
    assert call(potential, None, np.array([1.0, 2.0, 3.0])) == 0.0

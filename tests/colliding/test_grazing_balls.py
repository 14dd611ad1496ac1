"""Balls that graze a wall: millions of impacts on it, none of which changes the energy."""

import pytest

import swarm


@pytest.mark.parametrize(("across", "until"), [(1e-3, 0.02), (1e-9, 0.001), (0.0, 0.001)])
def test_a_ball_that_grazes_a_cavity_keeps_its_energy(across, until):
    start = swarm.Particles((0.4, 0.0, 0.0), (across, 1.0, 0.0), radius=0.1)
    result = swarm.simulate(swarm.Scene([swarm.Sphere(0.5)]), start, swarm.Impact(), until=until)
    assert result.observables["impacts"][-1] > 20
    assert result.observables["energy_error"].max() <= 4.5e-16
    assert result.observables["max_penetration"].max() <= 1e-15

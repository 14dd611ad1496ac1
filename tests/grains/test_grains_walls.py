"""Soft balls at walls: a ball is a point at the wall that its centre meets."""

import numpy as np
import pytest
from grains_runs import cloud, ran

import swarm


@pytest.mark.parametrize("surface", [swarm.Box((3.2, 3.2, 3.2), (2.5, 2.5, 2.5)), swarm.Sphere(5.0, (1.5, 1.5, 1.5))])
def test_energy_in_a_cavity_under_gravity(surface):
    scene = swarm.Scene([surface], gravity=(0.0, 1.0, -3.0))
    result = ran(scene, cloud(), swarm.Penalty(0.01, 300.0, 1.5), 1.0, every=0.25)
    seen = result.observables
    assert seen["impacts"][-1] > 5
    assert seen["energy_error"].max() < 1e-13


def test_one_ball_is_a_point_in_a_smaller_cavity():
    method, until = swarm.Penalty(0.005, 300.0), 4.0
    ball = swarm.Particles((0.1, 0.2, 0.0), (1.0, -0.5, 0.7), radius=0.2)
    point = swarm.Particles((0.1, 0.2, 0.0), (1.0, -0.5, 0.7))
    one = ran(swarm.Scene([swarm.Sphere(1.0)]), ball, method, until)
    other = ran(swarm.Scene([swarm.Sphere(0.8)]), point, method, until)
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] > 2
    assert np.allclose(one.particles.position, other.particles.position, rtol=0.0, atol=1e-11)
    assert one.observables["impulse"][-1] == pytest.approx(other.observables["impulse"][-1], rel=1e-11)

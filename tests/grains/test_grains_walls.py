"""Soft balls at walls: a ball is a point at the wall that its centre meets."""

import numpy as np
import pytest
from grains_runs import cloud, ran

import swarm
from swarm.kernel.vector import Vec, dot, norm
from swarm.surfaces.balls.tip import Nappes

QUADRIC = swarm.Cone(0.7).walls()[1]


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


@pytest.mark.parametrize("length", [1e-12, 1e-9, 1e-6, 1e-2])
def test_a_short_step_at_a_cone_has_its_gradient_without_noise(length):
    sine, cosine = np.sin(0.7), np.cos(0.7)
    nappes = Nappes(QUADRIC, Vec(0.0, 0.0, 1.0), sine, cosine)
    r0, d = Vec(0.3, 0.2, 0.5), length * Vec(0.5, -0.7, 0.3)
    given, middle = nappes.resting_gradient(r0, r0 + d), nappes.inner_gradient(r0 + 0.5 * d)
    assert abs(dot(given, d) - (nappes.inner(r0 + d) - nappes.inner(r0))) < 2e-14
    if length < 1e-4:
        assert norm(given - middle) < 1e-10


def test_balls_that_settle_at_the_tip_of_a_cone_run():
    laws = {"restitution": 0.1, "friction": 0.5}
    scene = swarm.Scene([swarm.Cone(0.7, **laws)], gravity=(0.0, 0.0, -9.81), pairs=swarm.Pairs(**laws))
    place = [[0.0, 0.1, -0.1], [0.0, 0.1, 0.12], [0.3, 0.5, 0.52]]
    start = swarm.Particles(place, np.zeros((3, 3)), 0.3, radius=0.1)
    seen = ran(scene, start, swarm.Penalty(1e-3, 2e4, 1.5), 0.4, every=0.1).observables
    assert seen["energy_error"].max() < 1e-12
    assert seen["kinetic_energy"][-1] < 0.3 * seen["kinetic_energy"].max()


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_step_across_a_slab_that_ends_as_far_beyond_it_is_too_deep(friction):
    """What is stored is the same at both ends, so that the step has no normal: friction divided by its length."""
    slab = swarm.Slab((1.0, 0.0, 0.0), 0.5, friction=friction)
    ball = swarm.Particles((0.31, 0.0, 0.0), (-62.0, 5.0, 0.0), radius=0.2)
    with pytest.raises(swarm.RunError, match=r"it overlaps surfaces\[0\] \(Slab\) by 0\.63 m, more than its radius"):
        ran(swarm.Scene([slab]), ball, swarm.Penalty(0.01, 1.0, 1.0), 0.05)

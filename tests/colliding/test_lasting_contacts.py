"""Balls with Impact where contacts would last: they bounce below a bound, as often as t_c says, and nothing hangs."""

import itertools
import math

import numpy as np
import pytest

import swarm

G = (0.0, 0.0, -9.81)


def run(scene, start, until, **options):
    seen = swarm.simulate(scene, start, swarm.Impact(), until=until, compile="never", **options)
    assert seen.observables["max_penetration"].max() < 1e-14
    return seen


def ball(position, velocity=(0.0, 0.0, 0.0), radius=0.1):
    return swarm.Particles(position, velocity, radius=radius)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.9])
def test_a_ball_comes_to_lie_on_a_floor(restitution):
    """It bounces by g t_c^2/8 at most, once in t_c."""
    duration = 0.01
    scene = swarm.Scene(
        [swarm.Box((1.0,) * 3, restitution=restitution)], gravity=G, pairs=swarm.Pairs(contact_duration=duration)
    )
    seen = run(scene, ball((0.0, 0.0, -0.85), (0.1, 0.0, 0.0)), 3.0, every=0.5)
    assert seen.observables["impacts"][-1] < 1.1 * 3.0 / duration
    assert -0.9 <= seen.particles.position[2, 0] <= -0.9 + 0.2 * 9.81 * duration**2
    # What is left is the motion along the floor.
    np.testing.assert_allclose(seen.particles.velocity[0, 0], 0.1, rtol=1e-12)
    assert seen.observables["energy_error"].max() < 1e-13


def test_an_elastic_ball_that_starts_on_the_floor_at_rest_stays_there():
    seen = run(swarm.Scene([swarm.Box((1.0,) * 3)], gravity=G), ball((0.0, 0.0, -0.9)), 2e-4)
    assert seen.observables["impacts"][-1] < 5e4
    assert seen.particles.position[2, 0] < -0.9 + 1e-11
    assert seen.observables["energy_error"][-1] < 1e-13


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_ball_slides_along_a_cavity(restitution):
    """Its path has as many impacts as t_c lets it have, and it keeps its speed along the wall."""
    duration = 0.01
    scene = swarm.Scene([swarm.Sphere(1.0, restitution=restitution)], pairs=swarm.Pairs(contact_duration=duration))
    seen = run(scene, ball((0.0, 0.0, 0.2), (1.0, 0.0, 0.0)), 40.0)
    assert seen.observables["impacts"][-1] < 1.1 * 40.0 / duration
    # Of a flight across the circle at this height the part along the wall is left.
    np.testing.assert_allclose(seen.observables["kinetic_energy"][-1], 0.5 * (0.2 / 0.9) ** 2, rtol=0.02)
    assert 0.89 < math.hypot(*seen.particles.position[:, 0]) <= 0.9 + 1e-14
    assert seen.observables["energy_error"].max() < 1e-12


@pytest.mark.parametrize(
    "wall", [swarm.Sphere(0.5, restitution=0.5), swarm.Ellipsoid((0.5,) * 3, restitution=0.5)], ids=["R", "a, b, c"]
)
def test_a_ball_leaves_a_round_wall_as_fast_as_its_motion_along_the_wall_asks(wall):
    """v_t^2/rho brings it back in t_c: it leaves with v_n = v_t^2 t_c/(2 rho), in equal descriptions of a wall."""
    duration, rho, along = 0.2, 0.4, 1.0
    scene, velocity = swarm.Scene([wall], pairs=swarm.Pairs(contact_duration=duration)), (0.4, along, 0.0)
    seen = run(scene, ball(np.array([rho, 0.0, 0.0]) - 0.1 * np.array(velocity), velocity), 0.11)
    expected = -(along**2) * duration / (2.0 * rho), along, 0.0
    np.testing.assert_allclose(seen.particles.velocity[:, 0], expected, rtol=1e-12, atol=1e-15)


def test_a_ball_that_starts_along_an_elastic_cavity_goes_on():
    seen = run(swarm.Scene([swarm.Sphere(1.0)]), ball((0.0, 0.0, 0.9), (1.0, 0.0, 0.0)), 1e-3)
    np.testing.assert_allclose(seen.particles.position[0, 0], 0.9 * math.sin(1e-3 / 0.9), rtol=1e-9)
    assert seen.observables["impacts"][-1] < 5e4
    assert seen.observables["kinetic_energy"][-1] == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize(("half", "friction", "until"), [(45.0, 0.0, 2.0), (45.0, 0.3, 2.0), (15.0, 0.0, 0.5)])
def test_a_ball_in_a_groove(half, friction, until):
    """Wedged between two walls it slides along them, pulled by what pulls along; friction holds it back."""
    duration, a = 0.01, math.radians(half)
    walls = [
        swarm.Plane((sign * math.cos(a), 0.0, -math.sin(a)), 0.0, restitution=0.5, friction=friction)
        for sign in (1.0, -1.0)
    ]
    scene = swarm.Scene(walls, gravity=(0.0, 1.0, -9.81), pairs=swarm.Pairs(contact_duration=duration))
    bottom = 0.1 / math.sin(a)
    seen = run(scene, ball((0.0, 0.0, bottom + 0.05)), until)
    assert seen.observables["impacts"][-1] < (900.0 / half) * until / duration
    assert bottom - 1e-12 <= seen.particles.position[2, 0] < bottom + 0.01
    if friction == 0.0:
        np.testing.assert_allclose(seen.particles.velocity[1, 0], until, rtol=1e-12)
    else:
        # 0.3 of the force of both walls is more than what pulls.
        assert seen.particles.velocity[1, 0] < 0.1
    assert seen.observables["energy_error"].max() < 1e-13


@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_a_heap(restitution):
    x = np.array([-0.13, 0.13])
    position = np.array(list(itertools.product(x, x, x))).T + np.random.default_rng(1).uniform(-0.01, 0.01, (3, 8))
    scene = swarm.Scene(
        [swarm.Box((0.3, 0.3, 0.5), restitution=restitution, friction=0.2)], gravity=G,
        pairs=swarm.Pairs(restitution, contact_duration=5e-3),
    )  # fmt: skip
    seen = run(scene, swarm.Particles(position, 0.0 * position, radius=0.12), 1.4, every=0.2)
    # For each ball some contacts in t_c
    assert seen.observables["collisions"][-1] + seen.observables["impacts"][-1] < 8 * 10 * 1.4 / 5e-3
    assert seen.observables["kinetic_energy"][-1] < 0.1
    assert seen.observables["energy_error"].max() < 1e-13
    assert (seen.particles.position[2] >= -0.38 - 1e-14).all()


def test_a_light_ball_between_the_floor_and_a_heavy_one():
    start = swarm.Particles([[0.0] * 2, [0.0] * 2, [-0.9, -0.65]], np.zeros((3, 2)), [1e-3, 1.0], radius=0.1)
    scene = swarm.Scene([swarm.Box((1.0,) * 3, restitution=0.5)], gravity=G, pairs=swarm.Pairs(0.5))
    seen = run(scene, start, 0.5)
    assert seen.observables["impacts"][-1] < 3000
    assert seen.observables["energy_error"][-1] < 1e-13


def test_balls_that_touch_and_fly_on_together_do_not_collide_without_end():
    """Of what is round-off of their velocities nothing is left that could part them."""
    n = np.array([0.6, 0.64, 0.48])
    position = np.array([[0.0, 0.0, 0.0], 0.2 * n]).T
    velocity = np.array([[0.3, -0.2, 0.1], [0.3, -0.2, 0.1]]).T + 1e-17 * np.array([n, -n]).T
    velocity[0, 1] -= 2.0**-54
    scene = swarm.Scene([swarm.Box((3.0,) * 3)], pairs=swarm.Pairs(0.0))
    seen = run(scene, swarm.Particles(position, velocity, radius=0.1), 2.0)
    assert seen.observables["collisions"][-1] < 5

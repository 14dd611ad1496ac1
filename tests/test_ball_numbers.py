"""The observables of balls, from states that are made by hand."""

import math

import numpy as np
import pytest

import swarm
from swarm.ball_numbers import BallNumbers, balls_volume, inertias, rotational_energy
from swarm.state import Balls, State

VESSEL = swarm.Scene([swarm.Sphere(1.0)])


def state_of(balls, mass=None):
    n = len(balls.radius)
    none, where = np.zeros(n), np.zeros((3, n))
    return State(where, where, np.ones(n) if mass is None else mass, none, none, balls.collisions, none, none, None,
                 balls=balls)  # fmt: skip


def of(n, volume=2.0, scene=VESSEL):
    start = swarm.Particles(np.zeros((3, n)), np.zeros((3, n)), radius=0.1)
    start.volume = volume
    return BallNumbers(scene, start), Balls(start.radius, np.zeros(n, np.int64), np.zeros(1))


def test_a_rate_and_a_pressure_are_of_the_frame_before():
    numbers, balls = of(4)
    state = state_of(balls)
    numbers.frame(state, 0.0, 3.0)
    first = numbers.seen(state)
    assert first["collisions"] == 0
    assert math.isnan(first["collision_rate"])
    assert math.isnan(first["pressure"])
    balls.collisions[:] = 1, 2, 2, 1
    balls.virial[0] = 5.0
    numbers.frame(state, 0.5, 3.0)
    # (2 3 J + 5/0.5)/(3 2)
    assert numbers.seen(state) == {"collisions": 3, "collision_rate": 6.0, "pressure": 16.0 / 6.0}
    numbers.frame(state, 1.0, 1.0)
    # No balls met; by the trapezoidal rule K is 2.
    assert numbers.seen(state) == {"collisions": 3, "collision_rate": 0.0, "pressure": 4.0 / 6.0}
    numbers.frame(state, 2.0, 1.0, action=10.0)
    assert numbers.seen(state)["pressure"] == pytest.approx(2.0 * (10.0 - 2.5) / 6.0, rel=1e-15)


ALL = {"left": {"openings": [swarm.Sphere(2.0)]}, "absorbed": {"laws": [swarm.Absorb(1.0)]},
       "waiting": {"laws": [swarm.Sticky(1e6)]}}  # fmt: skip


@pytest.mark.parametrize("law", ALL.values(), ids=list(ALL))
@pytest.mark.parametrize("method", [swarm.Impact(), swarm.Penalty(dt=2e-3, penalty=1e5)], ids=["hard", "soft"])
def test_balls_that_have_left_or_wait_have_no_pressure(law, method):
    """All of them do after the time of a crossing; what they keep as their velocity presses on nothing."""
    vessel = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), **law)])
    start = swarm.fill(vessel, 3, speed=1.0, radius=0.02, seed=1)
    seen = swarm.simulate(vessel, start, method, until=4.0, every=2.0, compile="never", progress=False).observables
    assert seen["pressure"][1] > 0.0
    assert seen["pressure"][2] == 0.0


@pytest.mark.parametrize("method", [swarm.Impact(), swarm.Penalty(0.01, 1e3, 1.5)])
def test_balls_beyond_an_open_face_have_no_pressure(method):
    """Of two, one leaves, which then counts as escaped; the other goes on from wall to wall."""
    balls = swarm.Particles([[0.0, 0.0], [0.0, 0.5], [0.0, -0.5]], [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], radius=0.1)
    balls.volume = 8.0
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0), open=["+z"])])
    seen = swarm.simulate(scene, balls, method, until=6.0, every=1.0, compile="never").observables
    assert seen["escaped"].tolist() == [0, 0, 1, 1, 1, 1, 1]
    alone = swarm.Particles(balls.position[:, 1:], balls.velocity[:, 1:], radius=0.1)
    alone.volume = 8.0
    other = swarm.simulate(scene, alone, method, until=6.0, every=1.0, compile="never").observables
    assert seen["pressure"][3:].tolist() == pytest.approx(other["pressure"][3:].tolist(), rel=1e-12)
    assert seen["pressure"][1] > 1.5 * other["pressure"][1]


def test_a_run_that_goes_on_has_the_same():
    numbers, balls = of(2)
    numbers.frame(state_of(balls), 0.0, 1.0)
    numbers.frame(state_of(balls), 1.0, 2.0)
    other, _balls = of(2)
    for name, array in other.arrays().items():
        np.copyto(array, numbers.arrays()[name])
    for one in (numbers, other):
        one.frame(state_of(balls), 2.0, 2.0)
    assert numbers.seen(state_of(balls)) == other.seen(state_of(balls))


def test_in_a_plane_a_pressure_is_per_length():
    disc = swarm.Scene([swarm.Cylinder(1.0)], plane="z")
    numbers, balls = of(2, 2.0, disc)
    numbers.frame(state_of(balls), 0.0, 1.0)
    numbers.frame(state_of(balls), 1.0, 1.0)
    assert numbers.seen(state_of(balls))["pressure"] == 2.0 / (2.0 * 2.0)
    assert balls_volume(disc, np.array([1.0, 2.0])) == pytest.approx(5.0 * math.pi)
    assert balls_volume(VESSEL, np.array([1.0, 2.0])) == pytest.approx(12.0 * math.pi)


def test_without_a_volume_the_pressure_is_no_number():
    numbers, balls = of(2, None)
    numbers.frame(state_of(balls), 0.0, 1.0)
    numbers.frame(state_of(balls), 1.0, 1.0)
    assert math.isnan(numbers.seen(state_of(balls))["pressure"])


def test_spins_are_in_the_energy_and_the_angular_momentum():
    numbers, balls = of(2)
    balls = balls._replace(spin=np.array([[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]]), radius=np.array([0.5, 1.0]))
    mass = np.array([2.0, 3.0])
    assert inertias(mass, balls.radius) == pytest.approx([0.2, 1.2])
    assert rotational_energy(mass, balls.radius, balls.spin) == pytest.approx(0.5 * (0.2 + 1.2 * 4.0))
    assert rotational_energy(mass, balls.radius, None) == 0.0
    state = state_of(balls, mass)
    numbers.frame(state, 0.0, 1.0)
    seen = numbers.added({"total_energy": 1.0, "angular_momentum": np.array([0.0, 0.0, 1.0])}, state)
    assert seen["rotational_energy"] == pytest.approx(2.5)
    assert seen["total_energy"] == pytest.approx(3.5)
    assert seen["angular_momentum"] == pytest.approx([0.2, 2.4, 1.0])

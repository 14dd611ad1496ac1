"""Bodies with friction that stick: they stop, stay where they are, and lose what they had; others slide and turn on."""

import itertools
import math

import numpy as np
import pytest

import swarm

CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
SIZE, DENSITY, GRAVITY = 0.016, 1200.0, 9.81
FLOOR = {"half_widths": (0.1, 0.1, 0.1), "center": (0.0, 0.0, 0.1)}


def on_the_floor(points, density=DENSITY, velocity=(0.0, 0.0, 0.0)):
    """A body, its lowest points on the floor, whose points all have one velocity."""
    body = swarm.rigid(points, density)
    place = body.points.T - np.array([[0.0], [0.0], [body.points[:, 2].min()]])
    lowest = (body.contacts @ place.T)[:, 2].min()
    place[2] -= lowest
    return swarm.Bodies(body, place, np.tile(np.array(velocity)[:, None], (1, len(body))))


def run(bodies, until, *, dt, gravity, **laws):
    """The result of a run in a box that stands on z = 0."""
    scene = swarm.Scene([swarm.Box(**FLOOR, **laws)], gravity=gravity)
    return swarm.simulate(scene, bodies, swarm.Impact(dt=dt), until=until, compile="always", threads=1, progress=False)


@pytest.mark.parametrize("restitution", [0.0, 0.9, 1.0])
@pytest.mark.parametrize("velocity", [(1e-3, 0.0, 0.0), (-7e-4, 2e-4, 0.0)])
def test_a_die_that_slides_slowly_stops_within_a_step(restitution, velocity):
    """It is slower than friction makes it in a step: it loses all its energy and stays where it is, at rest."""
    start = on_the_floor(SIZE / 2 * CUBE, velocity=velocity)
    mass = start.body.mass_matrix.sum()
    laws = {"restitution": restitution, "friction": 0.4}
    result = run(start, 3e-3, dt=1e-3, gravity=(0.0, 0.0, -GRAVITY), **laws)
    assert np.abs(result.bodies.velocity).max() < 1e-15
    assert np.abs(result.bodies.position - start.position).max() < 1e-3 * math.hypot(*velocity)
    lost = 0.5 * mass * np.square(velocity).sum()
    assert result.observables["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-9)
    assert result.observables["energy_error"].max() < 1e-15


@pytest.mark.parametrize(("friction", "slides"), [(0.3, True), (0.5, True), (0.7, False), (1.0, False)])
def test_a_die_on_a_slope_slides_as_friction_lets_it(friction, slides):
    """With the acceleration g (sin - mu cos) where mu < tan, and not at all where mu > tan = 0.577."""
    angle, until = math.radians(30.0), 4e-3
    gravity = (GRAVITY * math.sin(angle), 0.0, -GRAVITY * math.cos(angle))
    start = on_the_floor(SIZE / 2 * CUBE * [1.0, 1.0, 0.25])
    result = run(start, until, dt=1e-3, gravity=gravity, restitution=0.3, friction=friction)
    speed = (gravity[0] + friction * gravity[2]) * until if slides else 0.0
    expected = np.broadcast_to(np.array([speed, 0.0, 0.0])[:, None, None], result.bodies.velocity.shape)
    assert result.bodies.velocity == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("dt", "off"), [(4e-3, 2e-4), (1e-3, 2e-5)])
def test_a_rod_whose_foot_sticks_turns_about_it(dt, off):
    """As a pendulum upside down: omega^2 = 2 g (cos a0 - cos a)/l of its free mass, and its foot rests."""
    length, first = 0.1, math.radians(15.0)
    rod = swarm.dumbbell(length=length, mass=1.0)
    tip = [length * math.sin(first), 0.0, length * math.cos(first)]
    start = swarm.Bodies(rod, np.array([[0.0, 0.0, 0.0], tip]).T, np.zeros((3, 2)))
    result = run(start, 0.04, dt=dt, gravity=(0.0, 0.0, -GRAVITY), restitution=0.5, friction=1.0)
    place, velocity = result.bodies.position[..., 0].T, result.bodies.velocity[..., 0].T
    foot = int(np.argmin(place[:, 2]))
    assert np.abs(place[foot]).max() < 1e-14
    assert np.abs(velocity[foot]).max() < 1e-15
    fallen = tip[2] - place[1 - foot, 2]
    assert fallen > 5e-5
    assert np.square(velocity[1 - foot]).sum() == pytest.approx(2.0 * GRAVITY * fallen, rel=off)
    assert result.observables["energy_error"].max() < 1e-14


def test_a_contact_that_stops_in_a_tiny_step_keeps_the_books():
    """Here in 5e-12 s, with a force of 10^5 N: over the round-off of a place that is 1e-5 of the energy of the die."""
    body = swarm.rigid(SIZE / 2 * CUBE, DENSITY)
    vessel = swarm.Box((0.03, 0.03, 0.04), restitution=0.5, friction=0.3)
    scene = swarm.Scene([vessel], gravity=(0.0, 0.0, -GRAVITY))
    thrown = swarm.place(scene, body, 3000, speed=0.5, seed=1)
    start = swarm.Bodies(body, thrown.position[:, :, 2764:2765], thrown.velocity[:, :, 2764:2765])
    method, options = swarm.Impact(dt=2e-3), {"compile": "always", "threads": 1, "progress": False}
    result = swarm.simulate(scene, start, method, until=0.2, every=0.1, **options)
    assert result.observables["energy_error"].max() < 1e-12

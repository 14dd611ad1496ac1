"""Edges, corners, wedges and cusps, with and without gravity: exact, or else inside with exact energy."""

import math

import numpy as np
import pytest
from conftest import rarely
from energy_books import unbooked
from physics.billiards import EPSILON, run, unfolded

import swarm

pytestmark = pytest.mark.physics

FAR = swarm.Plane((0.0, 0.0, 1.0), 5.0)
GAPS = [0.0, 1e-12, 1e-9, 1e-6, 1e-3]


def planes(*walls):
    """Three planes, those missing out of reach: the same kernel for all."""
    return swarm.Scene([*walls, FAR, FAR][:3])


def wedge(angle):
    """Between y = 0 and the ray at `angle`; its edge is the z axis."""
    side = swarm.Plane((-math.sin(angle), math.cos(angle), 0.0), 0.0)
    return planes(swarm.Plane((0.0, -1.0, 0.0), 0.0), side)


def checked(scene, start, until, compile="auto"):
    """Run, and what must always hold; its worst penetration in units of the last place of 1."""
    result = run(scene, start, swarm.Impact(), until, 0.25, compile)
    assert result.observables["energy_error"].max() <= 1e-13
    assert result.observables["max_penetration"].max() <= 8.0 * EPSILON
    return result


# --- Edges and corners of planes -------------------------------------------------------------------------


@pytest.mark.parametrize("number", [2, 3])
def test_perpendicular_planes_hit_at_once_reverse_the_velocity(number):
    """All bits: the reflections only change signs."""
    scene = swarm.Scene([swarm.Plane(tuple(row), 0.0) for row in np.eye(3)])
    velocity = np.array([1.0, 1.0, 1.0 if number == 3 else 0.0])
    start = swarm.Particles(-velocity + [0.0, 0.0, -0.25 * (number == 2)], velocity)
    end = run(scene, start, swarm.Impact(), 2.0)
    assert (end.particles.velocity == -start.velocity).all()
    assert end.particles.position == pytest.approx(start.position, abs=2.0 * EPSILON)
    assert end.observables["impulse"][-1] == pytest.approx(2.0 * velocity, rel=EPSILON)


@pytest.mark.parametrize("apart", [0.0, 1e-17, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6])
def test_planes_hit_almost_at_once_reverse_the_velocity(apart):
    """However far the impacts are apart, perpendicular planes do not disturb each other."""
    turn, _ = np.linalg.qr(np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [5.0, 6.0, 0.0]]))
    for frame in (np.eye(3), turn):
        scene = swarm.Scene([swarm.Plane(tuple(row), 0.0) for row in frame])
        start = swarm.Particles(frame.T @ [-0.5, -0.5 - apart, -0.5 + apart], frame.T @ [1.0, 1.0, 1.0])
        end = checked(scene, start, 1.0)
        assert end.particles.velocity == pytest.approx(-start.velocity, abs=1e-14)
        assert end.particles.position == pytest.approx(start.position, abs=4.0 * apart + 1e-14)


@pytest.mark.parametrize("angle", [1.0, 0.3, 0.1, 0.03, 0.01])
def test_a_wedge_turns_a_particle_as_its_mirror_images_say(angle):
    """pi/angle impacts, when none of them is too short to be seen by itself."""
    scene, random = wedge(angle), np.random.default_rng(1)
    for _ in range(10):
        part, aim = random.uniform(0.2, 0.8), random.uniform(0.05, 0.3)
        r = np.array([math.cos(part * angle), math.sin(part * angle), 0.0])
        v = np.array([-math.cos(aim), -math.sin(aim), 0.1])
        end = run(scene, swarm.Particles(r, v), swarm.Impact(shortest_flight=1e-12), 2.5)
        where, velocity, _ = unfolded(r, v, angle, 2.5)
        assert end.observables["impacts"][-1] >= math.pi / angle * 0.5
        assert end.particles.position[:2, 0] == pytest.approx(where, abs=1e-11)
        assert end.particles.velocity[:2, 0] == pytest.approx(velocity, abs=1e-11)


@pytest.mark.parametrize("angle", [0.1, 0.01, 1e-3, 1e-4])
def test_a_wedge_costs_a_bounded_number_of_impacts(angle):
    """Into the edge, past it and from it, with the default shortest flight."""
    part = np.linspace(0.1, 0.9, 20) * angle
    start = np.array([np.cos(part), np.sin(part), 0.0 * part])
    for velocity in (-start, np.array([[-1.0], [0.0], [0.1]]) + 0.0 * start):
        result = checked(wedge(angle), swarm.Particles(start, velocity), 3.0, "always")
        assert result.observables["impacts"][-1] / 20 <= 4.0 * math.pi / angle + 1e4
    from_edge = swarm.Particles(np.zeros((3, 3)), [[-1.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.1, 0.1, 1.0]])
    checked(wedge(angle), from_edge, 3.0, "always")


@pytest.mark.parametrize("angle", [0.3, 0.01, 1e-4, 1e-6])
def test_along_the_edge_of_a_wedge_it_runs_freely(angle):
    """Pressed into it by gravity or not; that nearly opposite walls let it pass is for test_sliding.py to show."""
    for pull in (None, (-1.0, -0.5 * angle, 0.0)):
        scene = swarm.Scene(wedge(angle).surfaces, pull)
        result = run(scene, swarm.Particles([0.0] * 3, [0.0, 0.0, 1.0]), swarm.Impact(), 2.0, 0.5)
        x, y, z = result.particles.position[:, 0]
        assert z == pytest.approx(2.0, rel=1e-9)
        # Where it meets the second wall is known to 1e-13 of the size across it, so to that over the angle along it.
        assert math.hypot(x, y) <= 1e-9 + 1e-11 / angle
        assert result.observables["energy_error"].max() <= 1e-13


# --- Cusps -----------------------------------------------------------------------------------------------


def cusp(gap, gravity=None):
    """A cavity and a ball that touches its wall at (1, 0, 0), or all but."""
    return swarm.Scene([swarm.Sphere(1.0), swarm.Sphere(0.5, (0.5 - gap, 0.0, 0.0), side="outside")], gravity)


@pytest.mark.parametrize("gravity", [None, rarely((9.81, 0.0, 0.0)), rarely((5.0, 0.0, -5.0))], ids=str)
@pytest.mark.parametrize("gap", GAPS)
def test_a_cusp_costs_a_bounded_number_of_impacts(gap, gravity):
    """Shot into it, aimed at its tip, let go, and along the wall into it: 1e4 steps a crossing, and some."""
    scene = cusp(gap, gravity)
    start = swarm.fill(scene, 8, speed=1.0, seed=5)
    aim = np.array([[1.0], [0.0], [0.0]]) - start.position
    angle = np.linspace(0.3, 2.0, 8)
    wall = np.array([np.cos(angle), np.sin(angle), 0.0 * angle])
    along = np.array([np.sin(angle), -np.cos(angle), 0.0 * angle])
    for particles in (
        start,
        swarm.Particles(start.position, aim / np.linalg.norm(aim, axis=0)),
        swarm.Particles(start.position, 0.0 * aim),
        swarm.Particles(wall, along),
    ):
        result = checked(scene, particles, 2.0, "always")
        assert result.observables["impacts"][-1] / len(particles) <= 2e5


@pytest.mark.parametrize("e", [0.5, 0.0])
def test_a_cusp_keeps_the_angular_momentum_about_its_axis(e):
    """Gravity into the tip, along the axis: no rest even at e = 0, because without friction L_x stays."""
    walls = [swarm.Sphere(1.0, restitution=e), swarm.Sphere(0.5, (0.5, 0.0, 0.0), side="outside", restitution=e)]
    scene = swarm.Scene(walls, (9.81, 0.0, 0.0))
    start = swarm.fill(scene, 5, speed=0.5, seed=6)
    result = run(scene, start, swarm.Impact(), 1.0, 0.125, "always")
    assert unbooked(result.observables) <= 1e-13 * abs(result.observables["total_energy"][0])
    assert result.observables["max_penetration"].max() <= 8.0 * EPSILON
    assert result.observables["dissipated_energy"][-1] > 0.0
    spins = [p.position[1] * p.velocity[2] - p.position[2] * p.velocity[1] for p in (start, result.particles)]
    assert np.abs(spins[1] - spins[0]).max() <= 1e-9
    assert np.abs(spins[0]).min() > 0.1
    assert (np.linalg.norm(result.particles.velocity, axis=0) > 0.0).all()


# --- All of it -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
def test_random_scenes_stay_inside_with_their_energy(seed):
    """Two spheres in random places, gravity, launches that fly, graze, start at rest and start on a wall."""
    random = np.random.default_rng(seed)
    radius = random.uniform(0.1, 0.6)
    center = random.standard_normal(3)
    center *= (1.0 - radius - random.choice([0.0, 1e-10, 1e-5, 0.1])) / np.linalg.norm(center)
    ball = swarm.Sphere(radius, tuple(center), side="outside")
    scene = swarm.Scene([swarm.Sphere(1.0), ball], tuple(random.standard_normal(3) * random.choice([0.1, 10.0])))
    start = swarm.fill(scene, 20, speed=1.0, seed=seed)
    position, velocity = start.position.copy(), start.velocity.copy()
    velocity[:, :5] = 0.0
    # On the wall of the cavity, where the ball leaves it free, along it.
    wall = random.standard_normal((3, 5))
    wall /= np.linalg.norm(wall, axis=0)
    free = (np.linalg.norm(wall - center[:, None], axis=0) > radius + 1e-3).nonzero()[0]
    position[:, free] = wall[:, free] * (1.0 - EPSILON)
    velocity[:, free] = np.cross(wall[:, free].T, random.standard_normal(3)).T
    checked(scene, swarm.Particles(position, velocity), 1.5, "always")
